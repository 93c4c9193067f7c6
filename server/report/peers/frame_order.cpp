#include "server/report/peers/frame_order.h"

#include <algorithm>
#include <numeric>

#include "common/base/check.h"
#include "common/strands/morton.h"

namespace strandcast {
namespace {

constexpr float kCells = 1024.0f;  // of the curve, along each axis
constexpr float kLeastExtentM = 1e-6f;

}  // namespace

FrameOrder::FrameOrder(const StreamShape& shape) : strand_at_(shape.strand_count) {
  CHECK(shape.rest_in_head_m.size() == shape.plane_size());
  std::iota(strand_at_.begin(), strand_at_.end(), 0u);
  glm::vec3 low = shape.rest_in_head_m.front();
  glm::vec3 high = low;
  for (uint32_t s = 0; s < shape.strand_count; ++s) {
    low = glm::min(low, shape.rest_in_head_m[s]);
    high = glm::max(high, shape.rest_in_head_m[s]);
  }
  const float extent_m = std::max({high.x - low.x, high.y - low.y, high.z - low.z, kLeastExtentM});
  std::vector<uint32_t> code(shape.strand_count, 0);
  for (uint32_t s = 0; s < shape.strand_count; ++s)
    for (int axis = 0; axis < 3; ++axis) {
      const float cell = (shape.rest_in_head_m[s][axis] - low[axis]) * ((kCells - 1.0f) / extent_m);
      code[s] |= morton_bits(static_cast<uint32_t>(cell)) << axis;
    }
  std::stable_sort(strand_at_.begin(), strand_at_.end(),
                   [&](uint32_t a, uint32_t b) { return code[a] < code[b]; });
}

std::vector<glm::vec3> FrameOrder::sorted(const std::vector<glm::vec3>& frame) const {
  const size_t strand_count = strand_at_.size();
  std::vector<glm::vec3> result(frame.size());
  for (size_t row = 0; row < frame.size(); row += strand_count)
    for (size_t place = 0; place < strand_count; ++place)
      result[row + place] = frame[row + strand_at_[place]];
  return result;
}

std::vector<glm::vec3> FrameOrder::restored(const std::vector<glm::vec3>& sorted) const {
  const size_t strand_count = strand_at_.size();
  std::vector<glm::vec3> result(sorted.size());
  for (size_t row = 0; row < sorted.size(); row += strand_count)
    for (size_t place = 0; place < strand_count; ++place)
      result[row + strand_at_[place]] = sorted[row + place];
  return result;
}

}  // namespace strandcast
