#include "common/wire/session_path.h"

#include <algorithm>

namespace strandcast {
namespace {

/// Of ASCII, whatever the locale.
bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

}  // namespace

bool is_session_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxSessionNameChars && is_letter_or_digit(name.front()) &&
         std::all_of(name.begin(), name.end(),
                     [](char c) { return is_letter_or_digit(c) || c == '.' || c == '_' || c == '-'; });
}

std::string_view without_session(std::string_view target) {
  if (!target.starts_with(kSessionFolder)) return target;
  const std::string_view rest = target.substr(kSessionFolder.size());
  const std::string_view name = rest.substr(0, rest.find('/'));
  return is_session_name(name) ? rest.substr(name.size()) : target;
}

}  // namespace strandcast
