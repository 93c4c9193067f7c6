// The one reason for which a test of a server may be skipped: a machine without OpenGL.
#pragma once

#include <string_view>

namespace strandcast::test {

/// In what a program wrote or an error says: gl::EglContext's own sentence, and no other trouble.
inline bool lacks_gl(std::string_view text) {
  return text.find("no OpenGL") != std::string_view::npos;
}

}  // namespace strandcast::test
