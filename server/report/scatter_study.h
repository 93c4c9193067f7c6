// The ways to get strands into a volume, side by side: the host's and those of OpenGL that the simulation may
// use, and the ones that document 003 tried (4.2.4). All make the same volume of the same hair, without
// smoothing, and are held against a sum in double.
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

/// Fills the study's part about it. Where there is no OpenGL only the host's way is in it. Leaves another
/// context current than there was.
Status study_scatters(const ScatterStudyDesc& desc, VolumeStudy& study);

}  // namespace strandcast
