#include "common/render/passes/expand_pass.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/gl/device_limits.h"
#include "common/render/detail/bend_expander.h"
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
// A map of the light is looked up between its texels: half of what is drawn is enough for it, and from far
// away what is drawn.
constexpr DetailTarget kCasterDetail{16.0f, 1.0f};
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

/// What decides how finely strands are expanded.
struct ExpandAim {
  DetailTarget target;
  // 0: as the camera sees them, else the resolution of the light's map, which draws what is not seen.
  uint32_t map_texels = 0;
};

// What is too small to be seen is not drawn: bends within a few pixels, and strands far thinner than a pixel,
// for which fewer and wider ones stand. A size that is not a number takes the least detail.
ExpandLevel level_of(const RenderScene& scene, const ExpandSizes& sizes, const DetailTarget& target,
                     float px_per_m) {
  const auto at_most = [](float wanted, uint32_t limit) {
    return wanted > 1.0f ? static_cast<uint32_t>(std::min(std::ceil(wanted), static_cast<float>(limit)))
                         : std::min(1u, limit);
  };
  const float gap_px = scene.rest.mean_length_m / static_cast<float>(sizes.segments_per_strand(1)) * px_per_m;
  const float width_px = 2.0f * scene.look.strand_radius_m * px_per_m;
  return {
      at_most(gap_px / target.segment_px, scene.look.segments),
      at_most(static_cast<float>(sizes.max_followers()) * width_px / target.width_px, sizes.max_followers())};
}

/// As the camera sees the strands, by the method of the scene.
ExpandLevel seen_level(const RenderScene& scene, const ExpandSizes& sizes, const DetailTarget& target,
                       const View& view) {
  ExpandLevel level = level_of(scene, sizes, target,
                               view.focal_px / static_cast<float>(kSamplesPerSide) / view.target_distance_m);
  const DetailMethod method = scene.methods.detail;
  if (method == DetailMethod::Full) level.followers = sizes.max_followers();
  if (method != DetailMethod::Adaptive && method != DetailMethod::Volume)
    level.segments_per_gap = scene.look.segments;
  return level;
}

/// Of what casts shadows and is not drawn.
ExpandLevel map_level(const RenderScene& scene, const ExpandSizes& sizes, const ExpandAim& aim) {
  return level_of(scene, sizes, aim.target, static_cast<float>(aim.map_texels) / scene.rest.extent_m);
}

ExpandLevel coarser(const ExpandLevel& a, const ExpandLevel& b) {
  return {std::min(a.segments_per_gap, b.segments_per_gap), std::min(a.followers, b.followers)};
}

ExpandAim caster_aim(const RenderScene& scene) {
  return {kCasterDetail, scene.method_settings.shadow_texels};
}

/// Key strands, then all followers, in as many batches as the buffer needs.
class ExpandPass final : public RenderPass {
 public:
  ExpandPass(RenderScene& scene, ExpandedStrands& expanded, std::string name, const ExpandAim& aim)
      : Pass({std::move(name),
              {&scene.key_strands},
              {&expanded},
              scene.features.has_strands.value,
              scene.features.has_strands.reason}),
        scene_(scene),
        expanded_(expanded),
        sizes_(sizes_of(scene)),
        aim_(aim),
        is_by_bends_(scene.methods.detail == DetailMethod::Bends && aim.map_texels == 0) {}

  bool is_batched() const override { return true; }
  uint64_t size_bytes() const override {
    const uint64_t triangle_bytes = scene_.features.has_followers.value
                                        ? sizeof(RootTriangle) * uint64_t{scene_.joined_triangle_count}
                                        : 0;
    return triangle_bytes + (is_by_bends_ ? BendExpander::size_bytes(max_gaps()) : 0);
  }

  Status prepare(const RenderSetup& setup) override {
    const FollowerDesc followers{sizes_.max_followers(), kFollowerClump,
                                 kFollowerVariation * scene_.rest.mean_length_m, kFollowerShorten};
    const gl::DeviceLimits limits = gl::read_device_limits();
    for (const uint64_t bytes : {scene_.key_strands.size_bytes(), size_bytes(), expanded_.size_bytes()})
      RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::StorageBlockBytes, bytes,
                                             fmt::format("a groom of {} strands", sizes_.strand_count(0))));
    if (is_by_bends_) {
      ASSIGN_OR_RETURN(
          by_bends_,
          BendExpander::make(setup.shaders, StrandCurves(setup.asset, followers, scene_.methods.curve),
                             max_gaps()));
    } else {
      ASSIGN_OR_RETURN(expander_,
                       StrandExpander::make(setup.shaders, setup.asset, followers, scene_.methods.curve));
    }
    expanded_.allocate();
    return {};
  }

  Status run(RenderTurn& turn) override {
    if (turn.batch_index == 0) begin(turn);
    const uint32_t first = turn.batch_index * batch_strands_;
    const uint32_t count = std::min(batch_strands_, strand_count_ - first);
    expanded_.segment_count =
        is_by_bends_ ? by_bends_.run(scene_.key_strands, expanded_, first, count, level_, turn.view)
                     : expander_.run(scene_.key_strands, expanded_, first, count, level_);
    if (aim_.map_texels == 0) {
      turn.drawn_strands += count;
      turn.drawn_segments += expanded_.segment_count;
    }
    turn.has_more_batches = first + count < strand_count_;
    if (turn.has_more_batches && turn.terms.is_unwanted && turn.terms.is_unwanted())
      turn.is_whole = turn.has_more_batches = false;
    return {};
  }

 private:
  void begin(const RenderTurn& turn) {
    level_ = seen_level(scene_, sizes_, aim_.target, turn.view);
    if (aim_.map_texels > 0) level_ = coarser(level_, map_level(scene_, sizes_, aim_));
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
  /// In a batch of the coarsest expansion, which holds the most strands.
  uint64_t max_gaps() const { return expanded_.size_bytes() / kSegmentBytes; }

  RenderScene& scene_;
  ExpandedStrands& expanded_;
  ExpandSizes sizes_;
  ExpandAim aim_;
  bool is_by_bends_;
  StrandExpander expander_;
  BendExpander by_bends_;
  // Of the draw that is under way.
  ExpandLevel level_;
  uint32_t strand_count_ = 0;
  uint32_t batch_strands_ = 0;
};

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
                                            const FollowerDesc& followers, CurveMethod curve) {
  CHECK(asset.strand_count > 0 && asset.vertex_count >= kMinVertexCount);
  StrandExpander expander;
  expander.curves_ = StrandCurves(asset, followers, curve);
  ASSIGN_OR_RETURN(expander.program_, gl::Program::make(shaders, {"render/expand.vert", "render/expand.tese"},
                                                        expander.curves_.variant(), kCaptured));
  expander.no_attributes_ = gl::VertexArray("expand");
  return expander;
}

uint32_t StrandExpander::run(const KeyStrands& keys, const ExpandedStrands& expanded, uint32_t first,
                             uint32_t count, const ExpandLevel& level) const {
  const uint32_t segments = level.segments_per_gap * (keys.vertex_count() - 1);
  CHECK(uint64_t{count} * segments * kSegmentBytes <= expanded.size_bytes());
  program_.use();
  no_attributes_.bind();
  curves_.set(program_, keys, level);
  program_.set("u_segments", level.segments_per_gap);
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
  return std::make_unique<ExpandPass>(scene, expanded, "render/expand",
                                      ExpandAim{scene.is_software ? kSoftwareDetail : kHardwareDetail});
}

std::unique_ptr<ExpandedStrands> make_casters(const RenderScene& scene) {
  const ExpandSizes most = sizes_of(scene);
  const ExpandLevel level = map_level(scene, most, caster_aim(scene));
  const ExpandSizes sizes(scene.key_strands, scene.joined_triangle_count, level.followers);
  return std::make_unique<ExpandedStrands>(sizes.buffer_bytes(level.segments_per_gap), "shadow casters");
}

std::unique_ptr<RenderPass> make_caster_pass(RenderScene& scene, ExpandedStrands& casters) {
  return std::make_unique<ExpandPass>(scene, casters, "render/expand_casters", caster_aim(scene));
}

}  // namespace strandcast
