// Compares the methods of summing strands into a volume: the host's, those of OpenGL that the simulation may
// use, and those of Woodhouse 2017 (4.2.4). All compute the same volume of the same hair unsmoothed, and
// are compared with a sum in double precision.
#pragma once

#include <string>
#include <vector>

#include "server/report/volume_study.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

struct ScatterStudyDesc {
  const StrandLayout& layout;
  const std::vector<glm::vec3>& position_m;    // (vertex_count x strand_count) head space
  const std::vector<glm::vec3>& velocity_mps;  // relative to the head
  uint32_t resolution = 64;
  std::string gl_device;  // as EglContext::make
  uint32_t rounds = 5;
};

/// Fills this part of the study; without OpenGL only the host's method is measured. Changes the current
/// context.
Status study_scatters(const ScatterStudyDesc& desc, VolumeStudy& study);

}  // namespace strandcast
