// ClassChoice: chooses the class of frames that fits a viewer's link and its decoding. It changes to a
// cheaper class on trouble that this can cure. It tries the next better class after a quiet time, which grows
// with every failed try. Plain logic on given times, no I/O and no clock; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>

#include "common/base/units.h"
#include "server/net/link_estimate.h"

namespace strandcast {

/// Window of queue delays; if all of them exceed kHighDelayNs, that is trouble.
inline constexpr int64_t kDelayWindowNs = 500 * kMsInNs;
inline constexpr size_t kMinDelaySamples = 3;
/// Number of lost chains within kLossWindowNs that counts as trouble.
inline constexpr size_t kTroublingLosses = 2;
inline constexpr int64_t kLossWindowNs = 2'000 * kMsInNs;
/// Largest shares of the measured capacity that a class may take: on average, and while strands move as
/// quickly as they did once in kDemandWindowNs.
inline constexpr double kUsableShare = 0.85;
inline constexpr double kBurstShare = 1.4;
inline constexpr int64_t kDemandWindowNs = 15'000 * kMsInNs;
/// Share of the time between two frames beyond which a viewer's decoding causes their delay. A late viewer
/// below it lacks processor time, and fewer strands would not help.
inline constexpr double kBusyDecodeShare = 0.8;
/// Quiet time before a better class is tried; it doubles with every failed try of that class.
inline constexpr int64_t kFirstProbeNs = 3'000 * kMsInNs;
inline constexpr int64_t kLongestProbeNs = 60'000 * kMsInNs;
/// Time after a change to a better class in which trouble counts as a failed try.
inline constexpr int64_t kProbationNs = 5'000 * kMsInNs;

/// Returns the first class from `first` on that costs no more than is allowed, else the last; `first` if
/// `allowed_bytes_per_s` is 0 (unknown).
size_t affordable_class(size_t first, std::span<const double> costs, double allowed_bytes_per_s);

class ClassChoice {
 public:
  /// Resets the observations, because other frames follow.
  void start_over(int64_t time_ns) { quiet_since_ns_ = time_ns; }
  /// Delay of an acknowledged frame: by the link alone, and in all.
  struct Delay {
    int64_t link_ns = 0;
    int64_t all_ns = 0;
  };
  void on_delay(const Delay& delay, int64_t time_ns);
  /// Notes that a frame was dropped, so that a keyframe is needed.
  void on_chain_loss(int64_t time_ns);

  /// Present class and cost of each class, bytes/s, best first. `allowed_bytes_per_s` is the largest
  /// permitted cost, 0 = unknown.
  struct Question {
    size_t present = 0;
    std::span<const double> costs;
    double allowed_bytes_per_s = 0.0;
    double cap_bytes_per_s = 0.0;  // 0 = none
    bool has_acks = true;          // without them the class stays, but for the first one
    /// Decoding time of each class on this viewer, relative to the time between two frames; empty = unknown.
    std::span<const double> decode_shares = {};
  };
  /// Returns the first class to use, by what is known of the link; what that excludes is seldom tried.
  size_t begin(const Question& question, int64_t time_ns);
  /// Returns the class to use and notes it as the present one.
  size_t choose(const Question& question, int64_t time_ns);
  /// Returns whether a better class is being tried.
  bool is_trying(int64_t time_ns) const;

 private:
  size_t choose_lower(const Question& question, int64_t time_ns);
  size_t choose_better(const Question& question, int64_t time_ns);
  bool has_failed_try(int64_t time_ns) const;
  void note_demand(double cost, int64_t time_ns);
  bool is_troubled(const Question& question, int64_t time_ns) const;
  bool has_standing_delay(const Question& question) const;
  void change(size_t from, size_t to, int64_t time_ns);

  struct TimedDelay {
    int64_t time_ns = 0;
    Delay delay;
  };
  std::deque<TimedDelay> delays_;   // of the last kDelayWindowNs
  std::deque<TimedValue> demands_;  // decreasing maxima: what the next better class would have cost
  std::deque<int64_t> losses_ns_;
  int64_t quiet_since_ns_ = 0;  // the last trouble or change
  int64_t improved_ns_ = 0;     // the last change, if it was for the better
  int64_t probe_ns_ = kFirstProbeNs;
  size_t failed_class_ = 0;  // that was too much, seen or tried last; probe_ns_ is for it and for better ones
};

}  // namespace strandcast
