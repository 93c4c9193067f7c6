#include "common/groom/procedural.h"

#include <algorithm>
#include <cmath>

#include "common/base/hash.h"
#include "common/groom/hair_style.h"
#include "common/groom/scalp_roots.h"
#include "common/math/point_tree.h"

namespace strandcast {
namespace {

constexpr float kTwoPi = 6.28318530718f;
constexpr float kStepsPerSegment = 4.0f;  // fine steps of growth per segment of the result
constexpr float kStepsPerRadius = 24.0f;  // at least, but
constexpr float kMaxSteps = 256.0f;       // per strand, however long it is
constexpr float kSpareLength = 1.25f;     // grown beyond the length: clumping shortens the curve
constexpr float kBendArc = 0.10f;  // arc (skull radii) over which a strand turns towards its combed direction
constexpr uint32_t kStrandsPerClump = 14;
constexpr uint32_t kClumpChoices = 4;   // nearest clumps looked at for one on the same side of the parting
constexpr float kClumpPull = 0.8f;      // how far tips move towards the clump's own strand
constexpr float kCurlRampPart = 0.35f;  // of the length, over which the curl opens
constexpr float kPhaseSpread_turns = 0.06f;  // between strands of one clump

/// A curve in skull radii about the skull's centre, points `step` apart along the growth.
using Curve = std::vector<glm::vec3>;

struct GrownStrand {
  StrandCharacter character;
  glm::vec3 normal{0.0f, 1.0f, 0.0f};
  uint32_t hash = 0;
  Curve curve;
};

Status check_options(const ProceduralGroomOptions& options) {
  const auto refuse = [](const char* name, double value, double low, double high) -> Status {
    if (value >= low && value <= high) return {};  // false for NaN
    return make_error(ErrorCode::BadInput, "{} is {}, allowed are {} to {}", name, value, low, high);
  };
  constexpr double kMinLengthM = 1e-3, kMaxVariation = 0.95;
  RETURN_IF_ERROR(refuse("strand_count", options.strand_count, 1, kMaxStrandCount));
  RETURN_IF_ERROR(refuse("vertex_count", options.vertex_count, kMinVertexCount, kMaxVertexCount));
  RETURN_IF_ERROR(refuse("length_m", options.length_m, kMinLengthM, kMaxGrownLengthM));
  RETURN_IF_ERROR(refuse("length_variation", options.length_variation, 0.0, kMaxVariation));
  RETURN_IF_ERROR(refuse("curl_radius_m", options.curl_radius_m, 0.0, kMaxCurlRadiusM));
  return refuse("curl_turns", options.curl_turns, 0.0, kMaxCurlTurns);
}

class Grower {
 public:
  Grower(const ProceduralGroomOptions& options, const FittedSphere& skull)
      : options_(options), skull_(skull), longest_m_(options.length_m * (1.0f + options.length_variation)) {
    const float segment = longest_m_ / static_cast<float>(options.vertex_count - 1) / skull.radius_m;
    const float length = longest_m_ / skull.radius_m;
    step_ = std::max(std::min(segment / kStepsPerSegment, 1.0f / kStepsPerRadius), length / kMaxSteps);
    step_count_ = static_cast<uint32_t>(std::ceil(length * kSpareLength / step_)) + 1;
  }

  GrownStrand grow(const ScalpRoot& root, uint32_t index) const {
    GrownStrand strand;
    strand.hash = mix_u32(mix_u32(options_.seed) ^ index);
    strand.normal = root.normal;
    const glm::vec3 start = (root.position_m - skull_.center_m) / skull_.radius_m;
    strand.character = make_character(start, strand.hash, options_.seed);
    strand.curve.reserve(step_count_ + 1);
    strand.curve.push_back(start);
    glm::vec3 direction = root.normal;
    const float turn = 1.0f - std::exp(-step_ / kBendArc);
    for (uint32_t i = 1; i <= step_count_; ++i) {
      const glm::vec3 here = strand.curve.back();
      direction = unit_or(glm::mix(direction, combed_direction(here, strand.character), i == 1 ? 0.0f : turn),
                          direction);
      const glm::vec3 next = next_point(here, direction, i, strand.character);
      direction = unit_or(next - here, direction);
      strand.curve.push_back(next);
    }
    return strand;
  }

  /// Pulls the strand towards its clump's own strand, more towards the tip.
  void clump(GrownStrand& strand, const GrownStrand& center) const {
    const float pull = kClumpPull * (0.6f + 0.4f * unit_float(mix_u32(strand.hash + 7)));
    for (uint32_t i = 1; i <= step_count_; ++i) {
      const float along = std::min(arc_at(i) * skull_.radius_m / longest_m_, 1.0f);
      strand.curve[i] = glm::mix(strand.curve[i], center.curve[i], pull * along * (2.0f - along));
    }
  }

  /// Winds the curve into a helix about itself; `phase_turns` is shared by the strands of a clump.
  void curl(GrownStrand& strand, float phase_turns) const {
    const float radius = options_.curl_radius_m / skull_.radius_m;
    if (radius <= 0.0f || options_.curl_turns <= 0.0f) return;
    const float own_phase = phase_turns + kPhaseSpread_turns * (unit_float(mix_u32(strand.hash + 9)) - 0.5f);
    const Curve center = strand.curve;
    glm::vec3 across = perpendicular(center[1] - center[0]);
    for (uint32_t i = 1; i <= step_count_; ++i) {
      const glm::vec3 tangent = unit_or(center[i] - center[i - 1], glm::vec3(0.0f, -1.0f, 0.0f));
      // Carried along the curve without twist.
      across = unit_or(across - glm::dot(across, tangent) * tangent, perpendicular(tangent));
      const float along = arc_at(i) * skull_.radius_m / options_.length_m;
      const float open = std::min(along / kCurlRampPart, 1.0f);
      const float angle = kTwoPi * (options_.curl_turns * along + own_phase);
      const glm::vec3 offset = std::cos(angle) * across + std::sin(angle) * glm::cross(tangent, across);
      strand.curve[i] = center[i] + radius * open * offset;
    }
  }

  /// Vertices a fixed chord apart along the curve, as walked off with dividers: the polyline has exactly this
  /// length.
  void append_vertices(GrownStrand& strand, std::vector<glm::vec3>& positions_m) const {
    for (uint32_t i = 1; i <= step_count_; ++i) {
      strand.curve[i] = kept_outside(strand.curve[i], i, strand.character);
    }
    const float vary = 2.0f * unit_float(mix_u32(strand.hash + 13)) - 1.0f;
    const float length_m = options_.length_m * (1.0f + options_.length_variation * vary);
    const float chord = length_m / static_cast<float>(options_.vertex_count - 1) / skull_.radius_m;
    glm::vec3 here = strand.curve.front();
    positions_m.push_back(skull_.center_m + skull_.radius_m * here);
    size_t segment = 0;
    for (uint32_t vertex = 1; vertex < options_.vertex_count; ++vertex) {
      here = beside_bust(here, walk(strand.curve, here, chord, segment), strand.character);
      positions_m.push_back(skull_.center_m + skull_.radius_m * here);
    }
  }

 private:
  float arc_at(uint32_t i) const { return step_ * static_cast<float>(i); }

  /// One step on. Where the bust stops it, it goes on as far along the skin: the curve gets no shorter.
  glm::vec3 next_point(const glm::vec3& here, const glm::vec3& direction, uint32_t i,
                       const StrandCharacter& character) const {
    const glm::vec3 next = keep_outside(here + step_ * direction, arc_at(i), character);
    if (!options_.has_bust) return next;
    const glm::vec3 kept = keep_off_bust(next, character);
    return kept == next ? next : keep_off_bust(here + step_ * unit_or(kept - here, direction), character);
  }

  /// A vertex as far from the one before it, turned out of the bust where the chord cuts across a shoulder.
  glm::vec3 beside_bust(const glm::vec3& before, const glm::vec3& point,
                        const StrandCharacter& character) const {
    constexpr int kTurns = 8;
    glm::vec3 here = point;
    for (int turn = 0; options_.has_bust && turn < kTurns; ++turn) {
      const glm::vec3 kept = keep_off_bust(here, character);
      if (kept == here) break;
      here = before + glm::distance(before, point) * unit_or(kept - before, point - before);
    }
    return here;
  }

  glm::vec3 kept_outside(const glm::vec3& point, uint32_t i, const StrandCharacter& character) const {
    const glm::vec3 outside = keep_outside(point, arc_at(i), character);
    return options_.has_bust ? keep_off_bust(outside, character) : outside;
  }

  static glm::vec3 unit_or(const glm::vec3& v, const glm::vec3& fallback) {
    const float squared = glm::dot(v, v);
    return squared > 1e-16f ? v / std::sqrt(squared) : fallback;
  }

  static glm::vec3 perpendicular(const glm::vec3& v) {
    const glm::vec3 aside =
        std::abs(v.x) < std::abs(v.y) ? glm::vec3(1.0f, 0.0f, 0.0f) : glm::vec3(0.0f, 1.0f, 0.0f);
    return unit_or(glm::cross(v, aside), glm::vec3(0.0f, 0.0f, 1.0f));
  }

  /// First point of the curve from `segment` on at distance `chord` from `here`; beyond its end, straight on.
  static glm::vec3 walk(const Curve& curve, const glm::vec3& here, float chord, size_t& segment) {
    while (segment + 2 < curve.size() && glm::distance(curve[segment + 1], here) < chord) ++segment;
    const glm::dvec3 a = curve[segment], along = glm::dvec3(curve[segment + 1]) - a,
                     offset = a - glm::dvec3(here);
    // |offset + t along| = chord
    const double aa = glm::dot(along, along), ab = glm::dot(along, offset);
    const double cc = glm::dot(offset, offset) - static_cast<double>(chord) * chord;
    const double root = ab * ab - aa * cc;
    if (aa <= 0.0 || root < 0.0)
      return here + chord * unit_or(glm::vec3(along), glm::vec3(0.0f, -1.0f, 0.0f));
    return glm::vec3(a + along * ((-ab + std::sqrt(root)) / aa));
  }

  const ProceduralGroomOptions& options_;
  FittedSphere skull_;
  float longest_m_;
  float step_ = 0.0f;
  uint32_t step_count_ = 0;
};

/// The clump nearest to a root on its side of the parting, or nothing.
const GrownStrand* find_clump(const PointTree& tree, const std::vector<GrownStrand>& clumps,
                              const ScalpRoot& root, float side) {
  for (const auto& near : tree.nearest(root.position_m, kClumpChoices)) {
    const GrownStrand& clump = clumps[near.index];
    if (clump.character.side * side > 0.0f) return &clump;
  }
  return nullptr;
}

}  // namespace

Result<Groom> grow_groom(const Mesh& scalp, const ProceduralGroomOptions& options) {
  RETURN_IF_ERROR(check_options(options));
  const FittedSphere skull = fit_sphere(scalp.position_m);
  RootSpread spread;
  spread.most_times = kPartingCloser;
  spread.moved = [&](const glm::vec3& point_m) {
    return skull.center_m +
           skull.radius_m * moved_from_parting((point_m - skull.center_m) / skull.radius_m, options.seed);
  };
  ASSIGN_OR_RETURN(const std::vector<ScalpRoot> roots,
                   spread_roots(scalp, options.strand_count, options.seed, spread));
  const Grower grower(options, skull);

  // The first roots of the progressive order are spread evenly themselves: they lead the clumps.
  const uint32_t clump_count = (options.strand_count + kStrandsPerClump - 1) / kStrandsPerClump;
  std::vector<GrownStrand> clumps;
  std::vector<glm::vec3> clump_roots_m;
  for (uint32_t i = 0; i < clump_count; ++i) {
    clumps.push_back(grower.grow(roots[i], i));
    clump_roots_m.push_back(roots[i].position_m);
  }
  const PointTree tree(clump_roots_m);

  Groom groom;
  groom.name = "procedural";
  groom.offset.push_back(0);
  for (uint32_t i = 0; i < options.strand_count; ++i) {
    GrownStrand strand = i < clump_count ? clumps[i] : grower.grow(roots[i], i);
    const GrownStrand* clump = find_clump(tree, clumps, roots[i], strand.character.side);
    if (clump != nullptr && i >= clump_count) grower.clump(strand, *clump);
    grower.curl(strand, unit_float(mix_u32((clump != nullptr ? *clump : strand).hash + 8)));
    grower.append_vertices(strand, groom.rest_position_m);
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  groom = with_pinning(std::move(groom), Pinning::RootPair);
  if (const Status grown = validate(groom); !grown) return grown.error();
  return groom;
}

}  // namespace strandcast
