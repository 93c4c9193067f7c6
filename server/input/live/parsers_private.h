// Makers of the parsers, for live_parser.cpp, and functions that parsers share.
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/input/live/live_parser.h"

namespace strandcast {

// An axis order is an index into LiveProtocol::axis_orders.
std::unique_ptr<LiveParser> make_vmc_parser(const LiveParserConfig& config);
std::unique_ptr<LiveParser> make_opentrack_parser(size_t axis_order);
/// `count`: how the spare word counts frames; empty: it does not.
std::unique_ptr<LiveParser> make_freed_parser(size_t axis_order, const std::optional<SpareCount>& count);
Result<std::unique_ptr<LiveParser>> make_natnet_parser(size_t axis_order, const std::string& version);
std::unique_ptr<LiveParser> make_vrpn_parser(size_t axis_order);
std::unique_ptr<LiveParser> make_opentrackio_parser(size_t axis_order);
std::unique_ptr<LiveParser> make_mvn_parser();
std::unique_ptr<LiveParser> make_vrchat_parser(const LiveParserConfig& config);
std::unique_ptr<LiveParser> make_live_link_face_parser(size_t axis_order);

/// Returns the index of a name among `known`; NotFound lists them.
Result<size_t> find_name(const char* kind, const std::string& name, const std::vector<const char*>& known);

/// What OSC's addresses begin with, by which one protocol's packets are known on the other's port.
constexpr std::string_view kVmcAddresses = "/VMC/", kVrchatTrackers = "/tracking/trackers/";

/// Longest name of a subject in bytes; longer names are cut.
constexpr size_t kMaxSubjectBytes = 64;

/// Converts x, y, z, w, the order of all these protocols, to a quaternion.
inline glm::dquat quaternion_of(const glm::dvec4& xyzw) {
  return {xyzw.w, xyzw.x, xyzw.y, xyzw.z};
}

/// Converts seconds to whole nanoseconds; empty if they are not finite or do not fit.
std::optional<int64_t> nanoseconds_of(double seconds);

/// Goes on where a number of 16 bits, or fewer, begins anew.
class WrappingCount {
 public:
  explicit WrappingCount(uint32_t bits = 16) : spare_bits_(16 - bits) {}
  uint32_t unwrapped(uint32_t number) {
    const auto high = static_cast<int16_t>(static_cast<uint16_t>((number - count_) << spare_bits_));
    const int passed = high >> spare_bits_;
    count_ = has_begun_ && number < 0x10000 ? count_ + static_cast<uint32_t>(passed) : number;
    has_begun_ = true;
    return count_;
  }

 private:
  uint32_t spare_bits_;
  uint32_t count_ = 0;
  bool has_begun_ = false;
};

/// A time in larger steps is worse than that of the packet's arrival.
constexpr double kCoarsestTimeS = 0.002;
/// Returns the seconds of a time that was sent as a float; empty if its steps are larger than kCoarsestTimeS
/// there (from 32,768 s on), or it is no number.
std::optional<double> fine_seconds(float seconds);

/// Collects lines for describe(); lines beyond kMaxMonitorLines are counted in the last.
class MonitorLines {
 public:
  void add(std::string line);
  /// Returns whether a further line would be shown, so that costly lines can be skipped.
  bool has_room() const { return lines_.size() + 1 < kMaxMonitorLines; }
  std::vector<std::string> take() &&;

 private:
  std::vector<std::string> lines_;
  uint64_t left_out_ = 0;
};

/// Returns describe()'s lines of an OSC packet; none for what is no such packet.
std::vector<std::string> describe_osc(std::span<const std::byte> packet, size_t limit_bytes);

}  // namespace strandcast
