#include "client/web/core_export.h"

#include <cstdlib>
#include <string>

#include "client/web/strand_core.h"

using namespace strandcast;

namespace {

std::string& last_error() {
  static std::string text;
  return text;
}
ErrorCode last_error_code = ErrorCode::Internal;

}  // namespace

/// Replaces the standard library's function, which prints the reason of an abort and so links all of
/// printf.
extern "C" void abort_message(const char*, ...) {
  std::abort();
}

void remember_core_error(const Error& error) {
  last_error() = error.to_string();
  last_error_code = error.code;
}

STRAND_CORE_EXPORT void* strand_core_allocate(size_t size_bytes) {
  return std::malloc(size_bytes);
}
STRAND_CORE_EXPORT void strand_core_free(void* memory) {
  std::free(memory);
}
STRAND_CORE_EXPORT const char* strand_core_error() {
  return last_error().c_str();
}
STRAND_CORE_EXPORT const char* strand_core_error_kind() {
  return to_string(last_error_code);
}
