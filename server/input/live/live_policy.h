// LivePolicy: what becomes of the poses of the one subject that drives the head before the hair sees them;
// the same for every protocol. Pure logic without a clock; one thread at a time.
//
// * Refused and counted: poses that are no numbers, no rotation or out of the world.
// * Order: a pose whose number says that one before it is missing waits for that one, kResequenceNs at most,
//   while no more than kResequenceFrames wait. So do poses of a steady source that only has times. What comes
//   twice or later than that is left out. Poses without either are taken as they come.
// * A body that is kGateJumpM away at once is believed when it stays there for kGatePoses and kGateNs; else
// it
//   was another one, or its markers were mixed up. Until then nothing came. What is believed is a jump, which
//   hair is carried through.
// * Nothing is faster than kMaxLiveSpeedMps and kMaxLiveTurnRadPerS, bursts of kClampWindowNs aside: the head
//   comes after.
// * Loss: the newest pose is held for kHoldNs; then the head goes on by what it would have moved in
//   kExtrapolateNs, eased in and out over kEaseNs, and rests where it is. After kMotionStaleNs (input_hub.h)
//   it is stale. What comes then is believed wherever it is.
// * Both signs of a quaternion are one rotation: the nearer one is taken.
// * A calibrated head is at rest, at the origin, where it was then: what the tracker is tilted by on the head
//   and where the performer faced are taken out.
#pragma once

#include <cstdint>
#include <deque>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/math/pose.h"
#include "server/input/clock_map.h"
#include "server/input/live/live_packet.h"

namespace strandcast {

inline constexpr double kMaxLiveSpeedMps = 10.0;
inline constexpr double kMaxLiveTurnRadPerS = 25.0;
inline constexpr int64_t kClampWindowNs = 25'000'000;
inline constexpr double kGateJumpM = 0.75;
inline constexpr uint32_t kGatePoses = 5;
inline constexpr int64_t kGateNs = 100'000'000;
inline constexpr size_t kResequenceFrames = 3;
inline constexpr int64_t kResequenceNs = 20'000'000;
inline constexpr int64_t kHoldNs = 100'000'000;
inline constexpr int64_t kExtrapolateNs = 50'000'000;
inline constexpr int64_t kEaseNs = 250'000'000;
/// From kHoldNs on the head is told so often, so that what comes then cannot move it by the whole gap at
/// once.
inline constexpr int64_t kRestingPoseNs = 10'000'000;
/// Numbers of frames that are further away than this are another count.
inline constexpr int64_t kRestartFrames = 1000;
inline constexpr uint32_t kRestartPoses = 5;  // or as many in a row that are late

struct LivePolicyCounters {
  uint64_t impossible = 0;   // no numbers, no rotation, out of the world
  uint64_t clamped = 0;      // faster than a head
  uint64_t gated = 0;        // not believed
  uint64_t resequenced = 0;  // waited for one before, which came
  uint64_t late = 0;         // twice, or too late
  uint64_t lost = 0;         // numbers that never came
};

/// The head at a time of the server's clock.
struct LiveHead {
  int64_t time_ns = 0;
  Pose world_from_head;
  std::vector<std::string> joint_names = {};  // of the body below it
  std::vector<glm::vec3> joint_m = {};        // of each; head space
};

class LivePolicy {
 public:
  /// `turns_only`: poses have no place.
  explicit LivePolicy(bool turns_only = false) : turns_only_(turns_only) {}

  /// A pose of the subject; `arrival_ns` is the server's clock and never decreases.
  void take(const LivePose& pose, int64_t arrival_ns);
  /// What the head does, in order of time, up to `now_ns`: after each take(), and every few milliseconds.
  std::vector<LiveHead> advance(int64_t now_ns);

  /// Another subject, or another sender: its first pose is believed wherever it is.
  void begin_another();
  /// What is seen is the head at rest from now on; false when nothing is seen.
  bool calibrate(int64_t now_ns);
  /// Undoes it.
  void reset_calibration();

  bool is_calibrated() const { return calibration_.has_value(); }
  /// No pose for kMotionStaleNs, or never one.
  bool is_stale(int64_t now_ns) const;
  const LivePolicyCounters& counters() const { return counters_; }

 private:
  struct Waiting {
    LivePose pose;
    int64_t arrival_ns = 0;
  };
  /// How a calibrated pose differs from the one that was seen: rotation = from_stage * seen * from_mount.
  struct Calibration {
    glm::dquat from_stage, from_mount;
    glm::dvec3 origin_m;
  };

  void order(const LivePose& pose, int64_t arrival_ns);
  std::optional<int64_t> places_ahead(const LivePose& pose) const;
  bool is_late(const LivePose& pose);
  void insert(const LivePose& pose, int64_t arrival_ns);
  void release_ready();
  void release_first();
  void release(const LivePose& pose, int64_t arrival_ns);
  void note_order(const LivePose& pose);
  void forget_order();
  bool is_believed(const LivePose& pose, int64_t arrival_ns);
  int64_t time_of(const LivePose& pose, int64_t arrival_ns);
  Pose head_of(const LivePose& pose) const;
  void add_joints(const LivePose& pose, LiveHead& head) const;
  Pose clamped(const Pose& target, int64_t time_ns);
  void put(LiveHead head);
  void rest(int64_t now_ns);
  Pose resting_pose(int64_t age_ns) const;

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
  uint32_t steady_periods_ = 0;  // in a row
  ClockMap clock_;

  // What was believed.
  std::optional<Pose> seen_;  // the newest pose, as it came
  int64_t seen_ns_ = 0;       // its arrival
  bool jumps_ = true;         // the next one does
  std::optional<glm::dvec3> doubted_m_;
  int64_t doubted_since_ns_ = 0;
  uint32_t doubted_poses_ = 0;

  // What the head does.
  std::optional<LiveHead> last_;  // given out
  std::optional<Pose> held_;      // the newest of a pose that came
  glm::dvec3 velocity_mps_{0.0};
  glm::dvec3 turn_rad_per_s_{0.0};  // about axes of the world
  double move_allowance_m_ = 0.0;
  double turn_allowance_rad_ = 0.0;
  std::vector<LiveHead> due_;
};

}  // namespace strandcast
