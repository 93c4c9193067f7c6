#include "common/render/passes/expand_pass.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/gl/device_limits.h"
#include "common/render/strand_style.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

// Followers: chosen by eye on the built-in scene. Lengths are shares of the mean strand length.
constexpr float kFollowerClump = 0.75f;
constexpr float kFollowerVariation = 0.012f;
constexpr float kFollowerShorten = 0.18f;
// What is drawn follows from its size on the screen. A segment shorter than `segment_px` shows no bend, so
// fewer are drawn per gap; strands thinner than `width_px` are replaced by fewer that together are as wide.
// Every triangle costs a CPU about half a microsecond, so software renderers get coarser targets.
struct DetailTarget {
  float segment_px;
  float width_px;
};
constexpr DetailTarget kHardwareDetail{5.0f, 0.25f};
constexpr DetailTarget kSoftwareDetail{9.0f, 0.6f};
// In a batch of a picture that may be given up: some ten of them in a picture that takes a CPU long.
constexpr uint32_t kInterruptibleStrands = 1024;
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

ExpandSizes sizes_of(const RenderScene& scene) {
  return {scene.key_strands, scene.joined_triangle_count, scene.look.followers};
}

/// Key strands, then all followers, in as many batches as the buffer needs.
class ExpandPass final : public RenderPass {
 public:
  ExpandPass(RenderScene& scene, ExpandedStrands& expanded)
      : Pass({"render/expand",
              {&scene.key_strands},
              {&expanded},
              scene.features.has_strands.value,
              scene.features.has_strands.reason}),
        scene_(scene),
        expanded_(expanded),
        sizes_(sizes_of(scene)) {}

  bool is_batched() const override { return true; }
  uint64_t size_bytes() const override {
    return scene_.features.has_followers.value ? sizeof(RootTriangle) * uint64_t{scene_.joined_triangle_count}
                                               : 0;
  }

  Status prepare(const RenderSetup& setup) override {
    const FollowerDesc followers{sizes_.max_followers(), kFollowerClump,
                                 kFollowerVariation * scene_.rest.mean_length_m, kFollowerShorten};
    const gl::DeviceLimits limits = gl::read_device_limits();
    for (const uint64_t bytes : {scene_.key_strands.size_bytes(), size_bytes(), expanded_.size_bytes()})
      RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::StorageBlockBytes, bytes,
                                             fmt::format("a groom of {} strands", sizes_.strand_count(0))));
    ASSIGN_OR_RETURN(expander_, StrandExpander::make(setup.shaders, setup.asset, followers));
    expanded_.allocate();
    return {};
  }

  Status run(RenderTurn& turn) override {
    if (turn.batch_index == 0) begin(turn);
    const uint32_t first = turn.batch_index * batch_strands_;
    const uint32_t count = std::min(batch_strands_, strand_count_ - first);
    expanded_.segment_count = expander_.run(scene_.key_strands, expanded_, first, count, level_);
    turn.drawn_strands += count;
    turn.drawn_segments += expanded_.segment_count;
    turn.has_more_batches = first + count < strand_count_;
    if (turn.has_more_batches && turn.terms.is_unwanted && turn.terms.is_unwanted())
      turn.is_whole = turn.has_more_batches = false;
    return {};
  }

 private:
  void begin(const RenderTurn& turn) {
    level_ = choose_level(turn.view);
    strand_count_ = sizes_.strand_count(level_.followers);
    if (turn.terms.strand_share < 1.0f) thin_out(turn.terms.strand_share);
    batch_strands_ = sizes_.batch_strands(expanded_.size_bytes(), level_.segments_per_gap);
    if (turn.terms.is_unwanted) batch_strands_ = std::min(batch_strands_, kInterruptibleStrands);
    expanded_.width_m = 2.0f * scene_.look.strand_radius_m *
                        static_cast<float>(sizes_.strand_count(sizes_.max_followers())) /
                        static_cast<float>(strand_count_);
  }
  /// Followers of all triangles first, then key strands: any first so many of those cover the head evenly.
  void thin_out(float strand_share) {
    const auto wanted = static_cast<uint32_t>(std::ceil(strand_share * static_cast<float>(strand_count_)));
    while (level_.followers > 0 && sizes_.strand_count(level_.followers) > wanted) --level_.followers;
    strand_count_ = std::min(sizes_.strand_count(level_.followers), std::max(wanted, 1u));
  }
  ExpandLevel choose_level(const View& view) const;

  RenderScene& scene_;
  ExpandedStrands& expanded_;
  ExpandSizes sizes_;
  StrandExpander expander_;
  // Of the draw that is under way.
  ExpandLevel level_;
  uint32_t strand_count_ = 0;
  uint32_t batch_strands_ = 0;
};

// What is too small to be seen on the screen is not drawn: bends within a few pixels, and strands far thinner
// than a pixel, for which fewer and wider ones stand.
ExpandLevel ExpandPass::choose_level(const View& view) const {
  const DetailTarget& detail = scene_.is_software ? kSoftwareDetail : kHardwareDetail;
  const auto gap_count = static_cast<float>(sizes_.segments_per_strand(1));
  const float px_per_m = view.focal_px / static_cast<float>(kSamplesPerSide) / view.target_distance_m;
  const float gap_px = scene_.rest.mean_length_m / gap_count * px_per_m;
  const float width_px = 2.0f * scene_.look.strand_radius_m * px_per_m;
  // A size that is not a number takes the least detail.
  const auto at_most = [](float wanted, uint32_t limit) {
    return wanted > 1.0f ? static_cast<uint32_t>(std::min(std::ceil(wanted), static_cast<float>(limit)))
                         : std::min(1u, limit);
  };
  ExpandLevel level;
  level.segments_per_gap = at_most(gap_px / detail.segment_px, scene_.look.segments);
  level.followers = at_most(static_cast<float>(sizes_.max_followers()) * width_px / detail.width_px,
                            sizes_.max_followers());
  return level;
}

}  // namespace

uint64_t ExpandSizes::buffer_bytes(uint32_t max_segments_per_gap) const {
  const uint64_t strand_bytes = kSegmentBytes * segments_per_strand(max_segments_per_gap);
  if (strand_bytes == 0) return 0;
  return std::min(strand_bytes * strand_count(max_followers_),
                  kMaxExpandedBytes / strand_bytes * strand_bytes);
}

uint32_t ExpandSizes::batch_strands(uint64_t size_bytes, uint32_t segments_per_gap) const {
  return static_cast<uint32_t>(size_bytes / (kSegmentBytes * segments_per_strand(segments_per_gap)));
}

Result<StrandExpander> StrandExpander::make(const gl::ShaderLibrary& shaders, const SceneAsset& asset,
                                            const FollowerDesc& followers) {
  CHECK(asset.strand_count > 0 && asset.vertex_count >= kMinVertexCount);
  StrandExpander expander;
  expander.followers_ = followers;
  // A follower between strands that a parting divides would hang across it.
  const std::vector<RootTriangle> triangles = joined_triangles(asset);
  if (triangles.empty()) expander.followers_.per_triangle = 0;
  const bool has_followers = expander.followers_.per_triangle > 0;
  ASSIGN_OR_RETURN(expander.program_,
                   gl::Program::make(shaders, {"render/expand.vert", "render/expand.tese"},
                                     {{"HAS_FOLLOWERS", has_followers ? 1 : 0}}, kCaptured));
  expander.no_attributes_ = gl::VertexArray("expand");
  if (has_followers) expander.root_triangle_ = gl::Buffer::of("root triangle", triangles);
  return expander;
}

uint32_t StrandExpander::run(const KeyStrands& keys, const ExpandedStrands& expanded, uint32_t first,
                             uint32_t count, const ExpandLevel& level) const {
  const uint32_t segments = level.segments_per_gap * (keys.vertex_count() - 1);
  CHECK(level.followers <= followers_.per_triangle);
  CHECK(uint64_t{count} * segments * kSegmentBytes <= expanded.size_bytes());
  program_.use();
  no_attributes_.bind();
  keys.position().bind_storage(shader::kBindingKeyPosition);
  program_.set("u_key_count", keys.strand_count());
  program_.set("u_vertex_count", keys.vertex_count());
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
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, expanded.vertex().name());
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

std::unique_ptr<ExpandedStrands> make_expanded_strands(const RenderScene& scene) {
  return std::make_unique<ExpandedStrands>(sizes_of(scene).buffer_bytes(scene.look.segments));
}

std::unique_ptr<RenderPass> make_expand_pass(RenderScene& scene, ExpandedStrands& expanded) {
  return std::make_unique<ExpandPass>(scene, expanded);
}

}  // namespace strandcast
