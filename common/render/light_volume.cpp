#include "common/render/light_volume.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace strandcast {
namespace {

// Mean |sine| between a strand and the light when strands point everywhere.
constexpr float kMeanVolumeCrossing = 0.785398f;
// Part of the light that one strand takes out; the rest passes or is scattered onwards.
constexpr float kVolumeStrandOpacity = 0.30f;
// The surrounding light also seeps in between strands from directions that are not swept.
constexpr float kSurroundingShare = 0.45f;
// Optical depth per metre inside the skull.
constexpr float kSkullPerM = 400.0f;
// More pieces than this are sampled strand by strand in even steps: the sum keeps its mean.
constexpr size_t kMaxSplats = 60'000;
// A segment is summed in pieces of at most half a cell: two splats further apart leave less in the cells
// between them, which shows as dark bands a segment apart. No more pieces than cross half of the volume.
constexpr float kPiecesPerCell = 2.0f;
constexpr int kMaxPieces = kMaxLightCells;
// Coordinates further out, in cells, or not a number say nothing about where the hair is.
constexpr float kFarVolumeDistance = 1e6f;
constexpr int kVolumeSizeStep = 4;  // cells; the texture is not made anew for every small movement

struct Sweep {
  glm::vec3 to_light;
  float weight;
};
// Light from around: more from above than from below.
constexpr std::array<Sweep, 6> kSurroundings{{{{0, 1, 0}, 0.3f},
                                              {{0, -1, 0}, 0.1f},
                                              {{1, 0, 0}, 0.15f},
                                              {{-1, 0, 0}, 0.15f},
                                              {{0, 0, 1}, 0.15f},
                                              {{0, 0, -1}, 0.15f}}};

int pieces_of(float length_m, float cell_m) {
  const float pieces = kPiecesPerCell * length_m / cell_m;
  return pieces > 1.0f ? static_cast<int>(std::ceil(std::min(pieces, static_cast<float>(kMaxPieces)))) : 1;
}

uint16_t to_unorm(float value) {
  return static_cast<uint16_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * 65535.0f));
}

}  // namespace

void LightVolume::build(const std::vector<glm::vec3>& position_m, const glm::vec3& to_light) {
  fit_lattice(position_m);
  const size_t cell_count = static_cast<size_t>(size_.x) * size_.y * size_.z;
  crossings_per_m_.assign(cell_count, 0.0f);
  add_strands(position_m);
  if (desc_.has_skull) add_skull();

  surrounding_.assign(cell_count, 0.0f);
  for (const Sweep& from : kSurroundings) {
    sweep(from.to_light, depth_);
    for (size_t i = 0; i < cell_count; ++i)
      surrounding_[i] += from.weight * std::exp(-kSurroundingShare * depth_[i]);
  }
  sweep(to_light, depth_);
  texels_.resize(2 * cell_count);
  for (size_t i = 0; i < cell_count; ++i) {
    texels_[2 * i] = to_unorm(std::exp(-depth_[i]));
    texels_[2 * i + 1] = to_unorm(surrounding_[i]);
  }
}

// Cells stand still in head space, so that nothing shimmers when the hair's extent changes.
void LightVolume::fit_lattice(const std::vector<glm::vec3>& position_m) {
  glm::vec3 low(0.0f);
  glm::vec3 high(0.0f);
  if (desc_.has_skull) {
    low = desc_.skull.center_m - desc_.skull.radius_m;
    high = desc_.skull.center_m + desc_.skull.radius_m;
  } else if (!position_m.empty()) {
    low = high = position_m.front();
  }
  for (const glm::vec3& point : position_m) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  const auto cell_of = [&](float value) {
    const float cell = value / desc_.cell_m;
    return std::abs(cell) < kFarVolumeDistance ? static_cast<int>(std::floor(cell)) : 0;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int first = cell_of(low[axis]) - 1;
    const int count = cell_of(high[axis]) + 2 - first;
    const int rounded = (count + kVolumeSizeStep - 1) / kVolumeSizeStep * kVolumeSizeStep;
    // A volume that is too long keeps its middle.
    const int kept = std::min(rounded, kMaxLightCells);
    size_[axis] = kept;
    origin_m_[axis] = desc_.cell_m * static_cast<float>(first + (count > kept ? (count - kept) / 2 : 0));
  }
}

void LightVolume::add_strands(const std::vector<glm::vec3>& position_m) {
  const size_t keys = desc_.strand_count;
  const uint32_t gaps = desc_.vertex_count < 2 ? 0 : desc_.vertex_count - 1;
  if (keys == 0 || gaps == 0) return;
  const auto usual_pieces = static_cast<size_t>(pieces_of(desc_.segment_m, desc_.cell_m));
  const size_t stride = keys * gaps * usual_pieces / kMaxSplats + 1;
  const float cell_volume = desc_.cell_m * desc_.cell_m * desc_.cell_m;
  const float per_length = desc_.strands_per_key * static_cast<float>(stride) * desc_.strand_width_m *
                           kMeanVolumeCrossing * kVolumeStrandOpacity / cell_volume;
  for (uint32_t gap = 0; gap < gaps; ++gap) {
    for (size_t strand = gap % stride; strand < keys; strand += stride) {
      const glm::vec3& a = position_m[gap * keys + strand];
      const glm::vec3& b = position_m[(gap + 1) * keys + strand];
      const float length_m = glm::length(b - a);
      const int pieces = pieces_of(length_m, desc_.cell_m);
      const auto share = 1.0f / static_cast<float>(pieces);
      for (int piece = 0; piece < pieces; ++piece)
        splat(glm::mix(a, b, (static_cast<float>(piece) + 0.5f) * share), per_length * length_m * share);
    }
  }
}

// Spreads an amount over the eight cells round a point.
void LightVolume::splat(const glm::vec3& point_m, float amount) {
  const glm::vec3 cell = (point_m - origin_m_) / desc_.cell_m - 0.5f;
  const glm::vec3 low = glm::floor(cell);
  if (!(glm::all(glm::greaterThanEqual(low, glm::vec3(0.0f))) &&
        glm::all(glm::lessThan(low, glm::vec3(size_ - 1)))))
    return;
  const glm::vec3 f = cell - low;
  const size_t base = index(static_cast<int>(low.x), static_cast<int>(low.y), static_cast<int>(low.z));
  const size_t dy = static_cast<size_t>(size_.x);
  const size_t dz = dy * static_cast<size_t>(size_.y);
  for (int corner = 0; corner < 8; ++corner) {
    const float wx = (corner & 1) ? f.x : 1.0f - f.x;
    const float wy = (corner & 2) ? f.y : 1.0f - f.y;
    const float wz = (corner & 4) ? f.z : 1.0f - f.z;
    crossings_per_m_[base + (corner & 1) + ((corner >> 1) & 1) * dy + (corner >> 2) * dz] +=
        amount * wx * wy * wz;
  }
}

void LightVolume::add_skull() {
  for (int z = 0; z < size_.z; ++z)
    for (int y = 0; y < size_.y; ++y)
      for (int x = 0; x < size_.x; ++x) {
        const glm::vec3 middle = origin_m_ + desc_.cell_m * (glm::vec3(x, y, z) + 0.5f);
        const float outside_m = glm::length(middle - desc_.skull.center_m) - desc_.skull.radius_m;
        const float inside = std::clamp(0.5f - outside_m / desc_.cell_m, 0.0f, 1.0f);
        crossings_per_m_[index(x, y, z)] += kSkullPerM * inside;
      }
}

// Slice by slice away from the light: a cell's depth is the depth of the slice before it, looked up where the
// ray to the light crosses that slice, plus half of both cells on the way.
void LightVolume::sweep(const glm::vec3& to_light, std::vector<float>& depth) const {
  const glm::vec3 length = glm::abs(to_light);
  const int a = length.x >= length.y && length.x >= length.z ? 0 : (length.y >= length.z ? 1 : 2);
  const int u = (a + 1) % 3;
  const int v = (a + 2) % 3;
  depth.assign(crossings_per_m_.size(), 0.0f);
  if (!(length[a] > 0.0f)) return;
  const float shift_u = to_light[u] / length[a];
  const float shift_v = to_light[v] / length[a];
  const float half_step_m = 0.5f * desc_.cell_m * glm::length(to_light) / length[a];
  const glm::ivec3 unit_stride(1, size_.x, size_.x * size_.y);
  const int first = to_light[a] > 0.0f ? size_[a] - 1 : 0;
  const int direction = to_light[a] > 0.0f ? -1 : 1;
  const int floor_u = static_cast<int>(std::floor(shift_u));
  const int floor_v = static_cast<int>(std::floor(shift_v));
  const float part_u = shift_u - static_cast<float>(floor_u);
  const float part_v = shift_v - static_cast<float>(floor_v);
  for (int slice = 0; slice < size_[a]; ++slice) {
    const int here = first + direction * slice;
    const auto behind = [&](int i, int j) {
      if (slice == 0 || i < 0 || j < 0 || i >= size_[u] || j >= size_[v]) return 0.0f;
      const size_t cell =
          static_cast<size_t>((here - direction) * unit_stride[a] + i * unit_stride[u] + j * unit_stride[v]);
      return depth[cell] + half_step_m * crossings_per_m_[cell];
    };
    for (int j = 0; j < size_[v]; ++j)
      for (int i = 0; i < size_[u]; ++i) {
        const int i0 = i + floor_u;
        const int j0 = j + floor_v;
        const float near = (1.0f - part_u) * behind(i0, j0) + part_u * behind(i0 + 1, j0);
        const float far = (1.0f - part_u) * behind(i0, j0 + 1) + part_u * behind(i0 + 1, j0 + 1);
        const size_t cell =
            static_cast<size_t>(here * unit_stride[a] + i * unit_stride[u] + j * unit_stride[v]);
        depth[cell] = (1.0f - part_v) * near + part_v * far + half_step_m * crossings_per_m_[cell];
      }
  }
}

}  // namespace strandcast
