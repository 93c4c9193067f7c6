#include "common/base/frame_rate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "common/base/text.h"

namespace strandcast {
namespace {

constexpr size_t kMaxShownRateChars = 40;
constexpr double kNtsc = 1000.0 / 1001.0;

/// The rate of television that a rounded one means: 1000/1001 of a usual one.
std::optional<FrameRate> television_rate(double rate) {
  constexpr double kRounding = 0.0051;  // 23.98 and 23.976 are one rate
  for (const uint32_t usual : {24u, 30u, 48u, 60u, 72u, 96u, 120u, 240u})
    if (std::abs(rate - usual * kNtsc) < kRounding) return FrameRate{usual * 1000, 1001};
  return std::nullopt;
}

/// A decimal number: how many of its parts it is, and how many of them make one.
struct Decimal {
  int64_t count = 0;
  int64_t in_one = 1;

  double value() const { return static_cast<double>(count) / static_cast<double>(in_one); }
};

/// Digits with at most one point among them, a minus before; decimals behind the sixth are left out.
std::optional<Decimal> read_decimal(std::string_view text) {
  constexpr size_t kMostDigits = 11;  // before the point; the parts of two numbers multiplied fit in 64 bits
  constexpr int64_t kMostParts = 1'000'000;
  const bool is_negative = text.starts_with('-');
  if (is_negative) text.remove_prefix(1);
  const size_t point = std::min(text.find('.'), text.size());
  const std::string_view decimals = text.substr(std::min(point + 1, text.size()));
  const auto are_digits = [](std::string_view some) {
    return std::all_of(some.begin(), some.end(), [](char c) { return c >= '0' && c <= '9'; });
  };
  if (point == 0 || point > kMostDigits || !are_digits(text.substr(0, point)) || !are_digits(decimals))
    return std::nullopt;
  Decimal number;
  const auto add = [&](char digit) { number.count = 10 * number.count + (digit - '0'); };
  for (const char digit : text.substr(0, point)) add(digit);
  for (size_t i = 0; i < decimals.size() && number.in_one < kMostParts; ++i, number.in_one *= 10)
    add(decimals[i]);
  const int64_t divisor = std::gcd(number.count, number.in_one);
  number = {number.count / divisor, number.in_one / divisor};
  if (is_negative) number.count = -number.count;
  return number;
}

/// The number before what a rate of cameras has behind it: "df", "nd" or "ndf". Empty for all else.
std::string_view counted_rate(std::string_view text) {
  for (const std::string_view ending : {"ndf", "nd", "df"})
    if (text.ends_with(ending) && read_decimal(text.substr(0, text.size() - ending.size())))
      return text.substr(0, text.size() - ending.size());
  return {};
}

/// Of numbers above 0.
std::optional<FrameRate> quotient_of(const Decimal& first, const Decimal& second) {
  const int64_t across = std::gcd(first.count, second.count), below = std::gcd(first.in_one, second.in_one);
  const int64_t numerator = first.count / across * (second.in_one / below);
  const int64_t denominator = second.count / across * (first.in_one / below);
  const int64_t divisor = std::gcd(numerator, denominator);
  constexpr int64_t kMost = std::numeric_limits<uint32_t>::max();
  if (numerator / divisor > kMost || denominator / divisor > kMost) return std::nullopt;
  return FrameRate{static_cast<uint32_t>(numerator / divisor), static_cast<uint32_t>(denominator / divisor)};
}

}  // namespace

Result<FrameRate> parse_frame_rate(std::string_view text, double least, double most) {
  const std::string shown = excerpt(std::string(text), kMaxShownRateChars);
  const auto no_rate = [&] {
    if (const std::string_view counted = counted_rate(text); !counted.empty())
      return make_error(
          ErrorCode::BadInput,
          "'{}' is no rate: write {}; a timecode's ; counts drop-frame (01:00:00;00), and its : "
          "does not",
          shown, counted);
    return make_error(ErrorCode::BadInput, "'{}' is no rate: write 24, 23.976 or 24000/1001", shown);
  };
  const size_t slash = text.find('/');
  const bool is_quotient = slash != std::string_view::npos;
  const auto first = read_decimal(text.substr(0, slash));
  const auto second = is_quotient ? read_decimal(text.substr(slash + 1)) : Decimal{1, 1};
  if (!first || !second || second->count == 0) return no_rate();
  const auto television = is_quotient ? std::nullopt : television_rate(first->value());
  const double rate = television ? television->hz() : first->value() / second->value();
  if (rate < least || rate > most || first->count <= 0 || second->count < 0)
    return make_error(ErrorCode::BadInput, "{} frames per second are asked for; {} to {:g} are possible",
                      shown, least < 1e-3 ? fmt::format("{:.6f}", least) : fmt::format("{:g}", least), most);
  const auto exact = television ? television : quotient_of(*first, *second);
  if (!exact) return no_rate();
  return *exact;
}

double exact_frame_s(double frame_s) {
  constexpr double kRounding = 2e-4;  // relative; whole rates and those of television lie 1e-3 apart
  const double rate = 1.0 / frame_s, whole = std::round(rate);
  for (const double exact : {whole, std::round(rate / kNtsc) * kNtsc})
    if (exact >= 1.0 * kNtsc && std::abs(rate - exact) < kRounding * rate) return 1.0 / exact;
  return frame_s;
}

std::string frame_rate_text(double rate_hz) {
  return fmt::format("{:.6g}", rate_hz < 1.0 ? rate_hz : std::round(rate_hz * 1e3) / 1e3);
}

std::string make_frame_rate(std::string& text, double least, double most) {
  const auto rate = parse_frame_rate(text, least, most);
  if (!rate) return rate.error().message;
  text = fmt::format("{}", rate->hz());
  return {};
}

}  // namespace strandcast
