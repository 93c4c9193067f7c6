#include "common/kernels/told_field.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace strandcast {

// Outside the band has to be wide enough for a cell's corners: beyond two cells nothing near is cut off.
ToldField told_field(const FieldGrid& grid, std::span<const glm::vec4> quads) {
  CHECK(quads.size() == grid.size());
  constexpr double kCells = 2.0;
  const double outside_m = std::max(kToldOutsideM, kCells * static_cast<double>(grid.cell_m));
  const double most = std::min(outside_m / double{kToldFieldStepM}, 32767.0);
  const double least = -kToldInsideM / double{kToldFieldStepM};
  ToldField told{grid, {}};
  told.distance.reserve(quads.size());
  for (const glm::vec4& quad : quads) {
    const double steps = static_cast<double>(quad.x) / double{kToldFieldStepM};
    told.distance.push_back(
        static_cast<int16_t>(std::lrint(std::isnan(steps) ? most : std::clamp(steps, least, most))));
  }
  return told;
}

std::vector<glm::vec4> field_quads(const ToldField& field) {
  CHECK(field.distance.size() == field.grid.size());
  const glm::uvec3 count = field.grid.node_count;
  std::vector<glm::vec4> quads(field.distance.size());
  for (uint32_t z = 0; z < count.z; ++z)
    for (uint32_t y = 0; y < count.y; ++y)
      for (uint32_t x = 0; x < count.x; ++x) {
        const auto at = [&](uint32_t right, uint32_t up) {
          const size_t column = std::min(x + right, count.x - 1), row = std::min(y + up, count.y - 1);
          return kToldFieldStepM *
                 static_cast<float>(field.distance[(z * size_t{count.y} + row) * count.x + column]);
        };
        quads[(z * size_t{count.y} + y) * count.x + x] = {at(0, 0), at(1, 0), at(0, 1), at(1, 1)};
      }
  return quads;
}

}  // namespace strandcast
