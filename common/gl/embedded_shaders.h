// The shader files inside the binary; the table is generated from shaders/ when building. Any thread.
#pragma once

#include <span>
#include <string_view>

namespace strandcast::gl {

struct EmbeddedShader {
  std::string_view path;  // below shaders/
  std::string_view text;
};

/// In the order of shaders/CMakeLists.txt.
std::span<const EmbeddedShader> embedded_shaders();

}  // namespace strandcast::gl
