// Reads the files of simulated hair again, for exports that carry on what they say: ids, groups, names,
// widths, coordinates, unit and axes. A stream has none of it. One thread.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "client/app/ctl_commands.h"
#include "client/export/export_source.h"
#include "common/groom/abc_motion.h"
#include "common/motion/motion_file.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

struct HairOrigin {
  std::shared_ptr<const ExportOrigin> strands;
  double unit_m = 1.0;  // metres per unit of the files
  bool is_z_up = false;
  glm::dmat4 file_from_head{1.0};  // of points
  bool is_world_at_rest = false;   // the world is the head's space at rest: curves move the head
};

/// Loads the files. Errors of load_file_groom(), and BadInput for other hair than the asset's.
Result<HairOrigin> load_origin(const FileGroomDesc& file, const SceneAsset& asset);

/// Loads where the files have their head, and nothing of the strands.
Result<HairOrigin> load_place(const FileGroomDesc& file);

/// Returns the motion of the head under curves that lie where these files have their hair, judged and noted
/// as that of a clip. The head is at the world's origin and unturned with the file's first sample. Frames are
/// as far apart as samples; where these are uneven, as the nearest two.
MotionFile head_motion(const CurveMotion& motion, const HairOrigin& origin, const std::string& name,
                       const MotionFileOptions& options);

/// Asks a server for the scene of the target's head, as who controls it.
Result<SceneDesc> ask_scene(const CtlTarget& target);

}  // namespace strandcast
