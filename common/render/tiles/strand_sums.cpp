#include "common/render/tiles/strand_sums.h"

#include <algorithm>

#include "common/base/hash.h"
#include "common/render/laws.h"
#include "common/render/tiles/tile_frame.h"

namespace strandcast {
namespace {

// Longer segments, or no numbers, say nothing about where hair is.
constexpr float kFarM = 1e4f;
constexpr int kCorners = 8;

/// Of eight places: the lower cell of each, and what goes to the cells around it.
struct CellShares {
  int32_t offset[simd::kLanes];
  int32_t share[kCorners][simd::kLanes];
};

/// Spreads amounts over the cells round places; nothing outside the lattice.
STRANDCAST_LANES void spread(law::vec3 cell, simd::Bool is_used, simd::Float amount, const glm::ivec3& size,
                             CellShares& out) {
  using namespace simd;
  const Bool is_inside = is_used && cell.x >= 0.0f && cell.y >= 0.0f && cell.z >= 0.0f &&
                         cell.x < static_cast<float>(size.x - 1) && cell.y < static_cast<float>(size.y - 1) &&
                         cell.z < static_cast<float>(size.z - 1);
  const Float zero(0.0f);
  const Float x = select(is_inside, cell.x, zero);
  const Float y = select(is_inside, cell.y, zero);
  const Float z = select(is_inside, cell.z, zero);
  amount = select(is_inside, amount, zero);
  const IntBits ix = to_integers(x), iy = to_integers(y), iz = to_integers(z);
  const Float fx = x - Float(__builtin_convertvector(ix, FloatBits));
  const Float fy = y - Float(__builtin_convertvector(iy, FloatBits));
  const Float fz = z - Float(__builtin_convertvector(iz, FloatBits));
  const IntBits offset = (iz * size.y + iy) * size.x + ix;
  std::memcpy(out.offset, &offset, sizeof offset);
  const Float y1 = amount * fy;
  const Float y0 = amount - y1;
  const Float y1x1 = y1 * fx;
  const Float y0x1 = y0 * fx;
  const Float corner[4] = {y0 - y0x1, y0x1, y1 - y1x1, y1x1};
  for (int k = 0; k < 4; ++k) {
    const Float far = corner[k] * fz;
    const IntBits near_share = to_integers(corner[k] - far), far_share = to_integers(far);
    std::memcpy(out.share[k], &near_share, sizeof near_share);
    std::memcpy(out.share[4 + k], &far_share, sizeof far_share);
  }
}

STRANDCAST_LANES void sum_any_strands_lanes(const StrandSumArguments& a) {
  using namespace law;
  const LatticeFrame& frame = *a.frame;
  const vec3 u(frame.axis[0] / frame.cell_m), v(frame.axis[1] / frame.cell_m),
      w(frame.axis[2] / frame.cell_m);
  const glm::vec3 origin = frame.origin_m / frame.cell_m;
  const float per_m = strand_depth_per_m(frame, a.strands.width_m) / kLightSumUnit;
  const float fade = 1.0f / std::max(a.strands.tip_fade, 1e-3f);
  const float pieces_per_m = kLightPiecesPerCell / frame.cell_m;
  const auto dy = static_cast<size_t>(frame.size.x);
  const size_t dz = dy * static_cast<size_t>(frame.size.y);
  const size_t beside[kCorners] = {0, 1, dy, dy + 1, dz, dz + 1, dz + dy, dz + dy + 1};
  for (uint32_t strand = a.begin; strand < a.end; ++strand) {
    const uint32_t first = a.points->first_point[strand];
    const uint32_t last = a.points->first_point[strand + 1] - 1;
    const float along_step = 1.0f / static_cast<float>(std::max(last - first, 1u));
    // Somewhere within each segment, elsewhere for each strand: roots in a row leave no bands.
    const float phase = strandcast::unit_float(strandcast::mix_u32(a.points->index[strand]));
    for (uint32_t k = first; k < last; k += kLanes) {
      float place[3][kLanes + 1];
      for (uint32_t lane = 0; lane <= kLanes; ++lane) {
        const StrandPoint& point = a.points->point[std::min(k + lane, last)];
        place[0][lane] = point.x;
        place[1][lane] = point.y;
        place[2][lane] = point.z;
      }
      const vec3 from(load_lanes(place[0]), load_lanes(place[1]), load_lanes(place[2]));
      const vec3 step =
          vec3(load_lanes(place[0] + 1), load_lanes(place[1] + 1), load_lanes(place[2] + 1)) - from;
      const Float length_m = sqrt(dot(step, step));
      const Float number = lane_numbers() + Float(static_cast<float>(k - first));
      const Bool is_there = number < static_cast<float>(last - first) && length_m < kFarM;
      const Float along = (number + 0.5f) * along_step;
      const Float cover = min((1.0f - along) * fade + 0.1f, 1.0f);
      const Float amount = per_m * length_m * cover * (1.0f + (a.strands.tip_scale - 1.0f) * along * along);
      const Float pieces =
          floor(clamp(length_m * pieces_per_m, 1.0f, static_cast<float>(kMaxLightCellsPerAxis)));
      const Float share = 1.0f / pieces;
      for (float piece = 0.0f; is_any(is_there && pieces > piece); piece += 1.0f) {
        const vec3 at = from + ((piece + phase) * share) * step;
        CellShares cells;
        spread(vec3(dot(at, u) - origin.x, dot(at, v) - origin.y, dot(at, w) - origin.z),
               is_there && pieces > piece, amount * share, frame.size, cells);
        for (uint32_t lane = 0; lane < kLanes; ++lane) {
          int32_t* const cell = a.sums + cells.offset[lane];
          for (int corner = 0; corner < kCorners; ++corner) cell[beside[corner]] += cells.share[corner][lane];
        }
      }
    }
  }
}
STRANDCAST_KERNEL(sum_any_strands, StrandSumArguments);

}  // namespace

void sum_strands(simd::InstructionSet set, const StrandSumArguments& arguments) {
  sum_any_strands(set, arguments);
}

}  // namespace strandcast
