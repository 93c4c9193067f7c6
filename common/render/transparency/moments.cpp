// Moment-based transparency with four power moments (Muenstermann et al. 2018): memory that does not grow
// with the strands, no order, two walks over the strands. What is in front of a fragment is guessed from the
// moments of depth of its pixel; the opacity of all is exact.

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/render/transparency/pixel_target.h"
#include "common/render/transparency/transparency.h"

namespace strandcast {
namespace {

constexpr size_t kMoments = 0;
constexpr size_t kAbsorbance = 1;
// Texture units behind those of begin_blended().
constexpr uint32_t kMomentsUnit = 9;
constexpr uint32_t kAbsorbanceUnit = 10;
// Followers stray a little from the key strands, by this share of the hair's depth.
constexpr float kMargin = 0.05f;
// Where hair has no depth the logarithm of its ends has to differ all the same.
constexpr float kLeastRatio = 1.0001f;

struct HairDistance {
  float near_m;
  float far_m;
};

/// How far from the camera the hair begins and ends. Vertices that are not numbers say nothing.
HairDistance hair_distance(const RenderTurn& turn) {
  const glm::mat4& clip = turn.view.clip_from_head;
  const glm::vec4 distance_row(clip[0][3], clip[1][3], clip[2][3], clip[3][3]);
  float near_m = std::numeric_limits<float>::max();
  float far_m = 0.0f;
  for (const glm::vec3& point : turn.strands.position_m) {
    const float distance_m = glm::dot(distance_row, glm::vec4(point, 1.0f));
    if (!(distance_m < std::numeric_limits<float>::max())) continue;
    near_m = std::min(near_m, distance_m);
    far_m = std::max(far_m, distance_m);
  }
  const float margin_m = kMargin * std::max(far_m - near_m, 0.0f);
  near_m = std::max(near_m - margin_m, turn.view.near_m);
  return {near_m, std::max(far_m + margin_m, kLeastRatio * near_m)};
}

class MomentsPass : public StrandDrawPass {
 public:
  using StrandDrawPass::StrandDrawPass;

  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(begin(turn));
    begin_adding();
    begin_blended(strands_, scene_, expanded_, turn);
    const HairDistance hair = hair_distance(turn);
    strands_.program().set("u_hair_near_m", hair.near_m);
    strands_.program().set("u_hair_far_m", hair.far_m);
    strands_.draw(scene_, expanded_);
    glDisable(GL_BLEND);
    return {};
  }

 protected:
  /// Binds the target, cleared in the first batch.
  virtual Status begin(const RenderTurn& turn) = 0;
  const gl::Program& program() const { return strands_.program(); }
};

class SumPass final : public MomentsPass {
 public:
  SumPass(RenderScene& scene, ExpandedStrands& expanded, PixelTarget& moments)
      : MomentsPass(scene, expanded,
                    strand_pass(scene, "render/moments", {&expanded, &scene.light, &scene.scene}, {&moments}),
                    "render/moments_sum.frag"),
        moments_(moments) {}

 private:
  Status begin(const RenderTurn& turn) override {
    if (turn.batch_index == 0) {
      RETURN_IF_ERROR(moments_.resize(turn.size_px));
      moments_.clear(kMoments, 0.0f);
      moments_.clear(kAbsorbance, 0.0f);
    }
    moments_.begin();
    return {};
  }
  PixelTarget& moments_;
};

class ColorPass final : public MomentsPass {
 public:
  ColorPass(RenderScene& scene, ExpandedStrands& expanded, PixelTarget& moments, PixelTarget& sum)
      : MomentsPass(scene, expanded,
                    strand_pass(scene, "render/moments_color",
                                {&expanded, &scene.light, &scene.scene, &moments}, {&sum}),
                    "render/moments_color.frag"),
        moments_(moments),
        sum_(sum) {}

 private:
  Status begin(const RenderTurn& turn) override {
    if (turn.batch_index == 0) {
      RETURN_IF_ERROR(sum_.resize(turn.size_px));
      sum_.clear(0, 0.0f);
    }
    sum_.begin();
    moments_.texture(kMoments).bind(kMomentsUnit);
    moments_.texture(kAbsorbance).bind(kAbsorbanceUnit);
    program().set("u_moments", static_cast<int>(kMomentsUnit));
    program().set("u_absorbance", static_cast<int>(kAbsorbanceUnit));
    return {};
  }
  PixelTarget& moments_;
  PixelTarget& sum_;
};

class MomentsBlendPass final : public LayerBlendPass {
 public:
  MomentsBlendPass(RenderScene& scene, PixelTarget& moments, PixelTarget& sum)
      : LayerBlendPass(scene, "render/moments_blend", {&moments, &sum}, "render/moments_blend.frag"),
        moments_(moments),
        sum_(sum) {}

 private:
  void bind(const gl::Program& program) const override {
    sum_.texture(0).bind(kMomentsUnit);
    moments_.texture(kAbsorbance).bind(kAbsorbanceUnit);
    program.set("u_sum", static_cast<int>(kMomentsUnit));
    program.set("u_absorbance", static_cast<int>(kAbsorbanceUnit));
  }
  PixelTarget& moments_;
  PixelTarget& sum_;
};

}  // namespace

void add_moments(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  auto& moments =
      passes.keep(std::make_unique<PixelTarget>("moments", std::vector<uint32_t>{GL_RGBA32F, GL_R32F}));
  auto& sum = passes.keep(std::make_unique<PixelTarget>("moment colours", std::vector<uint32_t>{GL_RGBA16F}));
  add_camera_walk(scene, walks, passes, "for_moments");
  passes.add(std::make_unique<SumPass>(scene, walks.expanded(), moments));
  passes.add(make_ready_pass(scene, "render/moments_ready", {&moments}, {&sum}));
  add_camera_walk(scene, walks, passes);
  passes.add(std::make_unique<ColorPass>(scene, walks.expanded(), moments, sum));
  passes.add(std::make_unique<MomentsBlendPass>(scene, moments, sum));
}

}  // namespace strandcast
