#include "common/render/passes/expand_pass.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "common/base/check.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

constexpr uint64_t kSegmentBytes = 2 * sizeof(ExpandedVertex);
// Strands per patch: enough to fill the lanes of a vector unit, and a whole patch stays far below the limit
// per draw.
constexpr uint32_t kLinesPerPatch = shader::kMaxTessellationLevel;
static_assert(kLinesPerPatch * (shader::kMaxTessellationLevel + 1) <= shader::kMaxTessellatedVerticesPerDraw);

const std::vector<std::string> kCaptured{"expanded_position_m", "expanded_along", "expanded_tangent",
                                         "expanded_strand"};

// Draws `strands` strands from `first` on, one run of segments each, in as few draws as the limit allows.
void draw_lines(const gl::Program& program, uint32_t first, uint32_t strands, uint32_t run_segments) {
  const uint32_t lines = std::min(strands, kLinesPerPatch);
  if (lines == 0) return;
  const float levels[4] = {static_cast<float>(lines), static_cast<float>(run_segments), 1.0f, 1.0f};
  glPatchParameterfv(GL_PATCH_DEFAULT_OUTER_LEVEL, levels);
  program.set("u_lines", lines);
  const uint32_t patches = strands / lines;
  const uint32_t patches_per_draw = shader::kMaxTessellatedVerticesPerDraw / (lines * (run_segments + 1));
  for (uint32_t patch = 0; patch < patches; patch += patches_per_draw) {
    program.set("u_first_strand", first + patch * lines);
    glDrawArrays(GL_PATCHES, 0, static_cast<GLsizei>(std::min(patches_per_draw, patches - patch)));
  }
  draw_lines(program, first + patches * lines, strands - patches * lines, run_segments);
}

}  // namespace

Result<ExpandPass> ExpandPass::make(const gl::ShaderLibrary& shaders, const SceneAsset& asset,
                                    const FollowerDesc& followers, uint32_t max_segments_per_gap) {
  CHECK(asset.strand_count > 0 && asset.vertex_count >= kMinVertexCount && max_segments_per_gap > 0);
  ExpandPass pass;
  pass.followers_ = followers;
  if (asset.triangle.empty()) pass.followers_.per_triangle = 0;
  const bool has_followers = pass.followers_.per_triangle > 0;
  ASSIGN_OR_RETURN(pass.program_, gl::Program::make(shaders, {"render/expand.vert", "render/expand.tese"},
                                                    {{"HAS_FOLLOWERS", has_followers ? 1 : 0}}, kCaptured));
  pass.key_count_ = asset.strand_count;
  pass.vertex_count_ = asset.vertex_count;
  pass.triangle_count_ = static_cast<uint32_t>(asset.triangle.size());
  pass.no_attributes_ = gl::VertexArray("expand");
  pass.key_position_ = gl::Buffer(
      "key position", sizeof(glm::vec3) * static_cast<size_t>(asset.strand_count) * asset.vertex_count);
  if (has_followers) pass.root_triangle_ = gl::Buffer::of("root triangle", asset.triangle);
  const uint64_t strand_bytes = kSegmentBytes * pass.segments_per_strand(max_segments_per_gap);
  pass.expanded_ = gl::Buffer("expanded", std::min(strand_bytes * pass.strand_count(pass.max_followers()),
                                                   kMaxExpandedBytes / strand_bytes * strand_bytes));
  return pass;
}

void ExpandPass::upload(const std::vector<glm::vec3>& position_m) {
  key_position_.write(position_m);
}

uint32_t ExpandPass::batch_strands(uint32_t segments_per_gap) const {
  return static_cast<uint32_t>(expanded_.size_bytes() /
                               (kSegmentBytes * segments_per_strand(segments_per_gap)));
}

uint32_t ExpandPass::run(uint32_t first, uint32_t count, const ExpandLevel& level) const {
  CHECK(level.followers <= followers_.per_triangle && first + count <= strand_count(level.followers));
  CHECK(count <= batch_strands(level.segments_per_gap));
  const uint32_t segments = segments_per_strand(level.segments_per_gap);
  program_.use();
  no_attributes_.bind();
  key_position_.bind_storage(shader::kBindingKeyPosition);
  program_.set("u_key_count", key_count_);
  program_.set("u_vertex_count", vertex_count_);
  program_.set("u_segments", level.segments_per_gap);
  if (followers_.per_triangle > 0) {
    root_triangle_.bind_storage(shader::kBindingRootTriangle);
    program_.set("u_followers", followers_.per_triangle);
    program_.set("u_drawn", std::max(level.followers, 1u));
    program_.set("u_clump", followers_.clump);
    program_.set("u_variation_m", followers_.variation_m);
    program_.set("u_shorten", followers_.shorten);
  }
  glPatchParameteri(GL_PATCH_VERTICES, 1);
  glEnable(GL_RASTERIZER_DISCARD);
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, expanded_.name());
  glBeginTransformFeedback(GL_LINES);
  for (uint32_t point = 0; point < segments; point += shader::kMaxTessellationLevel) {
    const uint32_t run_segments = std::min(shader::kMaxTessellationLevel, segments - point);
    program_.set("u_first_point", point);
    program_.set("u_run_segments", run_segments);
    draw_lines(program_, first, count, run_segments);
  }
  glEndTransformFeedback();
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
  glDisable(GL_RASTERIZER_DISCARD);
  return count * segments;
}

uint64_t ExpandPass::size_bytes() const {
  return key_position_.size_bytes() + root_triangle_.size_bytes() + expanded_.size_bytes();
}

}  // namespace strandcast
