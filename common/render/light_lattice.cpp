#include "common/render/light_lattice.h"

#include <algorithm>
#include <cmath>

#include "common/render/tiles/strand_sums.h"
#include "common/render/tiles/tile_frame.h"
#include "common/simd/lanes.h"

namespace strandcast {
namespace {

// Mean |sine| between a strand and the light when strands point everywhere.
constexpr float kMeanCrossing = 0.785398f;
// Part of the light that a drawn strand takes out where it is; the rest passes or is scattered onwards.
constexpr float kStrandOpacity = 0.6f;
// Hair that flies out of the lattice casts no shadow; this much room is left around the hair at rest.
constexpr float kRoom = 1.2f;
constexpr int kSizeStep = 8;
// Workers that sum have a lattice each.
constexpr uint32_t kMaxSummingWorkers = 4;
constexpr size_t kSplatStrandsPerRange = 64;
// Points that fit_lattice() looks at.
constexpr size_t kPointsSeen = 65536;
// Further out, or no number: says nothing about where the hair is.
constexpr float kFarLatticeM = 1e4f;

// Depth towards the eye from which on nothing is seen, and the most that counts, so that little of it reaches
// beside what hides.
constexpr float kHiding = 6.0f;
constexpr float kMostHiding = 1.1f * kHiding;
// Of a halved cell that is all head: some of them hide, so that its edge does not.
constexpr float kSolidHiding = 0.25f * kHiding;

/// From a cell to the slice in front of it, along a ray to the eye.
struct RayStep {
  size_t cell;  // with one of border in front
  float part;   // towards the next one
  float slope;
};
RayStep step_towards(float eye, int from, int size, float per_slice) {
  const float slope = (eye - static_cast<float>(from)) * per_slice;
  const float at = std::clamp(static_cast<float>(from) + slope + 1.0f, 0.0f, static_cast<float>(size + 1));
  const auto cell = static_cast<size_t>(at);
  return {cell, at - static_cast<float>(cell), slope};
}

glm::vec3 any_across(const glm::vec3& axis) {
  const glm::vec3 other = std::abs(axis.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
  return glm::normalize(glm::cross(other, axis));
}

glm::vec3 along_axes(const glm::vec3& v, const LatticeFrame& view) {
  return {glm::dot(v, view.axis[0]), glm::dot(v, view.axis[1]), glm::dot(v, view.axis[2])};
}

/// Bounding box along the axes of a lattice.
struct Bounds {
  glm::vec3 low{1e30f};
  glm::vec3 high{-1e30f};

  void add(const glm::vec3& p, const LatticeFrame& frame) {
    if (!(std::abs(p.x) < kFarLatticeM && std::abs(p.y) < kFarLatticeM && std::abs(p.z) < kFarLatticeM))
      return;
    const glm::vec3 q = along_axes(p, frame);
    low = glm::min(low, q);
    high = glm::max(high, q);
  }
};

/// A lattice of no cells, turned to the key light.
LatticeFrame turned_frame(const LightLatticeDesc& desc, const LightDirections& lights) {
  LatticeFrame frame;
  frame.axis[2] = -lights.to_key;
  frame.axis[0] = any_across(lights.to_key);
  frame.axis[1] = glm::cross(frame.axis[2], frame.axis[0]);
  const auto cell_m = [&](uint32_t cells) {
    return std::max(kRoom * desc.extent_m / static_cast<float>(cells), 1e-5f);
  };
  frame.cell_m = cell_m(desc.cells);
  frame.soft_m = std::max(frame.cell_m, cell_m(kLightCells));
  return frame;
}

// How far above the skin a place is that the head has no effect on, units of LatticeFrame::soft_m.
constexpr float kNoSolid = -4.0f;

// Share of a cell that is head, from how far below the skin it lies.
float solid_share(float below, float inset, float ramp) {
  return std::clamp(0.5f + (0.5f / ramp) * (below - inset), 0.0f, 1.0f);
}

// The lattice is as large as the hair and stands on whole cells, so that a shadow does not shimmer when the
// hair's extent changes a little.
void set_size(const LightLatticeDesc& desc, Bounds bounds, LatticeFrame& frame) {
  if (desc.has_skull) {
    const glm::vec3 q = along_axes(desc.skull.center_m, frame);
    bounds.low = glm::min(bounds.low, q - desc.skull.radius_m);
    bounds.high = glm::max(bounds.high, q + desc.skull.radius_m);
  }
  if (!(bounds.low.x <= bounds.high.x)) bounds.low = bounds.high = glm::vec3(0.0f);
  for (int a = 0; a < 3; ++a) {
    const float first = std::floor(bounds.low[a] / frame.cell_m) - 1.0f;
    const float last = std::ceil(bounds.high[a] / frame.cell_m) + 1.0f;
    const int wanted =
        (static_cast<int>(std::min(last - first + 1.0f, 4.0f * kMaxLightCellsPerAxis)) + kSizeStep - 1) /
        kSizeStep * kSizeStep;
    frame.size[a] = std::min(wanted, kMaxLightCellsPerAxis);
    // One that is too long keeps its middle.
    frame.origin_m[a] = frame.cell_m * (first + 0.5f * static_cast<float>(wanted - frame.size[a]));
  }
  frame.half_size = frame.size / 2;
}

}  // namespace

LatticeFrame fit_lattice(const LightLatticeDesc& desc, const LightDirections& lights,
                         std::span<const glm::vec3> points_m, float room_m) {
  LatticeFrame frame = turned_frame(desc, lights);
  Bounds bounds;
  const size_t every = std::max<size_t>(points_m.size() / kPointsSeen, 1);
  for (size_t i = 0; i < points_m.size(); i += every) bounds.add(points_m[i], frame);
  bounds.low -= room_m;
  bounds.high += room_m;
  set_size(desc, bounds, frame);
  return frame;
}

int solid_far_cells(const LatticeFrame& frame) {
  return std::max(static_cast<int>(std::lround(kSolidFar * frame.soft_m / frame.cell_m)), 1);
}

float strand_depth_per_m(const LatticeFrame& frame, float width_m) {
  return width_m * kStrandOpacity * kMeanCrossing / (frame.cell_m * frame.cell_m);
}

uint64_t LightLattice::size_bytes() const {
  uint64_t bytes = key_.capacity() * sizeof(uint16_t) + others_.capacity() * sizeof(uint32_t) +
                   hidden_.capacity() + eye_depth_.capacity() * sizeof(float) +
                   (halved_.capacity() + halved_solid_.capacity() + rim_depth_.capacity()) * sizeof(float);
  for (const auto& depth : sky_depth_) bytes += depth.capacity() * sizeof(float);
  for (const auto& sums : sums_) bytes += sums.capacity() * sizeof(int32_t);
  return bytes;
}

void LightLattice::build(const LatticeFrame& frame, const StrandPoints& points, const LightStrands& strands,
                         const LightDirections& lights, WorkerPool& workers) {
  static_cast<LatticeFrame&>(view_) = frame;
  sum_strands(points, strands, workers);
  sweep_key(workers);
  const std::array<glm::vec3, kSkyWays> ways = sky_ways(lights.up);
  const std::vector<float> to_sky = halved_with(kSolidSkyDepth);
  workers.at(Priority::Drawing).for_ranges(kSkyWays + 1, 1, [&](size_t way, size_t) {
    if (way < kSkyWays)
      sweep(along_axes(ways[way], view_), to_sky, sky_depth_[way]);
    else if (lights.has_rim)
      sweep(along_axes(lights.to_rim, view_), halved_with(kSolidRimDepth), rim_depth_);
    else
      rim_depth_.assign(halved_.size(), 0.0f);
  });
  store_others(workers);
  view_.key = key_.data();
  view_.others = others_.data();
  view_.hidden = nullptr;
}

// The sky's depth: of what its ways let through together.
void LightLattice::store_others(WorkerPool& workers) {
  using simd::Float, simd::kLanes;
  constexpr size_t kCellsPerRange = 8192;
  constexpr float kLeast = 1e-6f;
  constexpr float kPerLog2 = -0.693147181f / kSkyReach;
  // Sizes are multiples of 4, their product of 64.
  static_assert(kSizeStep * kSizeStep * kSizeStep / 8 % kLanes == 0);
  others_.resize(halved_.size());
  const auto stored = [](float depth) {
    return static_cast<uint32_t>(std::clamp(depth * (1.0f / kLightDepthUnit), 0.0f, 65535.0f));
  };
  workers.at(Priority::Drawing).for_ranges(halved_.size(), kCellsPerRange, [&](size_t begin, size_t end) {
    for (size_t first = begin; first < end; first += kLanes) {
      Float open(0.0f);
      for (const auto& depth : sky_depth_) open += exp(-kSkyReach * simd::load_lanes(depth.data() + first));
      const Float sky = kPerLog2 * log2(max(open * (1.0f / kSkyWays), kLeast));
      for (size_t lane = 0; lane < kLanes; ++lane)
        others_[first + lane] = stored(rim_depth_[first + lane]) | stored(sky.v[lane]) << 16;
    }
  });
}

void LightLattice::sum_strands(const StrandPoints& points, const LightStrands& strands, WorkerPool& workers) {
  const glm::ivec3 size = view_.size;
  const size_t cells = static_cast<size_t>(size.x) * size.y * size.z;
  const uint32_t summing = std::min(workers.size(), kMaxSummingWorkers);
  sums_.resize(summing);
  for (auto& sums : sums_) sums.resize(cells);
  // Cleared by the worker whose they are, once it has something to add.
  std::vector<uint8_t> is_used(summing);
  const auto sum_range = [&](size_t begin, size_t end, uint32_t worker) {
    int32_t* const sums = sums_[worker].data();
    if (is_used[worker] == 0) std::fill_n(sums, cells, 0);
    is_used[worker] = 1;
    strandcast::sum_strands(desc_.set, {&view_, &points, strands, static_cast<uint32_t>(begin),
                                        static_cast<uint32_t>(end), sums});
  };
  workers.at(Priority::Drawing, summing).for_ranges(points.strand_count(), kSplatStrandsPerRange, sum_range);
  summed_.clear();
  for (uint32_t worker = 0; worker < summing; ++worker)
    if (is_used[worker] != 0) summed_.push_back(sums_[worker].data());
  if (!summed_.empty()) return;
  std::fill_n(sums_[0].data(), cells, 0);
  summed_.push_back(sums_[0].data());
}

// How far below the skin one row of cells lies, in units of soft_m. Far from the skin distances tell of how
// many cells no share changes.
void LightLattice::find_solid(int y, int z, std::vector<float>& below) const {
  std::fill(below.begin(), below.end(), kNoSolid);
  const auto is_border = [](int at, int size) {
    return at < kSolidBorderCells || at >= size - kSolidBorderCells;
  };
  if (is_border(y, view_.size.y) || is_border(z, view_.size.z)) return;
  const HeadOccupancy& head = *desc_.solid;
  const float per_cell = view_.cell_m / head.cell_m;
  const glm::vec3 step = per_cell * view_.axis[0];
  const glm::vec3 along(view_.origin_m.x, view_.origin_m.y + view_.cell_m * static_cast<float>(y),
                        view_.origin_m.z + view_.cell_m * static_cast<float>(z));
  const glm::vec3 from =
      (along.x * view_.axis[0] + along.y * view_.axis[1] + along.z * view_.axis[2] - head.origin_m) /
      head.cell_m;
  // Outside of the head's cells there is none.
  auto first = static_cast<float>(kSolidBorderCells);
  auto last = static_cast<float>(view_.size.x - 1 - kSolidBorderCells);
  const bool is_bust_turned = desc_.bust.exists() && bust_turn_ != BustTurn(0.0);
  for (int a = 0; a < 3 && !is_bust_turned; ++a) {
    const float high = static_cast<float>(head.size[a]) - 0.5f;
    if (std::abs(step[a]) < 1e-6f) {
      if (!(from[a] > -0.5f && from[a] < high)) return;
      continue;
    }
    const float enters = (-0.5f - from[a]) / step[a];
    const float leaves = (high - from[a]) / step[a];
    first = std::max(first, std::min(enters, leaves));
    last = std::min(last, std::max(enters, leaves));
  }
  // Distances from cell to cell are up to an eighth too long, and rounded.
  constexpr float kSure = 0.8f;
  const float per_soft = 1.0f / view_.soft_m;
  const float cells_per_soft = view_.soft_m / view_.cell_m;
  // From here on every share is 0 or 1.
  constexpr float kWholeFrom = std::max(kSolidInset + kSolidRamp, kSolidFarInset + kSolidFarRamp);
  if (!(first <= last)) return;
  const int end = static_cast<int>(std::floor(last)) + 1;
  for (int x = static_cast<int>(std::ceil(first)); x < end;) {
    glm::vec3 cell = from + static_cast<float>(x) * step;
    if (is_bust_turned) {
      const glm::vec3 place_m = head.origin_m + head.cell_m * cell;
      const glm::dvec3 rest_m = without_bust(desc_.bust, bust_turn_, glm::dvec3(place_m));
      cell = (glm::vec3(rest_m) - head.origin_m) / head.cell_m;
    }
    // Beyond the head's cells the way to them counts.
    const glm::vec3 beyond =
        is_bust_turned ? cell - glm::clamp(cell, glm::vec3(0.0f), glm::vec3(head.size - 1)) : glm::vec3(0.0f);
    const float distance_m = distance_at(head, cell) + head.cell_m * glm::length(beyond);
    const float here = -distance_m * per_soft;
    const int alike =
        1 + static_cast<int>(std::max(kSure * (std::abs(here) - kWholeFrom) * cells_per_soft, 0.0f));
    for (const int until = std::min(x + alike, end); x < until; ++x) below[x] = here;
  }
}

std::vector<float> LightLattice::halved_with(float solid_depth) const {
  std::vector<float> all = halved_;
  solid_depth *= view_.cell_m / view_.soft_m;
  for (size_t i = 0; i < halved_solid_.size(); ++i)
    all[i] += solid_depth * std::max(2.0f * halved_solid_[i] - 2.0f, 0.0f);
  return all;
}

// A running sum away from the light, and half of the cell itself; of the head the most that was passed, which
// changes little from line to line where sums of it would jump.
void LightLattice::sweep_key(WorkerPool& workers) {
  const glm::ivec3 size = view_.size;
  const size_t slice = static_cast<size_t>(size.x) * size.y;
  key_.resize(slice * size.z);
  halved_.assign(static_cast<size_t>(view_.half_size.x) * view_.half_size.y * view_.half_size.z, 0.0f);
  halved_solid_.assign(has_solid() ? halved_.size() : 0, 0.0f);
  // Two rows at a time: they halve into one.
  workers.at(Priority::Drawing).for_ranges(static_cast<size_t>(size.y) / 2, 1, [&](size_t begin, size_t end) {
    std::vector<float> passed(size.x);
    std::vector<float> here(size.x);
    std::vector<float> solid(size.x);
    std::vector<float> most_solid(size.x);
    std::vector<int32_t> sum(size.x);
    // How far below the skin the last rows towards the light lie.
    const auto far = static_cast<size_t>(solid_far_cells(view_));
    std::vector<std::vector<float>> below(far, std::vector<float>(size.x));
    for (size_t y = 2 * begin; y < 2 * end; ++y) {
      std::fill(passed.begin(), passed.end(), 0.0f);
      std::fill(most_solid.begin(), most_solid.end(), 0.0f);
      for (auto& row : below) std::fill(row.begin(), row.end(), kNoSolid);
      for (int z = 0; z < size.z; ++z) {
        const size_t row = static_cast<size_t>(z) * slice + y * size.x;
        std::copy_n(summed_[0] + row, size.x, sum.data());
        for (size_t other = 1; other < summed_.size(); ++other) {
          const int32_t* const from = summed_[other] + row;
          for (int x = 0; x < size.x; ++x) sum[x] += from[x];
        }
        for (int x = 0; x < size.x; ++x) here[x] = static_cast<float>(sum[x]) * kLightSumUnit;
        if (has_solid()) {
          std::vector<float>& here_below = below[static_cast<size_t>(z) % far];
          for (int x = 0; x < size.x; ++x)
            most_solid[x] =
                std::max(most_solid[x], solid_share(here_below[x], kSolidFarInset, kSolidFarRamp));
          find_solid(static_cast<int>(y), z, here_below);
          for (int x = 0; x < size.x; ++x) solid[x] = solid_share(here_below[x], kSolidInset, kSolidRamp);
        }
        uint16_t* const key = key_.data() + row;
        constexpr float kStored = 1.0f / kLightDepthUnit;
        for (int x = 0; x < size.x; ++x) {
          const float most = most_solid[x] = std::max(most_solid[x], solid[x]);
          const float depth = (passed[x] + 0.5f * here[x] + kSolidDepth * (most * most * most)) * kStored;
          key[x] = static_cast<uint16_t>(static_cast<int32_t>(depth < 65535.0f ? depth : 65535.0f));
          passed[x] += here[x];
        }
        // Across a cell twice as wide: the sum of two in its length, the mean over four across.
        const size_t half_row =
            (static_cast<size_t>(z / 2) * view_.half_size.y + y / 2) * static_cast<size_t>(view_.half_size.x);
        const auto halve = [&](const std::vector<float>& row_of_cells, std::vector<float>& halved) {
          float* const to = halved.data() + half_row;
          for (int x = 0; x < view_.half_size.x; ++x)
            to[x] += 0.25f * (row_of_cells[2 * x] + row_of_cells[2 * x + 1]);
        };
        halve(here, halved_);
        if (has_solid()) halve(solid, halved_solid_);
      }
    }
  });
}

// Slice by slice away from the light: a cell's depth is that of the slice before it, looked up where the ray
// to the light crosses it, plus half of both cells on the way.
void LightLattice::sweep(const glm::vec3& to_light, const std::vector<float>& halved,
                         std::vector<float>& depth) const {
  const glm::ivec3 size = view_.half_size;
  const glm::vec3 length = glm::abs(to_light);
  const int a = length.x >= length.y && length.x >= length.z ? 0 : (length.y >= length.z ? 1 : 2);
  const int u = (a + 1) % 3;
  const int v = (a + 2) % 3;
  depth.assign(halved.size(), 0.0f);
  if (!(length[a] > 0.0f)) return;
  const float shift_u = to_light[u] / length[a];
  const float shift_v = to_light[v] / length[a];
  const float half_step = 0.5f * glm::length(to_light) / length[a];
  const glm::ivec3 stride(1, size.x, size.x * size.y);
  const int first = to_light[a] > 0.0f ? size[a] - 1 : 0;
  const int direction = to_light[a] > 0.0f ? -1 : 1;
  const int floor_u = static_cast<int>(std::floor(shift_u));
  const int floor_v = static_cast<int>(std::floor(shift_v));
  const float part_u = shift_u - static_cast<float>(floor_u);
  const float part_v = shift_v - static_cast<float>(floor_v);
  // What the slice before lets through behind its cells, none around them: rows are read one step beyond.
  const auto row = static_cast<size_t>(size[u]) + 3;
  std::vector<float> behind(row * (static_cast<size_t>(size[v]) + 3), 0.0f);
  std::vector<float> next = behind;
  const float kept_u = 1.0f - part_u;
  const float kept_v = 1.0f - part_v;
  for (int slice = 0; slice < size[a]; ++slice) {
    const int here = first + direction * slice;
    for (int j = 0; j < size[v]; ++j) {
      const size_t begin = static_cast<size_t>(j + 1 + floor_v) * row + static_cast<size_t>(1 + floor_u);
      const float* const near = behind.data() + begin;
      const float* const far = near + row;
      const auto cells = static_cast<size_t>(here * stride[a] + j * stride[v]);
      float* const out = next.data() + static_cast<size_t>(j + 1) * row + 1;
      for (int i = 0; i < size[u]; ++i) {
        const size_t cell = cells + static_cast<size_t>(i * stride[u]);
        const float step = half_step * halved[cell];
        depth[cell] = kept_v * (kept_u * near[i] + part_u * near[i + 1]) +
                      part_v * (kept_u * far[i] + part_u * far[i + 1]) + step;
        out[i] = depth[cell] + step;
      }
    }
    std::swap(behind, next);
  }
}

// Slice by slice away from the eye, as sweep() away from a light, but along rays that meet in the eye.
void LightLattice::sweep_from_eye(const glm::vec3& eye, int a) {
  const glm::ivec3 size = view_.half_size;
  const int u = (a + 1) % 3;
  const int v = (a + 2) % 3;
  const glm::ivec3 stride(1, size.x, size.x * size.y);
  const int first = eye[a] < 0.0f ? 0 : size[a] - 1;
  const int direction = eye[a] < 0.0f ? 1 : -1;
  eye_depth_.resize(halved_.size());
  // Of the slice before, with nothing around it.
  const auto row = static_cast<size_t>(size[u]) + 3;
  std::vector<float> behind(row * (static_cast<size_t>(size[v]) + 3), 0.0f);
  std::vector<float> next = behind;
  // A ball that stands for what a mesh lacks is not drawn.
  const std::vector<float> opacity =
      has_solid() && desc_.solid->has_ball ? halved_ : halved_with(kSolidHiding);
  std::vector<RayStep> steps(size[u]);
  for (int slice = 0; slice < size[a]; ++slice) {
    const int here = first + direction * slice;
    const float per_slice = 1.0f / std::abs(eye[a] - static_cast<float>(here));
    for (int i = 0; i < size[u]; ++i) steps[i] = step_towards(eye[u], i, size[u], per_slice);
    for (int j = 0; j < size[v]; ++j) {
      const RayStep across = step_towards(eye[v], j, size[v], per_slice);
      const float* const near = behind.data() + across.cell * row;
      const float* const far = near + row;
      float* const out = next.data() + static_cast<size_t>(j + 1) * row + 1;
      for (int i = 0; i < size[u]; ++i) {
        const auto cell = static_cast<size_t>(here * stride[a] + j * stride[v] + i * stride[u]);
        const auto [at, part, slope] = steps[i];
        const float low = near[at] + part * (near[at + 1] - near[at]);
        const float high = far[at] + part * (far[at + 1] - far[at]);
        const float depth = low + across.part * (high - low);
        eye_depth_[cell] = depth;
        const float length = std::sqrt(1.0f + slope * slope + across.slope * across.slope);
        out[i] = std::min(depth + length * opacity[cell], kMostHiding);
      }
    }
    std::swap(behind, next);
  }
}

void LightLattice::hide_from(const glm::vec3& eye_m) {
  view_.hidden = nullptr;
  const glm::ivec3 size = view_.half_size;
  // In halved cells from the middle of the first.
  const glm::vec3 eye = 0.5f * ((along_axes(eye_m, view_) - view_.origin_m) / view_.cell_m - 0.5f);
  const glm::vec3 beyond = glm::max(-eye, eye - glm::vec3(size - 1));
  const int axis = beyond.x >= beyond.y && beyond.x >= beyond.z ? 0 : (beyond.y >= beyond.z ? 1 : 2);
  constexpr float kLeastBeyond = 2.0f;
  if (!(beyond[axis] > kLeastBeyond && beyond[axis] < kFarLatticeM / view_.cell_m)) return;
  sweep_from_eye(eye, axis);
  // Of a place between eight middles all have to be hidden. What is farther out than the lattice is at its
  // border.
  hidden_.assign(halved_.size(), 0);
  const auto dy = static_cast<size_t>(size.x);
  const size_t dz = dy * static_cast<size_t>(size.y);
  for (int z = 1; z + 2 < size.z; ++z)
    for (int y = 1; y + 2 < size.y; ++y) {
      const size_t row = static_cast<size_t>(z) * dz + static_cast<size_t>(y) * dy;
      const float* const depth = eye_depth_.data() + row;
      const auto least = [&](size_t x) {
        return std::min(std::min(depth[x], depth[x + dy]), std::min(depth[x + dz], depth[x + dz + dy]));
      };
      for (size_t x = 1; x + 2 < dy; ++x) hidden_[row + x] = std::min(least(x), least(x + 1)) > kHiding;
    }
  view_.hidden = hidden_.data();
}

}  // namespace strandcast
