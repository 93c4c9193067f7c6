#include "client/app/camera_command.h"

#include <CLI/CLI.hpp>
#include <array>
#include <numbers>

#include "common/base/command_line_error.h"
#include "common/math/polar.h"

namespace strandcast {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kTopDeg = 85.0;  // straight from above there is no up
constexpr double kMaxReachM = 100.0;
constexpr double kMinDistanceM = 0.01;
constexpr double kMinFovDeg = 2.0, kMaxFovDeg = 160.0;
constexpr const char* kSceneView = "scene";

/// Around the head, from its face on; left and right are the head's own.
struct NamedView {
  const char* name;
  double yaw_deg;
  double pitch_deg;
};
constexpr std::array<NamedView, 5> kViews{{{"front", 0.0, 0.0},
                                           {"left", 90.0, 0.0},
                                           {"right", -90.0, 0.0},
                                           {"back", 180.0, 0.0},
                                           {"top", 0.0, kTopDeg}}};

float to_rad(double degrees) {
  return static_cast<float>(degrees * kRadPerDeg);
}

}  // namespace

void declare_camera(CLI::App& app, CameraOptions& options) {
  std::vector<std::string> names{kSceneView};
  for (const NamedView& view : kViews) names.emplace_back(view.name);
  app.add_option("view", options.view, "As the scene says, or from this side of the head")
      ->check(CLI::IsMember(names));
  app.add_option("--session", options.session, "Of this viewer, as listed by sessions (default: of all)");
  app.add_option("--yaw-deg", options.yaw_deg, "So far round, from the face towards the head's left")
      ->check(without_nan(CLI::Range(-360.0, 360.0)));
  app.add_option("--pitch-deg", options.pitch_deg, "So high above the horizon")
      ->check(without_nan(CLI::Range(-kTopDeg, kTopDeg)));
  app.add_option("--distance-m", options.distance_m, "So far from what it looks at")
      ->check(without_nan(CLI::Range(kMinDistanceM, kMaxReachM)));
  app.add_option("--target-m", options.target_m,
                 "What it looks at: x y z from the head joint, +Y up, +Z ahead")
      ->expected(3)
      ->check(without_nan(CLI::Range(-kMaxReachM, kMaxReachM)));
  app.add_option("--fov-deg", options.fov_deg, "Field of view, from its lower to its upper edge")
      ->check(without_nan(CLI::Range(kMinFovDeg, kMaxFovDeg)));
}

Result<CameraDesc> camera_of(const CameraOptions& options, const CameraDesc& scene_camera) {
  const bool says_something = !options.view.empty() || options.yaw_deg || options.pitch_deg ||
                              options.distance_m || options.fov_deg || !options.target_m.empty();
  if (!says_something)
    return make_error(ErrorCode::BadInput,
                      "say where from: scene, front, left, right, back or top, or --yaw-deg, --pitch-deg, "
                      "--distance-m, --target-m, --fov-deg");
  CameraDesc camera = scene_camera;
  Polar polar = to_polar(camera.offset_m);
  for (const NamedView& view : kViews)
    if (options.view == view.name) polar = {polar.distance_m, to_rad(view.yaw_deg), to_rad(view.pitch_deg)};
  if (options.yaw_deg) polar.yaw_rad = to_rad(*options.yaw_deg);
  if (options.pitch_deg) polar.pitch_rad = to_rad(*options.pitch_deg);
  if (options.distance_m) polar.distance_m = static_cast<float>(*options.distance_m);
  const bool is_turned = options.view != kSceneView && !options.view.empty();
  if (is_turned || options.yaw_deg || options.pitch_deg || options.distance_m)
    camera.offset_m = from_polar(polar);
  if (options.target_m.size() == 3)
    camera.target_m = glm::vec3(options.target_m[0], options.target_m[1], options.target_m[2]);
  if (options.fov_deg) camera.fov_y_rad = to_rad(*options.fov_deg);
  return camera;
}

int run_camera(const CtlTarget& target, const CameraOptions& options) {
  return run_command(target, [&options](const Welcome& welcome) -> Result<ClientMessage> {
    ASSIGN_OR_RETURN(const CameraDesc camera, camera_of(options, welcome.camera));
    return ClientMessage(CameraCommand{options.session, camera});
  });
}

}  // namespace strandcast
