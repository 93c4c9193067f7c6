// Fixture with a current GL context; fails where there is none, because deploy/install_deps.sh brings
// llvmpipe.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "common/gl/egl_context.h"

namespace strandcast {

class GlTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = gl::EglContext::make("auto");
    ASSERT_TRUE(made) << made.error().to_string();
    context_ = std::move(made).value();
  }

  std::unique_ptr<gl::EglContext> context_;
};

}  // namespace strandcast
