// quantile: picks one value out of many by its rank.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace strandcast {

/// Returns the value of nearest rank; `share` is 0 (least) to 1 (greatest), 0.5 the median. Returns 0 for no
/// values. Linear time.
template <class T>
T quantile(std::vector<T> values, double share) {
  if (values.empty()) return T{};
  const auto rank = static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<size_t>(rank)];
}

template <class T>
T median(std::vector<T> values) {
  return quantile(std::move(values), 0.5);
}

}  // namespace strandcast
