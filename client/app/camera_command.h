// strandcast-ctl camera: sets the camera of viewers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/app/ctl_commands.h"

namespace CLI {
class App;
}

namespace strandcast {

struct CameraOptions {
  std::string view;      // scene, front, left, right, back or top; empty: as the scene's, but for the others
  uint64_t session = 0;  // whose; 0 = of all viewers
  std::optional<double> yaw_deg, pitch_deg, distance_m, fov_deg;
  std::vector<double> target_m;  // head space; empty: the scene's
};

/// Adds the options of the sub-command to `app`; `app` and `options` must exist until the command line is
/// parsed.
void declare_camera(CLI::App& app, CameraOptions& options);

/// Returns the camera that the options state; parts that are not given come from the scene's camera. BadInput
/// if no option is given.
Result<CameraDesc> camera_of(const CameraOptions& options, const CameraDesc& scene_camera);

int run_camera(const CtlTarget& target, const CameraOptions& options);

}  // namespace strandcast
