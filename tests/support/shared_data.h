// Grooms and motion captures that tests may read and that are not the project's to ship: in ../shared/data,
// where that is beside the checkout. tests/summary.awk counts what was skipped for want of them by the words
// of the reason.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>

/// Skips the test where this file or folder of the shared data is not there.
#define REQUIRE_SHARED(wanted)          \
  if (!std::filesystem::exists(wanted)) \
  GTEST_SKIP() << "needs ../shared/data: there is no " << std::filesystem::path(wanted).string()
