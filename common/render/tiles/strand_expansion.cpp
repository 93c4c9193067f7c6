#include "common/render/tiles/strand_expansion.h"

#include <algorithm>
#include <cmath>

#include "common/render/laws.h"

namespace strandcast {
namespace {

// Rows of samples: one in front of the root and some behind the tip, so that eight can be read from anywhere.
constexpr uint32_t kFrontSamples = 1;
constexpr uint32_t kBackSamples = 2 * simd::kLanes;
constexpr size_t kStrandsPerRange = 32;
constexpr size_t kKeysPerRange = 64;

struct ExpandArguments {
  const float* samples;
  uint32_t row_floats;
  uint32_t segments;  // of a key strand
  uint32_t key_count;
  uint32_t max_followers;
  uint32_t followers;
  const RootTriangle* triangle;
  const uint8_t* is_parted;
  StyleNumbers style;
  uint32_t begin, end;    // strands
  uint32_t* first_point;  // for counts: [strand + 1] is written
  uint32_t* index;        // likewise, [strand]
  uint32_t* lock;
  StrandPoint* point;
};

/// Which strand it is, and what it hangs between.
struct StrandPlace {
  uint32_t index;  // among all that could be drawn: keeps its number when fewer are
  uint32_t triangle;
  uint32_t follower;
  bool is_key;
};

STRANDCAST_LANES StrandPlace place_of(const ExpandArguments& a, uint32_t strand) {
  if (strand < a.key_count) return {strand, 0, 0, true};
  const uint32_t drawn = strand - a.key_count;
  const uint32_t triangle = drawn / a.followers;
  const uint32_t follower = triangle * a.max_followers + (drawn - triangle * a.followers);
  return {a.key_count + follower, triangle, follower, false};
}

STRANDCAST_LANES law::StrandStyle style_of(const StyleNumbers& s) {
  return {s.clump,       s.locks,       s.spread_m,     s.wave_m,        s.wave_count, s.frizz_m,
          s.frizz_count, s.stray_share, s.stray_spread, s.length_spread, s.short_share};
}

/// Points that a strand has: one per sample that it reaches, and its tip.
STRANDCAST_LANES uint32_t point_count(float end, uint32_t segments) {
  const float reached = end * static_cast<float>(segments);
  const auto whole = static_cast<uint32_t>(reached);
  return whole + (reached > static_cast<float>(whole) ? 2 : 1);
}

STRANDCAST_LANES void count_points_lanes(const ExpandArguments& a) {
  const law::StrandStyle style = style_of(a.style);
  for (uint32_t strand = a.begin; strand < a.end; ++strand) {
    const StrandPlace place = place_of(a, strand);
    const simd::Float end = law::strand_end(simd::Uint(place.index), style);
    a.first_point[strand + 1] = point_count(end.v[0], a.segments);
    a.index[strand] = place.index;
    a.lock[strand] =
        place.is_key ? place.index
                     : law::lock_of(simd::Uint(place.follower), simd::Uint(place.triangle), style.locks).v[0];
  }
}
STRANDCAST_KERNEL(count_points, ExpandArguments);

STRANDCAST_LANES law::vec3 read_samples(const float* row, uint32_t floats, uint32_t at) {
  return {simd::load_lanes(row + at), simd::load_lanes(row + floats + at),
          simd::load_lanes(row + 2 * floats + at)};
}

STRANDCAST_LANES void expand_points_lanes(const ExpandArguments& a) {
  using namespace law;
  const StrandStyle style = style_of(a.style);
  const uint32_t axis_floats = a.row_floats / 3;
  for (uint32_t strand = a.begin; strand < a.end; ++strand) {
    const StrandPlace place = place_of(a, strand);
    const Uint index(place.index);
    const Uint lock(a.lock[strand]);
    uint32_t key[3] = {strand, strand, strand};
    vec3 weights(1.0f, 0.0f, 0.0f);
    vec3 lock_weights = weights;
    vec3 aside(0.0f);
    StrandStyle mine = style;
    if (place.is_key) {
      mine.wave_m = 0.0f;
    } else {
      const RootTriangle& corners = a.triangle[place.triangle];
      for (int k = 0; k < 3; ++k) key[k] = corners[k];
      const Uint follower(place.follower);
      weights = spread_weights(follower);
      lock_weights = spread_weights(lock);
      if (a.is_parted[place.triangle] != 0) {
        // It lies on the nearest key's side of the parting, and starts where it would have.
        const float w[3] = {weights.x.v[0], weights.y.v[0], weights.z.v[0]};
        const int nearest = w[0] >= w[1] && w[0] >= w[2] ? 0 : (w[1] >= w[2] ? 1 : 2);
        const float* roots[3];
        for (int k = 0; k < 3; ++k)
          roots[k] = a.samples + static_cast<size_t>(key[k]) * a.row_floats + kFrontSamples;
        float off[3];
        for (uint32_t c = 0; c < 3; ++c)
          off[c] = w[0] * roots[0][c * axis_floats] + w[1] * roots[1][c * axis_floats] +
                   w[2] * roots[2][c * axis_floats] - roots[nearest][c * axis_floats];
        aside = vec3(off[0], off[1], off[2]);
        for (int k = 0; k < 3; ++k)
          if (k != nearest) key[k] = key[nearest];
        weights = vec3(1.0f, 0.0f, 0.0f);
        lock_weights = weights;
      }
    }
    const DrawnStrand drawn = drawn_strand(index, lock, weights, lock_weights, mine);
    const float reached = drawn.end.v[0] * static_cast<float>(a.segments);
    const Float along_per_sample = 1.0f / reached;
    const float* rows[3];
    for (int k = 0; k < 3; ++k) rows[k] = a.samples + static_cast<size_t>(key[k]) * a.row_floats;
    const uint32_t first = a.first_point[strand];
    const uint32_t count = a.first_point[strand + 1] - first;
    StrandPoint* const out = a.point + first;
    for (uint32_t k = 0; k < count; k += kLanes) {
      const Float sample = lane_numbers() + Float(static_cast<float>(k));
      const Float at = min(sample, Float(reached));
      const Float along = at * along_per_sample;
      // The tip lies between two samples, all else on one.
      const Float part = at - (sample - 1.0f);
      vec3 curve[3];
      vec3 tangent;
      for (int c = 0; c < 3; ++c) {
        const vec3 before = read_samples(rows[c], axis_floats, k);
        const vec3 here = read_samples(rows[c], axis_floats, k + kFrontSamples);
        curve[c] = select(part >= 1.0f, here, before + part * (here - before));
        if (c == 0) tangent = here - before;
      }
      const vec3 w = weights_at(drawn, along);
      vec3 p = w.x * curve[0] + w.y * curve[1] + w.z * curve[2];
      p += aside + deviation_m(drawn, mine, along, tangent);
      const uint32_t lanes = count - k < kLanes ? count - k : kLanes;
      for (uint32_t lane = 0; lane < lanes; ++lane) {
        out[k + lane].x = p.x.v[lane];
        out[k + lane].y = p.y.v[lane];
        out[k + lane].z = p.z.v[lane];
      }
    }
  }
}
STRANDCAST_KERNEL(expand_points, ExpandArguments);

}  // namespace

StrandExpansion::StrandExpansion(const SceneAsset& asset, float mean_length_m)
    : key_count_(asset.strand_count),
      vertex_count_(asset.vertex_count),
      mean_length_m_(mean_length_m),
      triangle_(asset.triangle),
      is_parted_(parted_triangles(asset)) {}

void StrandExpansion::set_look(const LookDesc& look) {
  style_ = style_numbers(look, mean_length_m_);
  max_followers_ = triangle_.empty() ? 0 : look.followers;
}

uint64_t StrandExpansion::size_bytes() const {
  return triangle_.capacity() * sizeof(RootTriangle) + is_parted_.capacity() +
         samples_.capacity() * sizeof(float);
}

void StrandExpansion::expand(const std::vector<glm::vec3>& position_m, const StrandDetail& detail,
                             WorkerPool& workers, simd::InstructionSet set, StrandPoints& points) {
  const uint32_t gaps = vertex_count_ - 1;
  const uint32_t segments = gaps * detail.segments_per_gap;
  const uint32_t axis_floats = kFrontSamples + segments + 1 + kBackSamples;
  samples_.resize(size_t{key_count_} * 3 * axis_floats);
  workers.at(Priority::Drawing).for_ranges(key_count_, kKeysPerRange, [&](size_t begin, size_t end) {
    for (size_t key = begin; key < end; ++key) {
      float* const row = samples_.data() + key * 3 * axis_floats;
      const auto vertex = [&](uint32_t v) { return position_m[size_t{v} * key_count_ + key]; };
      const float step = 1.0f / static_cast<float>(detail.segments_per_gap);
      glm::vec3 p0 = vertex(0);
      glm::vec3 p1 = vertex(1);
      glm::vec3 m0 = p1 - p0;
      uint32_t sample = kFrontSamples;
      const auto put = [&](uint32_t at, const glm::vec3& p) {
        row[at] = p.x;
        row[axis_floats + at] = p.y;
        row[2 * axis_floats + at] = p.z;
      };
      for (uint32_t gap = 0; gap < gaps; ++gap) {
        const glm::vec3 p2 = gap + 2 <= gaps ? vertex(gap + 2) : p1;
        const glm::vec3 m1 = gap + 1 == gaps ? p1 - p0 : 0.5f * (p2 - p0);
        // Cubic Hermite (shaders/lib/hermite.glsl) as a polynomial in t.
        const glm::vec3 chord = p1 - p0;
        const glm::vec3 c2 = 3.0f * chord - 2.0f * m0 - m1;
        const glm::vec3 c3 = m0 + m1 - 2.0f * chord;
        put(sample++, p0);
        for (uint32_t j = 1; j < detail.segments_per_gap; ++j) {
          const float t = static_cast<float>(j) * step;
          put(sample++, p0 + t * (m0 + t * (c2 + t * c3)));
        }
        p0 = p1;
        p1 = p2;
        m0 = m1;
      }
      put(sample, p0);
      for (int axis = 0; axis < 3; ++axis) {
        float* const values = row + axis * axis_floats;
        values[0] = 2.0f * values[1] - values[2];
        for (uint32_t i = sample + 1; i < axis_floats; ++i) values[i] = values[sample];
      }
    }
  });

  ExpandArguments arguments{};
  arguments.samples = samples_.data();
  arguments.row_floats = 3 * axis_floats;
  arguments.segments = segments;
  arguments.key_count = key_count_;
  arguments.max_followers = std::max(max_followers_, 1u);
  arguments.followers = std::max(detail.followers, 1u);
  arguments.triangle = triangle_.data();
  arguments.is_parted = is_parted_.data();
  arguments.style = style_;
  points.first_point.resize(size_t{detail.strand_count} + 1);
  points.first_point[0] = 0;
  points.index.resize(detail.strand_count);
  points.lock.resize(detail.strand_count);
  arguments.first_point = points.first_point.data();
  arguments.index = points.index.data();
  arguments.lock = points.lock.data();
  const auto in_ranges = [&](auto kernel) {
    workers.at(Priority::Drawing)
        .for_ranges(detail.strand_count, kStrandsPerRange, [&](size_t begin, size_t end) {
          ExpandArguments part = arguments;
          part.begin = static_cast<uint32_t>(begin);
          part.end = static_cast<uint32_t>(end);
          kernel(set, part);
        });
  };
  in_ranges(count_points);
  for (uint32_t strand = 0; strand < detail.strand_count; ++strand)
    points.first_point[strand + 1] += points.first_point[strand];
  points.point.resize(points.first_point.back());
  arguments.point = points.point.data();
  in_ranges(expand_points);
}

}  // namespace strandcast
