#include "client/app/frame_rate.h"

#include <charconv>
#include <cmath>
#include <optional>

#include "common/base/text.h"

namespace strandcast {
namespace {

constexpr size_t kMaxShownRateChars = 40;

std::optional<double> whole_number(std::string_view text) {
  double number = 0.0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size() || !std::isfinite(number)) return {};
  return number;
}

/// The rate of television that a rounded one means: 1000/1001 of a usual one.
double exact_rate(double rate) {
  constexpr double kRounding = 0.0051;  // 23.98 and 23.976 are one rate
  for (const double usual : {24.0, 30.0, 48.0, 60.0, 72.0, 96.0, 120.0, 240.0})
    if (const double exact = usual * 1000.0 / 1001.0; std::abs(rate - exact) < kRounding) return exact;
  return rate;
}

}  // namespace

Result<double> parse_frame_rate(std::string_view text, double least, double most) {
  const size_t slash = text.find('/');
  const auto first = whole_number(text.substr(0, slash));
  const auto second = slash == std::string_view::npos ? 1.0 : whole_number(text.substr(slash + 1));
  if (!first || !second || *second == 0.0)
    return make_error(ErrorCode::BadInput, "'{}' is no rate: write 24, 23.976 or 24000/1001",
                      excerpt(std::string(text), kMaxShownRateChars));
  const double rate = slash == std::string_view::npos ? exact_rate(*first) : *first / *second;
  // The negation is true for what is no number.
  if (!(rate >= least && rate <= most))
    return make_error(ErrorCode::BadInput, "{} frames per second are asked for; {:g} to {:g} are possible",
                      excerpt(std::string(text), kMaxShownRateChars), least, most);
  return rate;
}

std::string frame_rate_text(double rate) {
  return fmt::format("{:.6g}", std::round(rate * 1e3) / 1e3);
}

std::string make_frame_rate(std::string& text, double least, double most) {
  const auto rate = parse_frame_rate(text, least, most);
  if (!rate) return rate.error().message;
  text = fmt::format("{}", *rate);
  return {};
}

}  // namespace strandcast
