#include "common/strands/strand_prefix.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace strandcast {
namespace {

/// Of every row of `source_row` values the first `count`.
template <class T>
std::vector<T> prefix_of_rows(std::span<const T> source, size_t source_row, size_t count) {
  std::vector<T> prefix;
  prefix.reserve(source.size() / source_row * count);
  for (size_t begin = 0; begin + source_row <= source.size(); begin += source_row)
    prefix.insert(prefix.end(), source.begin() + static_cast<ptrdiff_t>(begin),
                  source.begin() + static_cast<ptrdiff_t>(begin + count));
  return prefix;
}

}  // namespace

uint32_t prefix_count(uint32_t strand_count, float share) {
  CHECK(strand_count > 0 && share > 0.0f && share <= 1.0f);
  const auto count = static_cast<uint32_t>(std::ceil(static_cast<double>(share) * strand_count));
  return std::clamp(count, 1u, strand_count);
}

Snapshot prefix_of(const Snapshot& snapshot, uint32_t count) {
  if (count >= snapshot.strand_count) return snapshot;
  CHECK(count > 0);
  Snapshot prefix{snapshot, {}};
  prefix.strand_count = count;
  prefix.lattice = prefix_of_rows(std::span(snapshot.lattice), snapshot.strand_count, count);
  return prefix;
}

std::vector<glm::vec3> prefix_of_shape(std::span<const glm::vec3> shape, uint32_t vertex_count,
                                       uint32_t count) {
  if (vertex_count == 0 || shape.empty() || shape.size() % vertex_count != 0) return {};
  const size_t strand_count = shape.size() / vertex_count;
  if (count > strand_count) return {};
  return prefix_of_rows(shape, strand_count, count);
}

}  // namespace strandcast
