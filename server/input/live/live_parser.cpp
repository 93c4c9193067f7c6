#include "server/input/live/live_parser.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "common/base/text.h"
#include "common/motion/opentrackio.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr size_t kMaxQuotedBytes = 40;

}  // namespace

std::span<const LiveProtocol> live_protocols() {
  constexpr LiveTransport kUdp = LiveTransport::Udp, kTcp = LiveTransport::Tcp;
  const std::vector<const char*> up_axes = {"y-up", "z-up"};
  static const std::vector<LiveProtocol> kProtocols = {
      {"vmc", "VMC of a performer (bones, trackers), and wind as OSC", kUdp, 39539, 0, {}, ""},
      {"opentrack", "opentrack's output \"UDP over network\"", kUdp, 4242, 0, {"xyz-ypr", "ypr-xyz"}, ""},
      {"freed", "FreeD D1 of cameras and heads", kUdp, 40000, 0, {"pan-tilt-roll", "tilt-pan-roll"}, ""},
      {"natnet", "OptiTrack's NatNet 2.5 to 4.1 (Motive)", kUdp, 1511, 1510, up_axes, "239.255.42.99"},
      {"vrpn", "trackers of a VRPN server", kTcp, 3883, 0, up_axes, ""},
      {"livelinkface",
       "Live Link Face of a phone: how the head is turned",
       kUdp,
       11111,
       0,
       {"half-turns", "radians"},
       ""},
      {"opentrackio",
       "OpenTrackIO 1.0 of cameras and heads, JSON or CBOR",
       kUdp,
       kOpenTrackIoPort,
       0,
       {"pan-left", "pan-right"},
       kOpenTrackIoGroup},
      {"vrchat", "VRChat's OSC trackers: head and 1 to 8", kUdp, 9000, 0, {}, ""},
      {"mvn", "Xsens MVN's network streamer: segments as quaternions", kUdp, 9763, 0, {}, ""},
  };
  return kProtocols;
}

Result<Timecode> parse_timecode_count(std::string_view text) {
  const bool is_drop = text.ends_with("df") && !text.ends_with("ndf");
  for (const std::string_view ending : {"ndf", "nd", "df"})
    if (text.ends_with(ending)) {
      text.remove_suffix(ending.size());
      break;
    }
  ASSIGN_OR_RETURN(const FrameRate rate, parse_frame_rate(text));
  return make_timecode({}, rate, is_drop);
}

Result<SpareCount> parse_spare_count(std::string_view text) {
  constexpr uint32_t kTopBit = 15;
  SpareCount count;
  const size_t colon = text.find(':');
  ASSIGN_OR_RETURN(count.begin, parse_timecode_count(text.substr(0, colon)));
  if (colon == std::string_view::npos) return count;
  const std::string_view bits = text.substr(colon + 1);
  uint32_t last = 0;
  const char* const end = bits.data() + bits.size();
  const auto first = std::from_chars(bits.data(), end, count.first_bit);
  const bool has_two = first.ec == std::errc() && first.ptr != end && *first.ptr == '-';
  const auto second = has_two ? std::from_chars(first.ptr + 1, end, last) : first;
  if (!has_two || second.ec != std::errc() || second.ptr != end || last <= count.first_bit || last > kTopBit)
    return make_error(ErrorCode::BadInput,
                      "bits of the spare word are FIRST-LAST within 0-{}, for example 12-15; "
                      "this is \"{}\"",
                      kTopBit, excerpt(bits, kMaxQuotedBytes));
  count.bits = last - count.first_bit + 1;
  return count;
}

Result<std::unique_ptr<LiveParser>> make_live_parser(const LiveParserConfig& config) {
  std::vector<const char*> names;
  for (const LiveProtocol& protocol : live_protocols()) names.push_back(protocol.name);
  ASSIGN_OR_RETURN(const size_t index, find_name("live protocol", config.protocol, names));
  std::string axis_order = config.axis_order;
  std::optional<SpareCount> count;
  if (const size_t slash = axis_order.find('/'); slash != std::string::npos && config.protocol == "freed") {
    const auto parsed = parse_spare_count(std::string_view(axis_order).substr(slash + 1));
    if (!parsed) return at("frames of the spare word", parsed.error());
    count = *parsed;
    axis_order.resize(slash);
  }
  size_t order = 0;
  if (!axis_order.empty()) {
    ASSIGN_OR_RETURN(order, find_name("axis order", axis_order, live_protocols()[index].axis_orders));
  }
  if (config.protocol == "vmc") return make_vmc_parser(config);
  if (config.protocol == "opentrack") return make_opentrack_parser(order);
  if (config.protocol == "freed") return make_freed_parser(order, count);
  if (config.protocol == "natnet") return make_natnet_parser(order, config.protocol_version);
  if (config.protocol == "vrpn") return make_vrpn_parser(order);
  if (config.protocol == "vrchat") return make_vrchat_parser(config);
  if (config.protocol == "mvn") return make_mvn_parser();
  if (config.protocol == "opentrackio") return make_opentrackio_parser(order);
  return make_live_link_face_parser(order);
}

Result<size_t> find_name(const char* kind, const std::string& name, const std::vector<const char*>& known) {
  const auto found = std::find(known.begin(), known.end(), name);
  if (found != known.end()) return static_cast<size_t>(found - known.begin());
  if (known.empty())
    return make_error(ErrorCode::NotFound, "there is no {} to choose for this protocol", kind);
  return make_error(ErrorCode::NotFound, "there is no {} \"{}\"; there are {}", kind,
                    excerpt(name, kMaxQuotedBytes), fmt::join(known, ", "));
}

std::optional<int64_t> nanoseconds_of(double seconds) {
  constexpr double kMostSeconds = 9e9;  // 285 years: below what 63 bits of nanoseconds hold
  if (!(std::abs(seconds) <= kMostSeconds)) return std::nullopt;
  return static_cast<int64_t>(std::llround(seconds * 1e9));
}

std::optional<double> fine_seconds(float seconds) {
  const float next = std::nextafter(std::abs(seconds), std::numeric_limits<float>::infinity());
  // The negation is true for what is no number.
  if (!(static_cast<double>(next) - std::abs(static_cast<double>(seconds)) <= kCoarsestTimeS)) return {};
  return seconds;
}

void MonitorLines::add(std::string line) {
  if (has_room())
    lines_.push_back(std::move(line));
  else
    ++left_out_;
}

std::vector<std::string> MonitorLines::take() && {
  if (left_out_ > 0) lines_.push_back(fmt::format("and {} more", left_out_));
  return std::move(lines_);
}

}  // namespace strandcast
