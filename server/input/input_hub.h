// InputHub: merges head motion and wind from any number of network sources into one InputFrame per simulation
// step. Any thread may call any function; each holds one short lock. Does no I/O, reads no clock and never
// waits: equal calls give equal frames.
//
// Policy (the numbers are the constants below):
// * A source's clock is mapped to the server's by the fastest sample of the last 10 s (clock_map.h), so that
//   network jitter does not reach the hair. A source clock that steps by more than kClockJumpNs starts a new
//   mapping.
// * One source at a time drives the head, and one the wind. It is the first that sends a valid sample, until
//   it is removed or silent for kMotionStaleNs / kWindStaleNs. Meanwhile samples of others are refused.
// * Between two samples the pose is interpolated (lerp, slerp). If no sample is later, the newest is held, so
//   that live feeding adds no delay. Samples that arrive unevenly are shown as late as the latest of the last
//   seconds (kSteadyShrink), so that the head's speed does not jump from frame to frame. Where samples are
//   later than that, the head slows to rest, and eases back once they come (head_easing.h). Without motion
//   for kMotionStaleNs the frame is marked stale. Without wind for kWindStaleNs the scene's own wind returns.
// * Refused and counted: samples not newer than the newest one used, duplicates, impossible values, more than
//   kMaxSampleRateHz per source and kind, more than kMaxInputSources sources. Buffers are bounded; the oldest
//   samples are dropped first.
// * A source that slows its motion to match a slow simulation reports its rate; the frame holds the last
//   reported one.
// * Joints of the body come with the head's samples and have the same owner and times. They are interpolated
//   if both samples name the same joints, but never across a jump of the head.
// * A jump beyond kTeleportSpeedMps or kTeleportTurnRadPerS between samples or frames is carried out in one
//   frame, flagged as a teleport and never interpolated.
// * Three changes are teleports however short they are. One is the first pose of another source, or of one
//   whose clock stepped. Another is the first frame without the source that drove the head: it shows the last
//   pose that came. The third is the return of a source that was silent: the frame then advances by more than
//   kCatchUpNs beyond the elapsed time, and by more than kCatchUpSpacings of the usual sample spacing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "common/wire/messages.h"
#include "common/wire/sample_limits.h"
#include "server/input/clock_map.h"
#include "server/input/head_easing.h"
#include "server/input/held_inputs.h"
#include "server/input/input_frame.h"
#include "server/input/timecode_clock.h"

namespace strandcast {

/// First source id of live inputs among the sources of motion; session ids count from 1.
inline constexpr uint64_t kFirstLiveSourceId = uint64_t{1} << 63;
inline constexpr size_t kMaxBufferedSamples = 1024;

template <class Value>
struct TimedSample {
  int64_t time_ns = 0;     // source clock
  int64_t arrival_ns = 0;  // server clock
  Value value{};
};

enum class InsertOutcome { Accepted, Late, Duplicate };

template <class Value>
class SampleTrack {
 public:
  using Sample = TimedSample<Value>;

  /// Inserts a sample in time order. Late: not newer than the newest sample already used. At most
  /// kMaxBufferedSamples are kept; the oldest is dropped first.
  InsertOutcome insert(const Sample& sample) {
    if (sample.time_ns <= newest_used_ns_)
      return sample.time_ns == newest_used_ns_ ? InsertOutcome::Duplicate : InsertOutcome::Late;
    size_t place = samples_.size();
    while (place > 0 && samples_[place - 1].time_ns >= sample.time_ns) {
      if (samples_[place - 1].time_ns == sample.time_ns) return InsertOutcome::Duplicate;
      --place;
    }
    samples_.insert(samples_.begin() + static_cast<std::ptrdiff_t>(place), sample);
    if (samples_.size() > kMaxBufferedSamples) {
      samples_.pop_front();
      ++dropped_;
    }
    return InsertOutcome::Accepted;
  }

  /// Returns the index of the last sample at or before `time_ns`, or 0 if all are later. The track must not
  /// be empty.
  size_t index_at(int64_t time_ns) const {
    size_t index = samples_.size() - 1;
    while (index > 0 && samples_[index].time_ns > time_ns) --index;
    return index;
  }

  /// Marks everything up to index `newest` as used and drops what is older than index `oldest`.
  void use(size_t oldest, size_t newest) {
    if (samples_[newest].time_ns > newest_used_ns_) newest_used_ns_ = samples_[newest].time_ns;
    samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(oldest));
  }

  void clear() {
    samples_.clear();
    newest_used_ns_ = std::numeric_limits<int64_t>::min();
  }

  const std::deque<Sample>& samples() const { return samples_; }
  uint64_t dropped() const { return dropped_; }

 private:
  std::deque<Sample> samples_;
  int64_t newest_used_ns_ = std::numeric_limits<int64_t>::min();
  uint64_t dropped_ = 0;
};

inline constexpr int64_t kMotionStaleNs = 1'000'000'000;
inline constexpr int64_t kWindStaleNs = 3'000'000'000;
inline constexpr int64_t kClockJumpNs = 1'000'000'000;
inline constexpr int64_t kMaxSampleTimeNs = int64_t{1} << 61;  // 73 years either way: no difference overflows
inline constexpr double kMaxWindStreamMps = 200.0;
inline constexpr double kTeleportSpeedMps = 50.0;
inline constexpr double kTeleportTurnRadPerS = 100.0;
inline constexpr double kTeleportShortestS = 1e-3;  // closer samples count as this far apart
inline constexpr double kTeleportLongestS = 0.1;    // a pause between frames is not time to travel in
inline constexpr int64_t kCatchUpNs = 40'000'000;  // of motion that is shown in one frame, beyond the frame's
inline constexpr double kCatchUpSpacings = 3.0;
/// Lateness that is made up for at most, in time and in usual sample spacings; what is later was held up.
inline constexpr int64_t kMostSteadiedNs = 50'000'000;
inline constexpr double kMostSteadiedSpacings = 1.5;
inline constexpr double kUnseenLateNs = 1e6;    // less makes no head's speed uneven
inline constexpr double kSteadyShrink = 0.002;  // of the passing time by which a delay shrinks again
inline constexpr double kMaxSampleRateHz = 1000.0;
inline constexpr double kMaxSampleBurst = 1000.0;  // samples at once, after a second of silence
inline constexpr size_t kMaxInputSources = 64;
inline constexpr size_t kKeptSourceTimes = 1024;  // of the newest samples that were used

/// Counts of samples since the start, by what happened to them.
struct InputCounters {
  uint64_t accepted = 0;
  uint64_t late = 0;
  uint64_t duplicate = 0;
  uint64_t impossible = 0;
  uint64_t over_rate = 0;
  uint64_t not_owner = 0;       // another source drives the head or the wind
  uint64_t dropped_oldest = 0;  // accepted, but pushed out of a full buffer
  uint64_t clock_restarts = 0;
  uint64_t teleports = 0;  // frames flagged

  uint64_t rejected() const { return late + duplicate + impossible + over_rate + not_owner; }
};

/// Content of a sample: the head's pose, and joints of the body below it.
struct HeadSample {
  Pose pose;
  std::shared_ptr<const std::vector<std::string>> joint_names;  // of one message; null = none
  std::vector<glm::vec3> joint_m = {};                          // head space
  std::optional<Timecode> timecode = {};
};

class InputHub {
 public:
  /// Makes samples wait for their simulated time (held_inputs.h); sample() then takes simulated times. Call
  /// it before all else.
  void hold_samples();

  /// Takes the samples of one message. `source_id` is the session's; `arrival_ns` is the server clock when it
  /// was read. Returns a sentence for a source of whose samples one is left out for the first time; else
  /// empty.
  std::string push(uint64_t source_id, const MotionSamples& samples, int64_t arrival_ns);
  std::string push(uint64_t source_id, const WindSamples& samples, int64_t arrival_ns);
  /// Takes a timecode that comes without motion. It is shown while the head's motion has none of its own.
  void push(const Timecode& timecode, int64_t arrival_ns);

  /// Delays a source's head motion by `delay_ns`, so that samples exist before and after each used time.
  /// Initially 0; lasts until the next call.
  void set_delay(uint64_t source_id, int64_t delay_ns);

  /// Removes a source. The head goes to its last pose (stale at once); the scene's own wind returns.
  void remove_source(uint64_t source_id);

  /// Returns the inputs at a server time, for one simulation step. `motion_time_ns` is the server clock at
  /// the arrival of the newest motion sample used, so that viewers can tell its age.
  InputFrame sample(int64_t server_time_ns);

  /// Returns when the used sample with this arrival time was made (the newest of several), on the server's
  /// clock. It is late by the delay of the source's fastest sample. 0 = not known, or too long ago.
  int64_t source_time_ns(int64_t arrival_ns) const;

  InputCounters counters() const;

 private:
  /// Samples that a source may still send: a token bucket that fills at kMaxSampleRateHz.
  struct Allowance {
    double samples = kMaxSampleBurst;
    int64_t updated_ns = 0;
  };

  template <class Value>
  struct Stream {
    std::optional<uint64_t> owner;
    int64_t accepted_ns = 0;        // arrival of the newest accepted sample
    bool is_cut = false;            // what is shown next does not follow what was
    double usual_spacing_ns = 0.0;  // between samples, by the source's clock; 0: not known
    double usual_wait_ns = 0.0;     // between their arrivals, likewise; what comes at once counts once
    ClockMap clock;
    SampleTrack<Value> track;
    std::map<uint64_t, Allowance> allowances;  // by source
  };

  template <class Value>
  void accept(Stream<Value>& stream, uint64_t source_id, const TimedSample<Value>& sample, int64_t stale_ns);
  template <class Value>
  bool take_allowance(Stream<Value>& stream, uint64_t source_id, int64_t arrival_ns);
  template <class Value>
  void forget(Stream<Value>& stream, uint64_t source_id);
  void forget(uint64_t source_id);
  template <class Value>
  void restart(Stream<Value>& stream);
  template <class Value>
  void note_spacing(Stream<Value>& stream);
  /// What its source says of the head at a time.
  struct SeenHead {
    Pose pose;
    int64_t time_ns = 0;         // of the pose, by its source's clock
    bool is_silent = false;      // nothing of this time
    bool is_absent = false;      // there is no source
    bool has_jumped = false;     // strands are carried there
    bool has_caught_up = false;  // of more motion than time passed
  };
  SeenHead see_head(int64_t server_time_ns);
  bool is_silent(int64_t time_ns, int64_t delay_ns) const;
  void show_head(const SeenHead& seen, int64_t server_time_ns);
  int64_t steadied_ns(int64_t time_ns, int64_t server_time_ns);
  bool has_caught_up(int64_t shown_ns, int64_t server_time_ns);
  void tell_refusal(uint64_t source_id, const std::string& why);
  void note_used(int64_t arrival_ns, int64_t made_ns);

  void take(uint64_t source_id, const MotionSamples& samples, int64_t arrival_ns);
  void take(uint64_t source_id, const WindSamples& samples, int64_t arrival_ns);
  void take_held(int64_t time_ns);

  mutable std::mutex mutex_;
  std::set<uint64_t> told_refusals_;  // sources that know it, at most kMaxInputSources
  std::string refusal_;               // to be told by push()
  std::optional<HeldInputs> held_;    // none: samples are for the time when they arrive
  Stream<HeadSample> motion_;
  Stream<glm::dvec3> wind_;
  std::map<uint64_t, int64_t> delays_ns_;  // of motion, by source; those that are not 0
  struct UsedSample {
    int64_t arrival_ns = 0;
    int64_t made_ns = 0;  // both of the server's clock
  };
  std::deque<UsedSample> used_samples_;  // of motion, oldest first
  int64_t newest_arrival_ns_ = 0;
  std::optional<int64_t> last_frame_ns_;
  std::optional<int64_t> shown_ns_;  // time of the head's source that the last frame shows
  HeadEasing easing_;
  int64_t heard_ns_ = 0;                    // SeenHead::time_ns of the last that was not silent
  double absent_s_ = 0.0;                   // without a source, until now
  std::optional<Timecode> heard_timecode_;  // likewise
  double steady_delay_ns_ = 0.0;            // by which uneven samples are shown later
  bool has_left_ = false;                   // the source that drove the head, since the last frame
  std::optional<HeadSample> unseen_;        // its last, where no frame has shown that
  double motion_speed_ = 1.0;               // as the owner said last
  TimecodeClock timecodes_;                 // that came without motion
  InputFrame frame_;                        // the last one given out
  InputCounters counters_;
};

}  // namespace strandcast
