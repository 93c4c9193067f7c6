// Shader files embedded in the binary; the build generates their table from shaders/. Any thread.
#pragma once

#include <span>
#include <string_view>

namespace strandcast::gl {

struct EmbeddedShader {
  std::string_view path;  // below shaders/
  std::string_view text;
};

/// Returns the files in the order of shaders/CMakeLists.txt.
std::span<const EmbeddedShader> embedded_shaders();

}  // namespace strandcast::gl
