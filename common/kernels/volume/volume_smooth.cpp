#include "common/kernels/volume/volume_smooth.h"

#include <cstring>

namespace strandcast {
namespace {

using Quad = float __attribute__((vector_size(16)));

// Hair at a node, m, below which nothing is said of how it moves.
constexpr float kTinyLengthM = 1e-20f;

STRANDCAST_LANES Quad load(const glm::vec4* from) {
  Quad value;
  std::memcpy(&value, from, sizeof value);
  return value;
}
STRANDCAST_LANES void store(const Quad& value, glm::vec4* to) {
  std::memcpy(to, &value, sizeof value);
}
STRANDCAST_LANES Quad smoothed(const Quad& a, const Quad& b, const Quad& c) {
  return 0.25f * (a + c) + 0.5f * b;
}

/// A row and its two neighbours; where there is none, or nothing in it, zeros.
struct RowOfThree {
  const glm::vec4* row[3];
  bool is_any;
};

STRANDCAST_LANES Quad at(const glm::vec4* row, uint32_t x) {
  return row == nullptr ? Quad{} : load(row + x);
}

STRANDCAST_LANES Quad with_density_of(const Quad& value, const Quad& center, VolumeParts parts) {
  if (parts == VolumeParts::All) return value;
  return Quad{value[0], value[1], value[2], center[3]};
}

/// The row at `at` of `count` along an axis, which is `index` of all, and those beside it; whether the
/// smoothed one has anything is noted.
STRANDCAST_LANES RowOfThree rows_around(const VolumeSmooth& work, size_t index, uint32_t at, uint32_t count,
                                        size_t stride) {
  RowOfThree rows{{nullptr, nullptr, nullptr}, false};
  for (uint32_t i = 0; i < 3; ++i) {
    if (at + i == 0 || at + i > count) continue;
    const size_t beside = index + i * stride - stride;
    if (work.from_rows[beside] == 0) continue;
    rows.row[i] = work.from + beside * work.nodes.x;
    rows.is_any = true;
  }
  work.to_rows[index] = rows.is_any ? 1 : 0;
  return rows;
}

STRANDCAST_LANES void smooth_in_layers_lanes(const VolumeSmooth& work) {
  const uint32_t nodes_x = work.nodes.x;
  for (uint32_t z = work.begin; z < work.end; ++z)
    for (uint32_t y = 0; y < work.nodes.y; ++y) {
      const size_t index = size_t{z} * work.nodes.y + y;
      const RowOfThree rows = rows_around(work, index, y, work.nodes.y, 1);
      if (!rows.is_any) continue;
      const auto column = [&](uint32_t x) STRANDCAST_LANES_LAMBDA {
        return smoothed(at(rows.row[0], x), at(rows.row[1], x), at(rows.row[2], x));
      };
      glm::vec4* const to = work.to + index * nodes_x;
      Quad before{};
      Quad now = column(0);
      for (uint32_t x = 0; x < nodes_x; ++x) {
        const Quad next = x + 1 < nodes_x ? column(x + 1) : Quad{};
        store(with_density_of(smoothed(before, now, next), at(rows.row[1], x), work.parts), to + x);
        before = now;
        now = next;
      }
    }
}

STRANDCAST_LANES void smooth_across_layers_lanes(const VolumeSmooth& work) {
  const uint32_t nodes_x = work.nodes.x;
  for (uint32_t z = work.begin; z < work.end; ++z)
    for (uint32_t y = 0; y < work.nodes.y; ++y) {
      const size_t index = size_t{z} * work.nodes.y + y;
      const RowOfThree rows = rows_around(work, index, z, work.nodes.z, work.nodes.y);
      if (!rows.is_any) continue;
      glm::vec4* const to = work.to + index * nodes_x;
      for (uint32_t x = 0; x < nodes_x; ++x) {
        const Quad center = at(rows.row[1], x);
        const Quad value = smoothed(at(rows.row[0], x), center, at(rows.row[2], x));
        store(with_density_of(value, center, work.parts), to + x);
      }
    }
}

STRANDCAST_LANES void divide_sums_lanes(const VolumeDivide& work) {
  for (uint32_t z = work.begin; z < work.end; ++z)
    for (uint32_t y = 0; y < work.nodes.y; ++y) {
      const size_t row_index = size_t{z} * work.nodes.y + y;
      if (work.rows[row_index] == 0) continue;
      glm::vec4* const row = work.values + row_index * work.nodes.x;
      for (uint32_t x = 0; x < work.nodes.x; ++x) {
        const Quad sum = load(row + x);
        const float length = sum[3];
        const float inverse = length > kTinyLengthM ? 1.0f / length : 0.0f;
        Quad value = sum * inverse;
        value[3] = length * work.per_cell_m3;
        store(value, row + x);
      }
    }
}

}  // namespace

STRANDCAST_KERNEL(smooth_in_layers, VolumeSmooth);
STRANDCAST_KERNEL(smooth_across_layers, VolumeSmooth);
STRANDCAST_KERNEL(divide_sums, VolumeDivide);

}  // namespace strandcast
