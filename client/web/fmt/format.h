// Replacement for the parts of fmt that the core's errors use, for WebAssembly, where fmt would take a fifth
// of the module. It gives the same text (tests/web/as_native.sh compares): strings, integers ({}, {:#x},
// {:04x}) and floating point ({}, {:.3g}). The script that loads the module (client/web/strand_core.mjs)
// computes the digits of floating-point numbers. Format strings are fixed in the code and were checked where
// fmt compiled them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace fmt {

struct Argument {
  enum class Kind : uint8_t { Text, Signed, Unsigned, Float, Double };
  Kind kind;
  std::string_view text = {};
  uint64_t integer = 0;
  double number = 0.0;
};

template <class T>
Argument make_argument(const T& value) {
  static_assert(!std::is_same_v<T, bool> && !std::is_same_v<T, char>, "no error says one of these");
  if constexpr (std::is_same_v<T, float>)
    return {Argument::Kind::Float, {}, 0, static_cast<double>(value)};
  else if constexpr (std::is_floating_point_v<T>)
    return {Argument::Kind::Double, {}, 0, static_cast<double>(value)};
  else if constexpr (std::is_signed_v<T>)
    return {Argument::Kind::Signed, {}, static_cast<uint64_t>(static_cast<int64_t>(value))};
  else if constexpr (std::is_unsigned_v<T>)
    return {Argument::Kind::Unsigned, {}, value};
  else
    return {Argument::Kind::Text, value};
}

std::string format_arguments(std::string_view format, std::span<const Argument> arguments);

template <class...>
using format_string = std::string_view;

template <class... Args>
std::string format(std::string_view format, const Args&... args) {
  const Argument arguments[] = {make_argument(args)..., {Argument::Kind::Text}};
  return format_arguments(format, {arguments, sizeof...(Args)});
}

}  // namespace fmt
