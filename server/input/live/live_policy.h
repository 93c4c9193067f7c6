// LivePolicy: filters the poses of the subject that drives the head before they reach the hair; the same for
// every protocol. Pure logic without a clock; one thread at a time.
//
// * Refused and counted: poses that are not finite, not a rotation, or outside the world.
// * Order: a pose whose number shows that an earlier one is missing waits for it, at most kResequenceNs and
//   while at most kResequenceFrames wait. So do poses of a steady source that has times only. Repeated and
//   later poses are dropped. Poses without number or time are used in order of arrival. So are those of a
//   source whose times stand still while its poses change.
// * A pose that is kGateJumpM away at once is accepted only if it stays there for kGatePoses and kGateNs.
//   Otherwise it was another body, or markers were confused. Until then it counts as missing. An accepted one
//   is a jump, through which hair is carried. A pose that is turned by kGateTurnRad at once, and by more than
//   kGateTurnRadPerS, is doubted alike. So are zeros that are kZerosTurnRad or kZerosJumpM away at once,
//   which a tracker sends that has lost a head, and the pose after them. When it is accepted, the head
//   is eased there over kEaseNs.
// * Speed is limited to kMaxLiveSpeedMps and kMaxLiveTurnRadPerS, except for bursts of kClampWindowNs; the
//   head then follows later.
// * Loss: nothing is given out, and the hub eases the head to rest (head_easing.h). After kMotionStaleNs
//   (input_hub.h) the subject is stale, and the next pose is accepted wherever it is: what is far away is a
//   jump.
// * Both signs of a quaternion are the same rotation; the nearer one is used.
// * Calibration makes the present pose the rest pose at the origin. It removes the tracker's tilt on the head
//   and the direction that the performer faced.
#pragma once

#include <cstdint>
#include <deque>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/math/pose.h"
#include "server/input/clock_map.h"
#include "server/input/live/live_packet.h"

namespace strandcast {

inline constexpr double kMaxLiveSpeedMps = 10.0;
inline constexpr double kMaxLiveTurnRadPerS = 25.0;
inline constexpr int64_t kClampWindowNs = 25'000'000;
inline constexpr double kGateJumpM = 0.75;
inline constexpr double kGateTurnRad = 0.6;
/// Speed of the fastest turn of a person's head: what is faster at once is doubted.
inline constexpr double kGateTurnRadPerS = 18.0;
inline constexpr double kZerosTurnRad = 0.05;
inline constexpr double kZerosJumpM = 0.02;
inline constexpr uint32_t kGatePoses = 5;
inline constexpr int64_t kGateNs = 100'000'000;
inline constexpr int64_t kEaseNs = 250'000'000;
/// A source whose poses are this late for so long has another clock than before.
inline constexpr int64_t kLateNs = 30'000'000;
inline constexpr int64_t kLateForNs = 150'000'000;
inline constexpr size_t kResequenceFrames = 3;
inline constexpr int64_t kResequenceNs = 20'000'000;
/// Frame numbers that differ by more than this belong to a new count.
inline constexpr int64_t kRestartFrames = 1000;
inline constexpr uint32_t kRestartPoses = 5;  // or as many in a row that are late
/// Number of poses of a window whose time does not advance, from which times are not used.
inline constexpr uint32_t kStalledPoses = 5;
inline constexpr uint32_t kStallWindowPoses = 100;

struct LivePolicyCounters {
  uint64_t impossible = 0;   // no numbers, no rotation, out of the world
  uint64_t clamped = 0;      // faster than a head
  uint64_t gated = 0;        // not believed
  uint64_t resequenced = 0;  // waited for one before, which came
  uint64_t late = 0;         // twice, or too late
  uint64_t lost = 0;         // numbers that never came
};

/// The head's pose at a time of the server's clock.
struct LiveHead {
  int64_t time_ns = 0;
  Pose world_from_head;
  std::vector<std::string> joint_names = {};  // of the body below it
  std::vector<glm::vec3> joint_m = {};        // of each; head space
  std::optional<Timecode> timecode = {};
};

class LivePolicy {
 public:
  /// Makes a policy; `turns_only`: poses have rotations without positions.
  explicit LivePolicy(bool turns_only = false) : turns_only_(turns_only) {}

  /// Takes a pose of the subject; `arrival_ns` is the server's clock and must not decrease.
  void take(const LivePose& pose, int64_t arrival_ns);
  /// Returns the head's poses up to `now_ns` in order of time; call it after each take(), and every few
  /// milliseconds.
  std::vector<LiveHead> advance(int64_t now_ns);

  /// Accepts the next pose wherever it is, because the subject or the sender has changed.
  void begin_another();
  /// Makes the present pose the head at rest; returns false if there is none.
  bool calibrate(int64_t now_ns);
  /// Removes the calibration.
  void reset_calibration();

  bool is_calibrated() const { return calibration_.has_value(); }
  /// Returns whether no pose came for kMotionStaleNs, or never.
  bool is_stale(int64_t now_ns) const;
  const LivePolicyCounters& counters() const { return counters_; }
  /// Returns sentences for the log since the last call: what was found of the source, and jumps.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }

 private:
  struct Waiting {
    LivePose pose;
    int64_t arrival_ns = 0;
  };
  /// Difference between a calibrated pose and the seen one: rotation = from_stage * seen * from_mount.
  struct Calibration {
    glm::dquat from_stage, from_mount;
    glm::dvec3 origin_m;
  };

  /// Offset of the head from where it is seen, which goes to nothing.
  struct Ease {
    int64_t begin_ns = 0;
    glm::dvec3 place_m{0.0};
    glm::dvec3 turn_rad{0.0};
  };

  void leave_out_stalled_time(LivePose& pose);
  void order(const LivePose& pose, int64_t arrival_ns);
  std::optional<int64_t> places_ahead(const LivePose& pose) const;
  bool is_late(const LivePose& pose);
  void insert(const LivePose& pose, int64_t arrival_ns);
  void release_ready();
  void release_first();
  void release(const LivePose& pose, int64_t arrival_ns);
  void note_order(const LivePose& pose);
  void forget_order();
  bool is_near(const LivePose& pose, const Pose& other, double most_m, double most_turn_rad) const;
  bool is_believed(const LivePose& pose, int64_t arrival_ns);
  void begin_ease(const Pose& target, int64_t time_ns);
  Pose eased(Pose target, int64_t time_ns);
  int64_t time_of(const LivePose& pose, int64_t arrival_ns);
  Pose head_of(const LivePose& pose) const;
  void add_joints(const LivePose& pose, LiveHead& head) const;
  Pose clamped(const Pose& target, int64_t time_ns);
  void put(LiveHead head);

  const bool turns_only_;
  LivePolicyCounters counters_;
  std::optional<Calibration> calibration_;

  // Order.
  std::deque<Waiting> waiting_;  // by number or time
  std::optional<uint32_t> last_frame_;
  std::optional<int64_t> last_source_ns_;
  int64_t stride_ = 1;  // from one number to the next
  int64_t last_gap_ = 0;
  uint32_t equal_gaps_ = 0;
  uint32_t late_in_a_row_ = 0;
  double period_ns_ = 0.0;       // of a source that has times only
  uint32_t steady_periods_ = 0;  // in a row, counted up to a few
  ClockMap clock_;
  int64_t timely_ns_ = 0;  // arrival of the newest pose that was not late

  // Whether times are those of the poses.
  std::optional<LivePose> told_;  // the newest that came
  uint32_t told_poses_ = 0;       // of a window, and of them those that stood still
  uint32_t stalled_poses_ = 0;
  bool has_no_times_ = false;  // that are any use

  // What was believed.
  std::optional<Pose> seen_;  // the newest pose, as it came
  int64_t seen_ns_ = 0;       // its arrival
  bool jumps_ = true;         // the next one does
  int64_t came_ns_ = 0;       // arrival of the newest in order, believed or not
  std::optional<Pose> doubted_;
  int64_t doubted_since_ns_ = 0;
  uint32_t doubted_poses_ = 0;
  bool is_lost_ = false;  // zeros were believed in the end

  // What the head does.
  std::optional<LiveHead> last_;  // given out
  double move_allowance_m_ = 0.0;
  double turn_allowance_rad_ = 0.0;
  std::optional<Ease> ease_;
  bool has_doubted_ = false;  // the next pose is far from the last one, and is eased to
  std::vector<LiveHead> due_;
  std::vector<std::string> notes_;
};

}  // namespace strandcast
