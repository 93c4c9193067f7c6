// ScalpView: measures how much of the scalp a camera sees between the hair, and runs strandcast-report scalp
// during a head motion. Needs the thread's GL context.
//
// Scalp is the drawn skin with at least half of the root density of the middle of the hair
// (common/render/scalp_cover.h). Visible is the share of its pixels on the bald head that still show skin
// through the hair; a pixel with both counts half. The camera is the scene's, carried along with the head's
// position and rotation, so that it always sees the same scalp and only hair changes. Three more cameras are
// turned about the head by a quarter, a half and three quarters.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/gl/egl_context.h"
#include "common/motion/motion_file.h"
#include "common/pictures/image_codec.h"
#include "common/render/renderer.h"
#include "server/report/stream_motion.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Number of views: the scene's camera and three around the head.
inline constexpr size_t kScalpViews = 4;
using ScalpShares = std::array<double, kScalpViews>;

class ScalpView {
 public:
  /// Makes a view. BadInput for a scene without a drawn head, or with no scalp in any view.
  static Result<ScalpView> make(const gl::ShaderLibrary& shaders, const gl::DeviceInfo& device,
                                const SceneAsset& asset, const SceneDesc& scene, RenderSize size);

  /// Returns the visible shares, 0..1, for hair in head space, (vertex_count x strand_count); 0 if a view has
  /// no scalp.
  Result<ScalpShares> visible(const std::vector<glm::vec3>& position_in_head_m);
  /// Returns a picture of the hair by the scene's own camera.
  Result<Image> picture(const std::vector<glm::vec3>& position_in_head_m);

 private:
  ScalpView() = default;
  Status find_scalp(Renderer& bald, const std::vector<glm::vec3>& hair_away_m);

  std::array<CameraDesc, kScalpViews> cameras_;
  RenderSize size_;
  std::unique_ptr<Renderer> marked_;  // skin in one colour, hair in another, bright
  std::unique_ptr<Renderer> shown_;
  std::array<std::vector<bool>, kScalpViews> is_scalp_;  // by pixel
};

struct ScalpRunDesc {
  SceneDesc scene;
  StreamMotion motion;
  double seconds = 6.0;   // of the motion, from its beginning
  double every_s = 0.25;  // between two measurements
  RenderSize size{640, 360};
};

/// Measurement at one moment.
struct ScalpSample {
  double time_s = 0.0;
  ScalpShares visible{};
  double root_p95_deg = 0.0;  // of the angles between first free segments and where they are groomed
};

struct ScalpRun {
  ScalpShares groomed{};  // visible share of hair as loaded
  std::vector<ScalpSample> samples;
  Image groomed_picture;
  Image worst_picture;  // of the moment with most scalp from all around

  /// Return the mean of all samples relative to the groomed hair, less 1: by the scene's camera, and over all
  /// views.
  double growth() const;
  double growth_around() const;
  /// Returns the same growth for the 95 % quantile of the samples.
  double growth_p95() const;
};

/// Runs the scene's solver under the motion, with colliders and without wind. `device` describes the current
/// context, which is the executor's if it has one.
Result<ScalpRun> run_scalp(const ScalpRunDesc& desc, const gl::ShaderLibrary& shaders,
                           const gl::DeviceInfo& device, Executor& executor);

std::string scalp_text(const ScalpRunDesc& desc, const ScalpRun& run);
std::string scalp_csv(const ScalpRun& run);

}  // namespace strandcast
