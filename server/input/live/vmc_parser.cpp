// VMC, version 3.1, of a performer: the bones of an avatar, trackers and time as OSC 1.0; and wind in m/s as
// OSC of our own (`/strandcast/wind fff`). The head is root * hips * spine * chest * upper chest * neck *
// head, a subject without a name; `/strandcast/record/start [slate s, take i]` and `/stop` are for
// recordings, from any sender that may send. Trackers go by serial number. A zero position is that of a usual
// body, unless `ignores_zero_positions` is off. Floats are little-endian where quaternions say so. VMC has no
// frames: one ends with the last bone that frames had so far, or before a bone that comes again. A time whose
// float has steps above 2 ms is not used.
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/text.h"
#include "common/scene/body_desc.h"
#include "server/input/live/conventions.h"
#include "server/input/live/osc_reader.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr std::string_view kRecordAddress = "/strandcast/record/";
constexpr std::string_view kOwnAddress = "/strandcast/";
constexpr std::array<std::string_view, 3> kOwnCommands = {"/strandcast/record/start",
                                                          "/strandcast/record/stop", "/strandcast/wind"};
bool is_own_command(std::string_view address) {
  return std::find(kOwnCommands.begin(), kOwnCommands.end(), address) != kOwnCommands.end();
}
constexpr size_t kNoParent = SIZE_MAX;

/// A bone by its name in Unity and where it is under its parent in a usual body, for senders that tell
/// rotations only. Right-handed, arms held out. A parent that nobody sends hangs on its own parent in the
/// same place.
struct BoneInfo {
  const char* name;
  size_t parent;
  glm::dvec3 bind_m;
};
enum Bone : size_t {
  kRoot,
  kHips,
  kSpine,
  kChest,
  kUpperChest,
  kNeck,
  kHead,
  kLeftShoulder,
  kLeftUpperArm,
  kLeftLowerArm,
  kRightShoulder,
  kRightUpperArm,
  kRightLowerArm,
  kBoneCount
};
constexpr std::array<BoneInfo, kBoneCount> kBones = {{
    {"root", kNoParent, {0.0, 0.0, 0.0}},
    {"Hips", kRoot, {0.0, 0.95, 0.0}},
    {"Spine", kHips, {0.0, 0.10, 0.0}},
    {"Chest", kSpine, {0.0, 0.12, 0.0}},
    {"UpperChest", kChest, {0.0, 0.12, 0.0}},
    {"Neck", kUpperChest, {0.0, 0.14, 0.0}},
    {"Head", kNeck, {0.0, 0.10, 0.0}},
    {"LeftShoulder", kUpperChest, {0.03, 0.10, 0.0}},
    {"LeftUpperArm", kLeftShoulder, {0.13, 0.0, 0.0}},
    {"LeftLowerArm", kLeftUpperArm, {0.28, 0.0, 0.0}},
    {"RightShoulder", kUpperChest, {-0.03, 0.10, 0.0}},
    {"RightUpperArm", kRightShoulder, {-0.13, 0.0, 0.0}},
    {"RightLowerArm", kRightUpperArm, {-0.28, 0.0, 0.0}},
}};
using BoneSet = uint32_t;
constexpr BoneSet bit_of(size_t bone) {
  return BoneSet{1} << bone;
}

/// A sender that leaves bones out in so many frames on end does not send them any more.
constexpr int kForgottenAfterFrames = 30;

/// Unit length, or NaN where a quaternion has no direction: a chain of bones would hide which it was.
glm::dquat unit_or_nan(const glm::dquat& rotation) {
  constexpr double kLeastLength = 0.5, kMostLength = 2.0;
  const double length = glm::length(rotation);
  if (length >= kLeastLength && length <= kMostLength) return rotation * (1.0 / length);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  return {nan, nan, nan, nan};
}

Pose operator*(const Pose& parent, const Pose& child) {
  return {parent * child.position_m, parent.rotation * child.rotation};
}

using PoseFloats = std::array<float, 7>;  // a place and a quaternion

float turned_round(float number) {
  auto bytes = std::bit_cast<std::array<std::byte, sizeof(float)>>(number);
  std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<float>(bytes);
}
PoseFloats turned_round(PoseFloats numbers) {
  for (float& number : numbers) number = turned_round(number);
  return numbers;
}

/// The order of the bytes of a sender's floats: OSC's, unless quaternions on end have unit length in the
/// other order alone.
class FloatOrder {
 public:
  bool is_little() const { return is_little_; }
  void judge(const PoseFloats& as_osc) {
    const bool is_osc = is_unit(as_osc), is_other = is_unit(turned_round(as_osc));
    if (is_osc == is_other) return;
    in_a_row_ = is_other == is_little_ ? 0 : in_a_row_ + 1;
    if (in_a_row_ < kDecidingPoses) return;
    is_little_ = is_other;
    in_a_row_ = 0;
    has_news_ = true;
  }
  bool take_news() { return std::exchange(has_news_, false); }

 private:
  static constexpr int kDecidingPoses = 5;
  static bool is_unit(const PoseFloats& numbers) {
    constexpr double kTolerance = 0.05;
    double square = 0.0;
    for (size_t i = 3; i < numbers.size(); ++i) square += static_cast<double>(numbers[i]) * numbers[i];
    return std::abs(std::sqrt(square) - 1.0) < kTolerance;
  }
  int in_a_row_ = 0;  // of the other order
  bool is_little_ = false;
  bool has_news_ = false;
};

/// The name and the pose that many of VMC's messages begin with.
struct NamedPose {
  std::string_view name;
  glm::dvec3 position_m{0.0};
  Pose pose;
};
std::optional<NamedPose> take_pose(OscArguments& arguments, FloatOrder& order) {
  NamedPose named;
  named.name = arguments.take_string().value_or("");
  PoseFloats value{};
  for (float& number : value) number = arguments.take_float().value_or(0.0f);
  if (!arguments.ok()) return std::nullopt;
  order.judge(value);
  if (order.is_little()) value = turned_round(value);
  named.position_m = {value[0], value[1], value[2]};
  named.pose =
      pose_from_unity(named.position_m, unit_or_nan(quaternion_of({value[3], value[4], value[5], value[6]})));
  return named;
}

/// What a performer told of the body so far. A frame of it is spread over several datagrams or messages, and
/// nothing says where it ends: with the last of the bones that frames had, or before a bone that comes again,
/// or before the root or the hips, with which senders begin.
class VmcBody {
 public:
  explicit VmcBody(bool ignores_zero_positions) : ignores_zero_positions_(ignores_zero_positions) {}

  std::optional<int64_t> time_ns;  // newest that was told

  /// Whether bones come, and no head among them.
  bool lacks_head() const { return headless_frames_ >= kForgottenAfterFrames; }

  /// A bone; where it begins another frame, what the frame before has not told yet.
  void set(size_t bone, const NamedPose& named, std::vector<LivePose>& poses) {
    const bool begins = bone == kRoot || (bone == kHips && (seen_ & bit_of(kRoot)) == 0);
    if ((seen_ & bit_of(bone)) != 0 || (begins && seen_ != 0)) {
      tell(bone_time_ns_, poses);
      end_frame();
    }
    local_[bone] = named.pose;
    if (ignores_zero_positions_ && named.position_m == glm::dvec3(0.0))
      local_[bone].position_m = kBones[bone].bind_m;
    bone_time_ns_ = time_ns;
    seen_ |= bit_of(bone);
    known_ |= bit_of(bone);
    has_news_ = true;
  }

  /// At a datagram's end: the frame, where it is whole, or where nobody knows yet what a whole one has.
  void end_datagram(bool is_bundle, std::vector<LivePose>& poses) {
    const bool is_first = expected_ == 0;
    const bool is_whole =
        is_first ? is_bundle && (seen_ & bit_of(kHead)) != 0 : (seen_ & expected_) == expected_;
    if (is_whole) tell(time_ns, poses);
  }

 private:
  /// Of one moment the newest is told: a datagram may end one frame and hold another.
  void tell(const std::optional<int64_t>& at_ns, std::vector<LivePose>& poses) {
    if (!has_news_ || (known_ & bit_of(kHead)) == 0) return;
    has_news_ = false;
    if (at_ns)
      std::erase_if(poses, [&](const LivePose& p) { return p.subject.empty() && p.source_time_ns == at_ns; });
    std::array<Pose, kBoneCount> world;
    for (size_t bone = 0; bone < kBoneCount; ++bone) {
      const Pose parent = kBones[bone].parent == kNoParent ? Pose{} : world[kBones[bone].parent];
      world[bone] = (known_ & bit_of(bone)) != 0 ? parent * local_[bone] : parent;
    }
    LivePose& pose = poses.emplace_back();
    pose.world_from_subject = world[kHead];
    pose.has_position = (known_ & (bit_of(kRoot) | bit_of(kHips))) != 0;
    pose.source_time_ns = at_ns;
    const auto add_joint = [&](const char* name, size_t bone) {
      if ((known_ & bit_of(bone)) == 0) return;
      pose.joint_names.emplace_back(name);
      pose.joint_m.push_back(world[bone].position_m);
    };
    add_joint(kNeckJoint, kNeck);
    add_joint(kChestJoint, (known_ & bit_of(kUpperChest)) != 0 ? kUpperChest : kChest);
    add_joint(kLeftShoulderJoint, kLeftUpperArm);
    add_joint(kRightShoulderJoint, kRightUpperArm);
    add_joint(kLeftElbowJoint, kLeftLowerArm);
    add_joint(kRightElbowJoint, kRightLowerArm);
  }

  /// Learns what a whole frame has.
  void end_frame() {
    headless_frames_ = (seen_ & bit_of(kHead)) != 0 ? 0 : headless_frames_ + 1;
    // A head that is told no more is lost, however its body moves.
    if (lacks_head()) known_ &= ~bit_of(kHead);
    lately_ |= seen_;
    if ((seen_ & expected_) == expected_) {
      expected_ |= seen_;
      short_frames_ = 0;
      lately_ = 0;
    } else if (++short_frames_ >= kForgottenAfterFrames) {
      expected_ = lately_;
      short_frames_ = 0;
      lately_ = 0;
    }
    seen_ = 0;
  }

  bool ignores_zero_positions_;
  std::array<Pose, kBoneCount> local_;
  int headless_frames_ = 0;              // in a row
  BoneSet known_ = 0;                    // ever
  BoneSet seen_ = 0;                     // of the frame that is coming in
  bool has_news_ = false;                // that no pose tells
  std::optional<int64_t> bone_time_ns_;  // of the newest bone
  BoneSet expected_ = 0;                 // of a whole frame
  BoneSet lately_ = 0;                   // of the frames since the last whole one
  int short_frames_ = 0;
};

/// Times that are told on: fewer may be of floats whose order is not known yet.
constexpr int kCoarseTimes = 10;

/// A slate as text or number, and a take as a number of either kind that counts.
std::optional<LiveTake> take_of_start(const OscMessage& message) {
  constexpr float kMostFloatCount = 1 << 24;
  LiveTake take;
  OscArguments arguments(message);
  if (message.tags.starts_with('i'))
    take.slate = fmt::format("{}", arguments.take_int().value_or(0));
  else if (!message.tags.empty())
    take.slate = arguments.take_string().value_or("");
  if (message.tags.size() > 1 && message.tags[1] == 'f') {
    const float number = arguments.take_float().value_or(0.0f);
    if (!(number >= 0.0f && number < kMostFloatCount && number == std::floor(number))) return std::nullopt;
    take.take = static_cast<uint32_t>(number);
  } else if (message.tags.size() > 1) {
    take.take = static_cast<uint32_t>(std::max(arguments.take_int().value_or(0), 0));
  }
  return arguments.ok() ? std::optional(std::move(take)) : std::nullopt;
}

class VmcParser : public LiveParser {
 public:
  explicit VmcParser(const LiveParserConfig& config)
      : limit_bytes_(std::min(config.max_datagram_bytes, kMaxDatagramBytes)),
        body_(config.ignores_zero_positions) {}

  Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t) override {
    ASSIGN_OR_RETURN(const OscPacket osc, read_osc(bytes, limit_bytes_));
    last_.assign(bytes.begin(), bytes.end());
    ignored_ += osc.unknown_tags;
    LivePacket packet;
    for (const OscMessage& message : osc.messages)
      if (!apply(message, packet)) ++ignored_;
    body_.end_datagram(osc.is_bundle, packet.poses);
    if (order_.take_news())
      notes_.push_back(fmt::format("the sender's floats are {}-endian, and are read so",
                                   order_.is_little() ? "little" : "big"));
    if (body_.lacks_head() && !std::exchange(has_told_headless_, true))
      notes_.emplace_back("the sender tells bones, and no Head among them: the head rests until it does");
    if (!body_.lacks_head()) has_told_headless_ = false;
    return packet;
  }

  std::optional<LiveTake> take_of(std::span<const std::byte> bytes) const override {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (text.find(kRecordAddress) == std::string_view::npos) return std::nullopt;
    const auto osc = read_osc(bytes, limit_bytes_);
    if (!osc) return std::nullopt;
    for (const OscMessage& message : osc->messages) {
      if (!message.address.starts_with(kRecordAddress)) continue;
      const std::string_view what = message.address.substr(kRecordAddress.size());
      if (what == "stop") return LiveTake{false, {}, 0};
      if (what != "start") continue;
      if (auto take = take_of_start(message)) return take;
    }
    return std::nullopt;
  }

  std::string unknown_command_of(std::span<const std::byte> bytes) const override {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (text.find(kOwnAddress) == std::string_view::npos) return {};
    const auto osc = read_osc(bytes, limit_bytes_);
    if (!osc || osc->messages.empty()) return {};
    for (const OscMessage& message : osc->messages)
      if (!message.address.starts_with(kOwnAddress) || is_own_command(message.address)) return {};
    return fmt::format("{}, and there is no such command; there are {}",
                       one_line(osc->messages.front().address, kMaxSubjectBytes),
                       fmt::join(kOwnCommands, ", "));
  }

  uint64_t ignored() const override { return ignored_; }
  std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

  std::vector<std::string> describe() const override { return describe_osc(last_, limit_bytes_); }

 private:
  /// False for a message that is not known, or has other arguments than its address asks for.
  bool apply(const OscMessage& message, LivePacket& packet) {
    OscArguments arguments(message);
    const std::string_view address = message.address;
    if (address == "/VMC/Ext/Bone/Pos") return apply_bone(arguments, packet);
    if (address == "/VMC/Ext/Root/Pos") {
      const auto root = take_pose(arguments, order_);
      if (root) body_.set(kRoot, *root, packet.poses);
      return root.has_value();
    }
    if (address == "/VMC/Ext/Hmd/Pos" || address == "/VMC/Ext/Con/Pos" || address == "/VMC/Ext/Tra/Pos")
      return apply_device(arguments, packet);
    if (address == "/VMC/Ext/T") {
      const auto time_s = arguments.take_float();
      if (time_s) take_time(order_.is_little() ? turned_round(*time_s) : *time_s);
      return time_s.has_value();
    }
    if (address == "/strandcast/wind") return apply_wind(arguments, packet);
    if (address.starts_with(kVrchatTrackers) && !std::exchange(has_told_vrchat_, true))
      notes_.emplace_back("the sender tells trackers as to VRChat's OSC: --mocap vrchat:PORT takes them");
    if (address.starts_with(kRecordAddress) && !std::exchange(has_told_start_, true))
      notes_.push_back(
          fmt::format("{} is not understood: start takes a slate (text) and a take (a number), "
                      "stop takes nothing",
                      to_line(message)));
    // Faces, cameras, lights, devices in another scale: known, and of no use here.
    return address.starts_with(kVmcAddresses);
  }

  /// A time is a float: what has run for long, or tells the time of day, has steps that are too large.
  void take_time(float time_s) {
    const auto fine_s = fine_seconds(time_s);
    body_.time_ns = fine_s ? nanoseconds_of(*fine_s) : std::nullopt;
    coarse_times_ = fine_s || !std::isfinite(time_s) ? 0 : coarse_times_ + 1;
    if (coarse_times_ < kCoarseTimes || std::exchange(has_told_steps_, true)) return;
    notes_.push_back(
        fmt::format("the sender's time is {:.0f} s, of which a float tells no steps below {:g} ms: times of "
                    "arrival are used",
                    time_s, kCoarsestTimeS * kMsPerS));
  }

  bool apply_bone(OscArguments& arguments, LivePacket& packet) {
    const auto named = take_pose(arguments, order_);
    if (!named) return false;
    for (size_t bone = kHips; bone < kBoneCount; ++bone)
      if (named->name == kBones[bone].name) body_.set(bone, *named, packet.poses);
    return true;
  }

  bool apply_device(OscArguments& arguments, LivePacket& packet) {
    const auto named = take_pose(arguments, order_);
    if (!named) return false;
    LivePose& pose = packet.poses.emplace_back();
    pose.subject = one_line(named->name, kMaxSubjectBytes);
    pose.world_from_subject = named->pose;
    pose.source_time_ns = body_.time_ns;
    return true;
  }

  bool apply_wind(OscArguments& arguments, LivePacket& packet) {
    glm::dvec3 wind_mps(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      const float value = arguments.take_float().value_or(0.0f);
      wind_mps[axis] = order_.is_little() ? turned_round(value) : value;
    }
    if (arguments.ok()) packet.wind_mps = wind_mps;
    return arguments.ok();
  }

  uint32_t limit_bytes_;
  VmcBody body_;
  FloatOrder order_;
  int coarse_times_ = 0;  // in a row
  bool has_told_steps_ = false;
  bool has_told_headless_ = false;
  bool has_told_start_ = false;
  bool has_told_vrchat_ = false;
  std::vector<std::string> notes_;
  std::vector<std::byte> last_;
  uint64_t ignored_ = 0;
};

}  // namespace

std::unique_ptr<LiveParser> make_vmc_parser(const LiveParserConfig& config) {
  return std::make_unique<VmcParser>(config);
}

}  // namespace strandcast
