// Formats numbers as short text without trailing zeros, for text file formats; independent of the locale.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>

namespace strandcast {

/// Largest number of characters of a number.
inline constexpr size_t kMostDecimalChars = 24;

/// Writes `value` rounded to `decimals` (0 to 9) at `out` and returns its end. |value| is below 1e9.
inline char* put_decimal(char* out, double value, int decimals) {
  static constexpr int64_t kPower[] = {1,       10,        100,        1'000,       10'000,
                                       100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};
  const int64_t scale = kPower[decimals];
  const double scaled = value * static_cast<double>(scale);
  auto steps = static_cast<int64_t>(scaled < 0.0 ? 0.5 - scaled : scaled + 0.5);
  if (scaled < 0.0 && steps != 0) *out++ = '-';
  out = std::to_chars(out, out + kMostDecimalChars, steps / scale).ptr;
  int64_t rest = steps % scale;
  if (rest == 0) return out;
  int digits = decimals;
  while (rest % 10 == 0) {
    rest /= 10;
    --digits;
  }
  *out++ = '.';
  char* const end = out + digits;
  for (char* digit = end; digit != out; rest /= 10) *--digit = static_cast<char>('0' + rest % 10);
  return end;
}

}  // namespace strandcast
