#include "common/render/detail/culling.h"

#include <epoxy/gl.h>

#include <utility>

#include "common/render/passes/strand_pass.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

constexpr uint32_t kSegmentsPerMask = 32;
constexpr uint32_t kDepthUnit = 0;

uint64_t mask_count(uint64_t segments) {
  return (segments + kSegmentsPerMask - 1) / kSegmentsPerMask;
}

void dispatch(uint64_t invocations) {
  glDispatchCompute(
      static_cast<GLuint>((invocations + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize), 1, 1);
}

class CullPass final : public RenderPass {
 public:
  CullPass(RenderScene& scene, ExpandedStrands& expanded, const std::string& name, bool is_first)
      : Pass(strand_pass(scene, name, {&expanded, &scene.scene}, {&expanded, scene.culling})),
        scene_(scene),
        expanded_(expanded),
        is_first_(is_first) {}

  bool is_batched() const override { return true; }
  Status prepare(const RenderSetup& setup) override {
    return is_first_ ? scene_.culling->prepare(setup.shaders) : Status{};
  }
  Status run(RenderTurn& turn) override {
    // Of a picture in one batch the first walk's choice still holds.
    const bool is_known = !is_first_ && turn.batch_index == 0 && !turn.has_more_batches;
    if (!is_known) scene_.culling->run(scene_, expanded_, turn);
    return {};
  }

 private:
  RenderScene& scene_;
  ExpandedStrands& expanded_;
  bool is_first_;
};

}  // namespace

Culling::Culling(const RenderScene& scene, const ExpandedStrands& expanded)
    : Resource("culling"),
      max_segments_(expanded.size_bytes() / kSegmentBytes),
      has_occlusion_(scene.methods.culling == CullingMethod::Occlusion),
      chosen_(max_segments_) {}

Status Culling::prepare(const gl::ShaderLibrary& shaders) {
  chosen_.allocate();
  mask_ = gl::Buffer("cull mask", sizeof(uint32_t) * mask_count(max_segments_));
  ASSIGN_OR_RETURN(sum_, RunningSum::make(shaders, mask_count(max_segments_)));
  if (has_occlusion_) {
    ASSIGN_OR_RETURN(depth_program_, gl::Program::make(shaders, {"render/cull_depth.comp"}, {}));
  }
  ASSIGN_OR_RETURN(mask_program_, gl::Program::make(shaders, {"render/cull_mask.comp"},
                                                    {{"HAS_OCCLUSION", has_occlusion_ ? 1 : 0}}));
  ASSIGN_OR_RETURN(list_program_, gl::Program::make(shaders, {"render/cull_list.comp"}, {}));
  return {};
}

void Culling::run(const RenderScene& scene, const ExpandedStrands& expanded, const RenderTurn& turn) {
  const uint32_t segments = expanded.segment_count;
  if (segments == 0) return;
  const glm::vec2 target_px(scene.scene.size_px());
  if (has_occlusion_) find_depths(scene, turn.batch_index == 0);
  mask_program_.use();
  expanded.vertex().bind_storage(shader::kBindingExpanded);
  mask_.bind_storage(shader::kBindingCullMask);
  sum_.bind();
  mask_program_.set("u_segments", segments);
  mask_program_.set("u_clip_from_head", turn.view.clip_from_head);
  mask_program_.set("u_target_px", target_px);
  mask_program_.set("u_focal_px", turn.view.focal_px * (target_px.y / turn.view.target_px.y));
  mask_program_.set("u_strand_width_m", expanded.width_m);
  mask_program_.set("u_near_m", turn.view.near_m);
  if (has_occlusion_) {
    depth_.bind_storage(shader::kBindingCullDepth);
    mask_program_.set("u_blocks_across", blocks_.x);
    mask_program_.set("u_blocks_down", blocks_.y);
  }
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  dispatch(mask_count(segments));
  sum_.run(static_cast<uint32_t>(mask_count(segments)));
  list_program_.use();
  mask_.bind_storage(shader::kBindingCullMask);
  sum_.bind();
  chosen_.bind_for_writing();
  list_program_.set("u_segments", segments);
  list_program_.set("u_draws", chosen_.draw_count(segments));
  list_program_.set("u_segments_per_draw", StrandDraw::kSegmentsPerDraw);
  dispatch(mask_count(segments));
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
}

void Culling::find_depths(const RenderScene& scene, bool is_new_picture) {
  if (!is_new_picture) return;
  const auto block = static_cast<int>(shader::kCullBlock);
  const glm::ivec2 blocks = (glm::ivec2(scene.scene.size_px()) + block - 1) / block;
  if (blocks != blocks_) {
    depth_ = {};
    depth_ = gl::Buffer("cull depth",
                        sizeof(float) * static_cast<size_t>(blocks.x) * static_cast<size_t>(blocks.y));
    blocks_ = blocks;
  }
  depth_program_.use();
  depth_.bind_storage(shader::kBindingCullDepth);
  scene.scene.depth().bind(kDepthUnit);
  depth_program_.set("u_scene_depth", static_cast<int>(kDepthUnit));
  depth_program_.set("u_blocks_across", blocks_.x);
  depth_program_.set("u_blocks_down", blocks_.y);
  glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
  dispatch(static_cast<uint64_t>(blocks_.x) * static_cast<uint64_t>(blocks_.y));
}

uint64_t Culling::size_bytes() const {
  return chosen_.size_bytes() + sizeof(uint32_t) * mask_count(max_segments_) +
         RunningSum::size_bytes(mask_count(max_segments_)) + depth_.size_bytes();
}

void add_culling(RenderScene& scene, const ExpandedStrands& expanded, RenderPassList& passes) {
  if (scene.methods.culling != CullingMethod::None)
    scene.culling = &passes.keep(std::make_unique<Culling>(scene, expanded));
}

void add_camera_walk(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes,
                     const std::string& purpose) {
  const bool is_first = !std::exchange(walks.has_camera_walk, true);
  passes.add(walks.add(purpose));
  if (scene.culling == nullptr) return;
  const std::string name = purpose.empty() ? "render/cull" : "render/cull_" + purpose;
  passes.add(std::make_unique<CullPass>(scene, walks.expanded(), name, is_first));
}

}  // namespace strandcast
