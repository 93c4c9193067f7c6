// ClassChoice: which class of frames fits a viewer's link and its decoding. Down at trouble that a cheaper
// class can cure, up one class after quiet time that grows with every try that failed. Plain logic on given
// times, no I/O and no clock; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>

#include "common/base/units.h"
#include "server/net/link_estimate.h"

namespace strandcast {

/// Of queue delays: one that stays above kHighDelayNs throughout is trouble.
inline constexpr int64_t kDelayWindowNs = 500 * kMsInNs;
inline constexpr size_t kMinDelaySamples = 3;
/// Lost chains that count as trouble when they fall within kLossWindowNs.
inline constexpr size_t kTroublingLosses = 2;
inline constexpr int64_t kLossWindowNs = 2'000 * kMsInNs;
/// Share of the measured capacity that a class may take on average, and at most while the strands move
/// quickly, as they did once in kDemandWindowNs.
inline constexpr double kUsableShare = 0.85;
inline constexpr double kBurstShare = 1.4;
inline constexpr int64_t kDemandWindowNs = 15'000 * kMsInNs;
/// A viewer that decodes for so much of the time between two frames is what they wait for. One that does not
/// and is late all the same lacks its processor: fewer strands would not help it.
inline constexpr double kBusyDecodeShare = 0.8;
/// Quiet time before a better class is tried; before one that failed it doubles with every try.
inline constexpr int64_t kFirstProbeNs = 3'000 * kMsInNs;
inline constexpr int64_t kLongestProbeNs = 60'000 * kMsInNs;
/// Trouble this soon after a change for the better means that the try has failed.
inline constexpr int64_t kProbationNs = 5'000 * kMsInNs;

class ClassChoice {
 public:
  /// Other frames follow: what was seen of the ones before is no reason to change the class.
  void start_over(int64_t time_ns) { quiet_since_ns_ = time_ns; }
  /// How long an acknowledged frame waited, by the link alone and in all.
  struct Delay {
    int64_t link_ns = 0;
    int64_t all_ns = 0;
  };
  void on_delay(const Delay& delay, int64_t time_ns);
  /// A frame found no place, so that a keyframe is needed.
  void on_chain_loss(int64_t time_ns);

  /// The class to be in, given the present one and what each costs, bytes/s, best first;
  /// `allowed_bytes_per_s` is what a class may cost at all, 0 = unknown.
  struct Question {
    size_t present = 0;
    std::span<const double> costs;
    double allowed_bytes_per_s = 0.0;
    double cap_bytes_per_s = 0.0;  // 0 = none
    bool has_acks = true;          // without them the class stays, but for the first one
    /// Decoding of each class by this viewer, of the time between two frames; empty = unknown.
    std::span<const double> decode_shares = {};
  };
  /// Remembers a change as made.
  size_t choose(const Question& question, int64_t time_ns);
  /// A better class is on probation.
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
  size_t failed_class_ = 0;  // that was tried last and failed; probe_ns_ is for it and for better ones
};

}  // namespace strandcast
