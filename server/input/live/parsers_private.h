// The parsers by name, for live_parser.cpp, and what they share.
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/input/live/live_parser.h"

namespace strandcast {

// An axis order is an index into LiveProtocol::axis_orders.
std::unique_ptr<LiveParser> make_vmc_parser(const LiveParserConfig& config);
std::unique_ptr<LiveParser> make_opentrack_parser(size_t axis_order);
std::unique_ptr<LiveParser> make_freed_parser(size_t axis_order);
Result<std::unique_ptr<LiveParser>> make_natnet_parser(size_t axis_order, const std::string& version);
std::unique_ptr<LiveParser> make_vrpn_parser(size_t axis_order);
std::unique_ptr<LiveParser> make_live_link_face_parser(size_t axis_order);

/// The place of a name among those known, or NotFound with a sentence that lists them.
Result<size_t> find_name(const char* kind, const std::string& name, const std::vector<const char*>& known);

/// Subjects are named by at most so many bytes; longer names are cut.
constexpr size_t kMaxSubjectBytes = 64;

/// x, y, z, w, as all of these protocols send them.
inline glm::dquat quaternion_of(const glm::dvec4& xyzw) {
  return {xyzw.w, xyzw.x, xyzw.y, xyzw.z};
}

/// Seconds as whole nanoseconds; none where they are no time that fits.
std::optional<int64_t> nanoseconds_of(double seconds);

/// Lines for describe(): those beyond kMaxMonitorLines are counted in the last.
class MonitorLines {
 public:
  void add(std::string line);
  /// True while a line added would be shown: what is costly to write need not be written.
  bool has_room() const { return lines_.size() + 1 < kMaxMonitorLines; }
  std::vector<std::string> take() &&;

 private:
  std::vector<std::string> lines_;
  uint64_t left_out_ = 0;
};

}  // namespace strandcast
