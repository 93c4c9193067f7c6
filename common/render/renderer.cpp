#include "common/render/renderer.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/base/check.h"
#include "common/gl/pass_plan.h"
#include "common/gl/timer.h"
#include "common/render/light_volume.h"
#include "common/render/passes/expand_pass.h"
#include "common/render/passes/head_pass.h"
#include "common/render/passes/light_texture.h"
#include "common/render/passes/picture_target.h"
#include "common/render/passes/strand_pass.h"
#include "common/render/scalp_cover.h"
#include "common/render/view.h"

namespace strandcast {
namespace {

// Followers: chosen by eye on the built-in scene. Lengths are shares of the mean strand length.
constexpr float kFollowerClump = 0.75f;
constexpr float kFollowerVariation = 0.012f;
constexpr float kFollowerShorten = 0.18f;
constexpr uint32_t kMaxFollowers = 64;  // per triangle
// What is drawn follows from its size on the screen. A segment shorter than `segment_px` shows no bend, so
// fewer are drawn per gap; strands thinner than `width_px` are replaced by fewer that together are as wide.
// Every triangle costs a CPU about half a microsecond, so software renderers get coarser targets.
struct DetailTarget {
  float segment_px;
  float width_px;
};
constexpr DetailTarget kHardwareDetail{5.0f, 0.25f};
constexpr DetailTarget kSoftwareDetail{9.0f, 0.6f};
// Cells of the light volume along the largest extent of the rest shape.
constexpr float kLightCells = 32.0f;
constexpr float kMinLightCellM = 1e-4f;
// With fewer roots a sphere fitted to them is no skull.
constexpr uint32_t kMinSkullRoots = 32;
// Nor is it one when more than this share of the head's vertices lies deep inside of it, in radii.
constexpr float kDeepInside = 0.75f;
constexpr float kMaxDeepShare = 0.15f;
// The skull that shadows is a little smaller than the sphere through the roots, so that it does not darken
// them.
constexpr float kSkullShrink = 0.93f;
constexpr float kShadowLiftCells = 1.0f;
// A root tints the skin this far around it, of the hair's extent.
constexpr float kCoverReach = 0.025f;

struct RestFacts {
  float mean_length_m = 0.0f;
  float extent_m = 0.0f;  // largest side of the bounding box
};

RestFacts measure_rest(const SceneAsset& asset) {
  RestFacts facts;
  if (asset.strand_count == 0) return facts;
  double length_m = 0.0;
  glm::vec3 low = asset.rest_position_m.front();
  glm::vec3 high = low;
  for (size_t i = 0; i < asset.rest_position_m.size(); ++i) {
    const glm::vec3& point = asset.rest_position_m[i];
    low = glm::min(low, point);
    high = glm::max(high, point);
    if (i >= asset.strand_count)
      length_m += glm::length(point - asset.rest_position_m[i - asset.strand_count]);
  }
  facts.mean_length_m = static_cast<float>(length_m / asset.strand_count);
  facts.extent_m = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  return facts;
}

Status check_asset(const SceneAsset& asset) {
  const size_t expected = static_cast<size_t>(asset.strand_count) * asset.vertex_count;
  if (asset.rest_position_m.size() != expected)
    return make_error(ErrorCode::BadInput, "scene asset has {} rest positions for {} strands x {} vertices",
                      asset.rest_position_m.size(), asset.strand_count, asset.vertex_count);
  if (asset.strand_count > 0 &&
      (asset.vertex_count < kMinVertexCount || asset.vertex_count > kMaxVertexCount))
    return make_error(ErrorCode::BadInput, "scene asset has {} vertices per strand, allowed are {} to {}",
                      asset.vertex_count, kMinVertexCount, kMaxVertexCount);
  for (const RootTriangle& triangle : asset.triangle)
    if (glm::any(glm::greaterThanEqual(triangle, glm::uvec3(asset.strand_count))))
      return make_error(ErrorCode::BadInput,
                        "root triangle ({}, {}, {}) names a strand beyond the {} there are", triangle.x,
                        triangle.y, triangle.z, asset.strand_count);
  if (asset.head.normal.size() != asset.head.position_m.size())
    return make_error(ErrorCode::BadInput, "head mesh has {} normals for {} vertices",
                      asset.head.normal.size(), asset.head.position_m.size());
  for (const glm::uvec3& triangle : asset.head.triangle)
    if (glm::any(glm::greaterThanEqual(triangle, glm::uvec3(asset.head.position_m.size()))))
      return make_error(ErrorCode::BadInput,
                        "head triangle ({}, {}, {}) names a vertex beyond the {} there are", triangle.x,
                        triangle.y, triangle.z, asset.head.position_m.size());
  return {};
}

Result<gl::PassPlan> plan_passes(const SceneAsset& asset) {
  const bool has_strands = asset.strand_count > 0;
  const bool has_head = !asset.head.triangle.empty();
  return gl::make_pass_plan(
      {{"expand", has_strands, "the groom has no strands", {"key position"}, {"expanded"}},
       {"head", has_head, "the scene has no head mesh", {}, {"scene"}},
       {"strands", has_strands, "the groom has no strands", {"expanded"}, {"scene"}},
       {"resolve", true, "", {"scene"}, {"picture"}}},
      {{"expanded", 0}, {"scene", 0}, {"picture", 0}}, {"key position", "scene"}, {"picture"});
}

class GlRenderer final : public Renderer {
 public:
  GlRenderer(const gl::DeviceInfo& device, const LookDesc& look)
      : timer_(device), detail_(device.is_software ? kSoftwareDetail : kHardwareDetail), look_(look) {}

  Status load(const gl::ShaderLibrary& shaders, const SceneAsset& asset);
  Status draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size) override;
  Image read_image() override { return target_.read_image(); }
  void blit_to(uint32_t target, RenderSize target_size) override {
    target_.blit_to(target, {target_size.width, target_size.height});
  }
  const RenderProfile& profile() const override { return profile_; }

 private:
  void update_light(const PosedStrands& strands, const View& view);
  void draw_strands(const View& view);
  ExpandLevel choose_level(const View& view) const;
  template <class Work>
  double timed_ms(Work&& work) {
    timer_.begin();
    work();
    return timer_.end_ms();
  }

  gl::GpuTimer timer_;
  DetailTarget detail_;
  LookDesc look_;
  gl::PassPlan plan_;
  size_t position_count_ = 0;
  uint32_t gap_count_ = 0;  // per strand
  RestFacts rest_;
  ExpandPass expand_;
  StrandPass strands_;
  HeadPass head_;
  PictureTarget target_;
  LightVolume light_volume_{LightVolumeDesc{}};
  LightTexture light_;
  RenderProfile profile_;
};

// Whether a ball lies under the skin of a head instead of swallowing it, as a sphere through a mane that goes
// on down the neck would.
bool is_skull_of(const FittedSphere& ball, const Mesh& head) {
  const auto deep =
      std::count_if(head.position_m.begin(), head.position_m.end(), [&](const glm::vec3& point) {
        return glm::length(point - ball.center_m) < kDeepInside * ball.radius_m;
      });
  return static_cast<float>(deep) < kMaxDeepShare * static_cast<float>(head.position_m.size());
}

LightVolumeDesc describe_light(const SceneAsset& asset, const LookDesc& look, const RestFacts& rest) {
  LightVolumeDesc desc;
  desc.strand_count = asset.strand_count;
  desc.vertex_count = asset.vertex_count;
  desc.cell_m = std::max(rest.extent_m / kLightCells, kMinLightCellM);
  desc.strand_width_m = 2.0f * look.strand_radius_m;
  if (asset.strand_count > 0)
    desc.strands_per_key = 1.0f + static_cast<float>(asset.triangle.size() * look.followers) /
                                      static_cast<float>(asset.strand_count);
  if (asset.strand_count >= kMinSkullRoots && !asset.head.triangle.empty()) {
    const std::vector<glm::vec3> roots_m(asset.rest_position_m.begin(),
                                         asset.rest_position_m.begin() + asset.strand_count);
    desc.skull = fit_sphere(roots_m);
    desc.has_skull = is_skull_of(desc.skull, asset.head);
    desc.skull.radius_m *= kSkullShrink;
  }
  return desc;
}

Status GlRenderer::load(const gl::ShaderLibrary& shaders, const SceneAsset& asset) {
  RETURN_IF_ERROR(check_asset(asset));
  ASSIGN_OR_RETURN(plan_, plan_passes(asset));
  look_.followers = std::min(look_.followers, kMaxFollowers);
  look_.segments = std::clamp(look_.segments, 1u, kMaxSegmentsPerGap);
  position_count_ = asset.rest_position_m.size();
  rest_ = measure_rest(asset);
  ASSIGN_OR_RETURN(target_, PictureTarget::make(shaders));
  const LightVolumeDesc light = describe_light(asset, look_, rest_);
  light_volume_ = LightVolume(light);
  if (plan_.runs("expand")) {
    gap_count_ = asset.vertex_count - 1;
    const FollowerDesc followers{look_.followers, kFollowerClump, kFollowerVariation * rest_.mean_length_m,
                                 kFollowerShorten};
    ASSIGN_OR_RETURN(expand_, ExpandPass::make(shaders, asset, followers, look_.segments));
  }
  if (plan_.runs("strands")) {
    ASSIGN_OR_RETURN(strands_, StrandPass::make(shaders));
  }
  if (plan_.runs("head")) {
    ASSIGN_OR_RETURN(head_,
                     HeadPass::make(shaders, asset.head, scalp_cover(asset, rest_.extent_m * kCoverReach),
                                    kShadowLiftCells * light.cell_m));
  }
  return {};
}

void GlRenderer::update_light(const PosedStrands& strands, const View& view) {
  const glm::mat3 head_from_world(glm::transpose(glm::mat3_cast(strands.world_from_head.rotation)));
  const float length = glm::length(look_.light_direction);
  const glm::vec3 to_light_in_world =
      length > 0.0f ? -look_.light_direction / length : glm::vec3(0.0f, 1.0f, 0.0f);
  const glm::vec3 to_light = glm::normalize(head_from_world * to_light_in_world);
  light_volume_.build(strands.position_m, to_light);
  light_.upload(light_volume_);
  light_.set_light(look_, view, to_light);
}

// What is too small to be seen on the screen is not drawn: bends within a few pixels, and strands far thinner
// than a pixel, for which fewer and wider ones stand.
ExpandLevel GlRenderer::choose_level(const View& view) const {
  const float px_per_m = view.focal_px / static_cast<float>(kSamplesPerSide) / view.target_distance_m;
  const float gap_px = rest_.mean_length_m / static_cast<float>(gap_count_) * px_per_m;
  const float width_px = 2.0f * look_.strand_radius_m * px_per_m;
  // A size that is not a number takes the least detail.
  const auto at_most = [](float wanted, uint32_t limit) {
    return wanted > 1.0f ? static_cast<uint32_t>(std::min(std::ceil(wanted), static_cast<float>(limit)))
                         : std::min(1u, limit);
  };
  ExpandLevel level;
  level.segments_per_gap = at_most(gap_px / detail_.segment_px, look_.segments);
  level.followers = at_most(static_cast<float>(expand_.max_followers()) * width_px / detail_.width_px,
                            expand_.max_followers());
  return level;
}

void GlRenderer::draw_strands(const View& view) {
  const ExpandLevel level = choose_level(view);
  const uint32_t strand_count = expand_.strand_count(level.followers);
  const float width_m = 2.0f * look_.strand_radius_m *
                        static_cast<float>(expand_.strand_count(expand_.max_followers())) /
                        static_cast<float>(strand_count);
  const uint32_t batch = expand_.batch_strands(level.segments_per_gap);
  for (uint32_t first = 0; first < strand_count; first += batch) {
    const uint32_t count = std::min(batch, strand_count - first);
    uint32_t written = 0;
    profile_.expand_ms += timed_ms([&] { written = expand_.run(first, count, level); });
    profile_.strands_ms +=
        timed_ms([&] { strands_.run(expand_.expanded(), written, width_m, view, look_, light_); });
    profile_.drawn_strands += count;
    profile_.drawn_segments += written;
  }
}

Status GlRenderer::draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size) {
  if (strands.position_m.size() != position_count_)
    return make_error(ErrorCode::BadInput, "the strands have {} vertices but the scene has {}",
                      strands.position_m.size(), position_count_);
  if (size.width > kMaxImageSide || size.height > kMaxImageSide)
    return make_error(ErrorCode::LimitExceeded, "a picture of {} x {} pixels exceeds {} per side", size.width,
                      size.height, kMaxImageSide);
  const glm::uvec2 pixels(size.width, size.height);
  ASSIGN_OR_RETURN(const View view,
                   make_view(camera, strands.world_from_head.rotation, pixels * kSamplesPerSide));
  profile_ = RenderProfile{};
  RETURN_IF_ERROR(target_.resize(pixels));
  profile_.expand_ms += timed_ms([&] {
    update_light(strands, view);
    if (plan_.runs("expand")) expand_.upload(strands.position_m);
  });
  target_.begin_scene();
  if (plan_.runs("head")) profile_.head_ms = timed_ms([&] { head_.run(view, look_, light_); });
  if (plan_.runs("strands")) draw_strands(view);
  profile_.resolve_ms = timed_ms([&] { target_.resolve(look_.background); });
  return {};
}

}  // namespace

Result<std::unique_ptr<Renderer>> Renderer::make(const gl::ShaderLibrary& shaders,
                                                 const gl::DeviceInfo& device, const SceneAsset& asset,
                                                 const LookDesc& look) {
  auto renderer = std::make_unique<GlRenderer>(device, look);
  RETURN_IF_ERROR(renderer->load(shaders, asset));
  return std::unique_ptr<Renderer>(std::move(renderer));
}

}  // namespace strandcast
