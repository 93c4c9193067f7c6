// VRChat's OSC trackers, by their page: `/tracking/trackers/NAME/position` and `/rotation`, three floats
// each, in Unity's world, metres and degrees; NAME is `head`, or 1 to 8. Unity turns about z first, then x,
// then y. Nothing says where a frame ends: it does with the last kind that frames had so far, or before a
// kind that comes again.
#include <array>
#include <string_view>
#include <utility>

#include "server/input/live/conventions.h"
#include "server/input/live/osc_reader.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr std::string_view kPlaces = "position", kTurns = "rotation";
constexpr std::array<std::string_view, 9> kTrackerNames = {"head", "1", "2", "3", "4", "5", "6", "7", "8"};
constexpr uint8_t kPlaceBit = 1, kTurnBit = 2;
constexpr uint32_t kLoneFrames = 3;  // of one kind alone: there is no other

struct VrchatTracker {
  glm::dvec3 position_m{0.0}, turn_deg{0.0};
  uint8_t ever = 0;                         // kinds that were sent
  uint8_t seen = 0;                         // of the frame that comes in
  uint8_t expected = kPlaceBit | kTurnBit;  // of a whole frame
  uint32_t lone = 0;                        // frames since both came that had one kind
};

class VrchatParser : public LiveParser {
 public:
  explicit VrchatParser(const LiveParserConfig& config)
      : limit_bytes_(std::min(config.max_datagram_bytes, kMaxDatagramBytes)) {}

  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t) override {
    ASSIGN_OR_RETURN(const OscPacket osc, read_osc(bytes, limit_bytes_));
    last_.assign(bytes.begin(), bytes.end());
    ignored_ += osc.unknown_tags;
    LivePacket packet;
    for (const OscMessage& message : osc.messages)
      if (!apply(message, packet)) ++ignored_;
    return packet;
  }

  uint64_t ignored() const override { return ignored_; }

  std::vector<std::string> describe() const override { return describe_osc(last_, limit_bytes_); }
  std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

 private:
  /// False for a message that is not known, or has other arguments than its address asks for.
  bool apply(const OscMessage& message, LivePacket& packet) {
    if (message.address.starts_with(kVmcAddresses) && !std::exchange(has_told_vmc_, true))
      notes_.emplace_back("the sender tells a performer as VMC: --mocap vmc:PORT takes it");
    if (!message.address.starts_with(kVrchatTrackers)) return false;
    const std::string_view rest = message.address.substr(kVrchatTrackers.size());
    const size_t slash = std::min(rest.find('/'), rest.size());
    const std::string_view kind = rest.substr(std::min(slash + 1, rest.size()));
    size_t index = 0;
    while (index < kTrackerNames.size() && rest.substr(0, slash) != kTrackerNames[index]) ++index;
    if (index == kTrackerNames.size() || (kind != kPlaces && kind != kTurns)) return false;
    OscArguments arguments(message);
    glm::dvec3 value(0.0);
    for (int axis = 0; axis < 3; ++axis) value[axis] = arguments.take_float().value_or(0.0f);
    if (!arguments.ok()) return false;
    set(index, kind == kPlaces ? kPlaceBit : kTurnBit, value, packet);
    return true;
  }

  void set(size_t index, uint8_t kind, const glm::dvec3& value, LivePacket& packet) {
    VrchatTracker& tracker = trackers_[index];
    if ((tracker.seen & kind) != 0) {
      packet.poses.push_back(pose_of(index));
      // One message that was lost changes nothing.
      if (++tracker.lone == kLoneFrames) tracker.expected = kind;
      tracker.seen = 0;
    }
    (kind == kPlaceBit ? tracker.position_m : tracker.turn_deg) = value;
    tracker.seen |= kind;
    tracker.ever |= kind;
    tracker.expected |= kind;
    if (tracker.seen != tracker.expected) return;
    packet.poses.push_back(pose_of(index));
    if (tracker.seen == (kPlaceBit | kTurnBit)) tracker.lone = 0;
    tracker.seen = 0;
  }

  LivePose pose_of(size_t index) const {
    const VrchatTracker& tracker = trackers_[index];
    const glm::dvec3 turn_rad = kRadPerDegree * tracker.turn_deg;
    LivePose pose;
    pose.subject = kTrackerNames[index];
    pose.has_position = (tracker.ever & kPlaceBit) != 0;
    pose.world_from_subject = {pose_from_unity(tracker.position_m, {1.0, 0.0, 0.0, 0.0}).position_m,
                               rotation_of({-turn_rad.y, turn_rad.x, -turn_rad.z})};
    return pose;
  }

  uint32_t limit_bytes_;
  std::array<VrchatTracker, kTrackerNames.size()> trackers_;
  bool has_told_vmc_ = false;
  std::vector<std::string> notes_;
  std::vector<std::byte> last_;
  uint64_t ignored_ = 0;
};

}  // namespace

std::unique_ptr<LiveParser> make_vrchat_parser(const LiveParserConfig& config) {
  return std::make_unique<VrchatParser>(config);
}

}  // namespace strandcast
