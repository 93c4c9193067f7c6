#include "client/web/fmt/format.h"

namespace {

constexpr uint32_t kMaxNumberChars = 32;
constexpr uint32_t kShortest = 0;

/// Writes the number's digits, at most kMaxNumberChars; gives their number. `digits`: significant ones, or
/// kShortest for as few as tell it from its neighbours.
__attribute__((import_module("env"), import_name("write_number"))) extern "C" uint32_t write_number(
    double number, uint32_t is_float, uint32_t digits, char* text);

struct Format {
  bool is_hex = false;
  bool has_prefix = false;
  bool is_zero_filled = false;
  uint32_t width = 0;
  uint32_t digits = kShortest;
};

/// What stands between ':' and '}'.
Format read_format(std::string_view text) {
  Format format;
  for (bool is_behind_point = false; const char c : text) {
    if (c == '#')
      format.has_prefix = true;
    else if (c == '.')
      is_behind_point = true;
    else if (c == 'x')
      format.is_hex = true;
    else if (c == '0' && format.width == 0 && !is_behind_point)
      format.is_zero_filled = true;
    else if (c >= '0' && c <= '9') {
      uint32_t& number = is_behind_point ? format.digits : format.width;
      number = 10 * number + static_cast<uint32_t>(c - '0');
    }
  }
  return format;
}

void append_integer(uint64_t number, const Format& format, std::string& text) {
  char digits[20];
  uint32_t count = 0;
  const uint64_t base = format.is_hex ? 16 : 10;
  do {
    digits[count++] = "0123456789abcdef"[number % base];
    number /= base;
  } while (number != 0);
  if (format.has_prefix) text += "0x";
  for (uint32_t i = count; i < format.width; ++i) text += format.is_zero_filled ? '0' : ' ';
  while (count > 0) text += digits[--count];
}

void append(const fmt::Argument& argument, const Format& format, std::string& text) {
  using Kind = fmt::Argument::Kind;
  uint64_t integer = argument.integer;
  switch (argument.kind) {
    case Kind::Text:
      text += argument.text;
      return;
    case Kind::Signed:
      if (static_cast<int64_t>(integer) < 0) {
        text += '-';
        integer = 0 - integer;
      }
      [[fallthrough]];
    case Kind::Unsigned:
      append_integer(integer, format, text);
      return;
    case Kind::Float:
    case Kind::Double: {
      char digits[kMaxNumberChars];
      text.append(digits, write_number(argument.number, argument.kind == Kind::Float, format.digits, digits));
    }
  }
}

}  // namespace

std::string fmt::format_arguments(std::string_view format, std::span<const Argument> arguments) {
  std::string text;
  for (size_t at = 0, next = 0; at < format.size(); ++at) {
    if (format[at] != '{') {
      text += format[at];
      continue;
    }
    const size_t end = format.find('}', at);
    if (end == std::string_view::npos || next == arguments.size()) break;
    append(arguments[next++], read_format(format.substr(at + 1, end - at - 1)), text);
    at = end;
  }
  return text;
}
