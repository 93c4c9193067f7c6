#include "common/render/tiles/debug_picture.h"

#include <algorithm>
#include <cmath>

namespace strandcast {
namespace {

constexpr size_t kChannels = 4;
// Opaque cells that are this deep in light are almost white.
constexpr float kDenseDepth = 0.5f;
constexpr float kEmptyShade = 24.0f;  // of the lattice where there is no hair, of 255
constexpr float kTint = 0.55f;
constexpr float kFullTile = 16384.0f;  // segments

/// Optical depth across the cell at a place counted in cells; negative outside.
float cell_depth(const LightLatticeView& lattice, const glm::vec3& cell) {
  const glm::ivec3 at(glm::floor(cell + 0.5f));
  const glm::ivec3& size = lattice.size;
  if (at.x < 0 || at.y < 0 || at.z < 0 || at.x >= size.x || at.y >= size.y || at.z + 1 >= size.z)
    return -1.0f;
  const size_t slice = static_cast<size_t>(size.x) * size.y;
  const size_t here = at.z * slice + static_cast<size_t>(at.y) * size.x + at.x;
  // What is stored is the depth from the light to the cell's middle.
  return kLightDepthUnit *
         (static_cast<float>(lattice.key[here + slice]) - static_cast<float>(lattice.key[here]));
}

}  // namespace

void draw_density(const LightLatticeView& lattice, const View& view, WorkerPool& workers, Image& image) {
  const glm::mat4 head_from_clip = glm::inverse(view.clip_from_head);
  const auto point_at = [&](float x, float y, float depth) {
    const glm::vec4 p = head_from_clip * glm::vec4(x, y, depth, 1.0f);
    return glm::vec3(p) / p.w;
  };
  const glm::vec3 middle_ray = glm::normalize(point_at(0.0f, 0.0f, 0.0f) - view.eye_m);
  workers.at(Priority::Drawing).for_ranges(image.height, 8, [&](size_t begin, size_t end) {
    for (size_t row = begin; row < end; ++row)
      for (size_t column = 0; column < image.width; ++column) {
        const float x = 2.0f * (static_cast<float>(column) + 0.5f) / view.target_px.x - 1.0f;
        const float y = 1.0f - 2.0f * (static_cast<float>(row) + 0.5f) / view.target_px.y;
        const glm::vec3 ray = point_at(x, y, 0.0f) - view.eye_m;
        const glm::vec3 point = view.eye_m + ray * (view.target_distance_m / glm::dot(ray, middle_ray));
        const glm::vec3 cell = (glm::vec3(glm::dot(point, lattice.axis[0]), glm::dot(point, lattice.axis[1]),
                                          glm::dot(point, lattice.axis[2])) -
                                lattice.origin_m) /
                               lattice.cell_m;
        const float depth = cell_depth(lattice, cell);
        const float shade =
            depth < 0.0f ? 0.0f
                         : kEmptyShade + (255.0f - kEmptyShade) * (1.0f - std::exp(-depth / kDenseDepth));
        uint8_t* const pixel = image.rgba.data() + (row * image.width + column) * kChannels;
        std::fill_n(pixel, 3, static_cast<uint8_t>(shade));
        pixel[3] = 255;
      }
  });
}

void mark_tiles(const TileLists<TileSegment>& segments, const TileGrid& grid, Image& image) {
  for (uint32_t y = 0; y < image.height; ++y)
    for (uint32_t x = 0; x < image.width; ++x) {
      const uint32_t tile = y / kTilePx * grid.columns() + x / kTilePx;
      const uint32_t count = segments.first[tile + 1] - segments.first[tile];
      const bool is_border = x % kTilePx == 0 || y % kTilePx == 0;
      if (count == 0 && !is_border) continue;
      const float heat = std::min(std::log2(1.0f + static_cast<float>(count)) / std::log2(kFullTile), 1.0f);
      const float tint[3] = {255.0f * heat, 255.0f * (1.0f - heat), 0.0f};
      uint8_t* const pixel = image.rgba.data() + (size_t{y} * image.width + x) * kChannels;
      for (int c = 0; c < 3; ++c)
        pixel[c] = is_border ? 0 : static_cast<uint8_t>((1.0f - kTint) * pixel[c] + kTint * tint[c]);
    }
}

}  // namespace strandcast
