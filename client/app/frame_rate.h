// Frame rates of files as people write them: 24, 23.976, 24000/1001. Any thread.
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

inline constexpr double kMostFrameRate = 240.0;  // frames per second
inline constexpr double kLeastFrameRate = 1e-3;

/// Parses a rate in frames per second: a number, or a quotient of two. Rates of television are meant exactly
/// where they are rounded: 23.976 is 24000/1001. BadInput says which rates there are.
Result<double> parse_frame_rate(std::string_view text, double least, double most);

/// Formats a rate for people, in as many digits as they use: 23.976.
std::string frame_rate_text(double rate);

/// Writes a rate of a command line, as parse_frame_rate() reads it, as one number. Returns what is wrong, or
/// nothing, as validators of command lines do.
std::string make_frame_rate(std::string& text, double least, double most);

}  // namespace strandcast
