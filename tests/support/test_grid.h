// How much of their grids long tests walk: enough to check every law, or with STRANDCAST_TEST_GRID=whole, as
// tests/nightly.sh sets it, all of it. The variable is read here only.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string_view>

namespace strandcast {

enum class TestGrid { Small, Whole };

/// Says once per process which it is. Any other value than small and whole fails the test that asks.
inline TestGrid test_grid() {
  static const TestGrid grid = [] {
    const char* value = std::getenv("STRANDCAST_TEST_GRID");
    const std::string_view name = value == nullptr ? "small" : value;
    EXPECT_TRUE(name == "small" || name == "whole")
        << "STRANDCAST_TEST_GRID is '" << name << "' (known: small, whole)";
    fmt::print("grid: {}\n",
               name == "whole" ? "whole" : "small (STRANDCAST_TEST_GRID=whole walks all of it)");
    return name == "whole" ? TestGrid::Whole : TestGrid::Small;
  }();
  return grid;
}

inline int on_grid(int small, int whole) {
  return test_grid() == TestGrid::Whole ? whole : small;
}

}  // namespace strandcast
