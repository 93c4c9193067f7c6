// What has to hold of a parser of a live protocol, whatever its peer sends.
#pragma once

#include <bit>

#include "common/base/check.h"
#include "common/base/text.h"
#include "server/input/live/live_parser.h"

namespace strandcast {

/// The same to the last bit, NaN included.
inline bool is_same(double a, double b) {
  return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b);
}

inline bool is_same(const glm::dvec3& a, const glm::dvec3& b) {
  return is_same(a.x, b.x) && is_same(a.y, b.y) && is_same(a.z, b.z);
}

inline bool is_same(const LivePose& a, const LivePose& b) {
  const glm::dquat& p = a.world_from_subject.rotation;
  const glm::dquat& q = b.world_from_subject.rotation;
  bool same = a.subject == b.subject && a.has_position == b.has_position &&
              a.source_time_ns == b.source_time_ns && a.frame == b.frame && a.joint_names == b.joint_names &&
              a.joint_m.size() == b.joint_m.size() &&
              is_same(a.world_from_subject.position_m, b.world_from_subject.position_m) &&
              is_same(p.w, q.w) && is_same({p.x, p.y, p.z}, {q.x, q.y, q.z});
  for (size_t i = 0; same && i < a.joint_m.size(); ++i) same = is_same(a.joint_m[i], b.joint_m[i]);
  return same;
}

inline void check_packet(const LivePacket& packet) {
  constexpr size_t kMostSubjectBytes = 64;
  for (const LivePose& pose : packet.poses) {
    CHECK(pose.joint_names.size() == pose.joint_m.size());
    CHECK(pose.subject.size() <= 2 * kMostSubjectBytes + 1);  // of a skeleton and a bone
    CHECK(one_line(pose.subject, pose.subject.size()) == pose.subject);
  }
}

inline void check_monitor(const LiveParser& parser) {
  const std::vector<std::string> lines = parser.describe();
  CHECK(lines.size() <= kMaxMonitorLines);
  for (const std::string& line : lines) CHECK(one_line(line, line.size()) == line);
}

/// A parser that gets all a peer sends beside one that gets only what the first took: an error has changed
/// nothing when both say the same ever after.
class LiveParserPair {
 public:
  explicit LiveParserPair(const LiveParserConfig& config)
      : of_all_(std::move(make_live_parser(config).value())),
        of_taken_(std::move(make_live_parser(config).value())) {}

  void parse(std::span<const std::byte> bytes) {
    const auto packet = of_all_->parse(bytes, 0);
    check_monitor(*of_all_);
    (void)of_all_->request();
    if (!packet) {
      CHECK(!packet.error().message.empty() && is_printable(packet.error().message));
      return;
    }
    check_packet(*packet);
    const auto other = of_taken_->parse(bytes, 0);
    CHECK(other.ok() && other->poses.size() == packet->poses.size());
    for (size_t i = 0; i < packet->poses.size(); ++i) CHECK(is_same(packet->poses[i], other->poses[i]));
    CHECK(of_all_->ignored() == of_taken_->ignored());
    CHECK(of_all_->describe() == of_taken_->describe());
    CHECK(of_all_->request() == of_taken_->request());
  }

 private:
  std::unique_ptr<LiveParser> of_all_, of_taken_;
};

}  // namespace strandcast
