// Reads the files of simulated hair again, for exports that carry on what they say: ids, groups, names,
// widths, coordinates, unit and axes. A stream has none of it. One thread.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "client/app/ctl_commands.h"
#include "client/export/export_source.h"
#include "common/groom/abc_motion.h"
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

/// Returns head motion from curves that lie where these files have their hair. The head is at the world's
/// origin and unturned with the first sample.
std::function<Pose(double t_s)> head_motion(CurveMotion motion, const HairOrigin& origin);

/// Returns sentences of what was assumed of curves as motion, as load_motion_file() has them of a clip.
std::vector<std::string> notes_of(const CurveMotion& motion, const HairOrigin& origin);

/// Asks a server for the scene of the target's head, as who controls it.
Result<SceneDesc> ask_scene(const CtlTarget& target);

}  // namespace strandcast
