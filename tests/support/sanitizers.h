// Whether a sanitizer runs beside the test: what memory the process takes says little then.
#pragma once

namespace strandcast::test {

// CMake undefines GCC's own macro of the thread sanitizer and sets that of its library
// (cmake/strandcast.cmake).
#if defined(__SANITIZE_ADDRESS__) || defined(_GLIBCXX_TSAN)
inline constexpr bool kHasSanitizer = true;
#else
inline constexpr bool kHasSanitizer = false;
#endif

}  // namespace strandcast::test
