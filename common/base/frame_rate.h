// FrameRate: frames per second as an exact quotient, and as people write it: 24, 23.976, 24000/1001. Any
// thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

struct FrameRate {
  uint32_t numerator = 30;  // frames in `denominator` seconds; neither is 0
  uint32_t denominator = 1;

  /// Returns frames per second, rounded to a double.
  double hz() const { return static_cast<double>(numerator) / denominator; }
  bool operator==(const FrameRate&) const = default;
};

inline constexpr double kMostFrameRate = 240.0;  // frames per second
inline constexpr double kLeastFrameRate = 1e-6;

/// Parses a rate in frames per second: a number, or a quotient of two. Rates of television are meant exactly
/// where they are rounded: 23.976 is 24000/1001. Other numbers count to six decimals. The quotient has no
/// common divisor. BadInput says which rates there are.
Result<FrameRate> parse_frame_rate(std::string_view text, double least = kLeastFrameRate,
                                   double most = kMostFrameRate);

/// Returns the seconds of a frame whose decimals were rounded: of 0.0333333 1/30, of 0.0417083 1001/24000.
/// Others stay: those that lie further off than rounding to four digits explains.
double exact_frame_s(double frame_s);

/// Formats a rate in frames per second for people, in as many digits as they use: 23.976.
std::string frame_rate_text(double rate_hz);

/// Rewrites a rate of a command line, as parse_frame_rate() reads it, as one number. Returns what is wrong,
/// or nothing, as validators of command lines do.
std::string make_frame_rate(std::string& text, double least, double most);

}  // namespace strandcast
