// ModePolicy: strands or pictures for one viewer. Predicts from measured numbers how many different pictures
// per second the person would see and how late, and takes the better mode, with hysteresis and a dwell. Pure
// logic on given times: no clock, no I/O, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/wire/messages.h"

namespace strandcast {

/// More than this many different pictures per second are worth nothing.
inline constexpr double kMostUsefulHz = 60.0;
/// A picture this late is worth half of one that is not late.
inline constexpr double kHalfWorthMs = 250.0;
/// Frames must be worth so many times as much as strands; strands only as much as frames, because they need
/// no server to turn the view and every viewer shares them.
inline constexpr double kFramesGain = 1.5;
/// And so many times, about three times as fast, while what a server without a GPU takes for pictures is only
/// guessed: it may be as busy as this viewer, and a change for a guess that is wrong would be undone.
inline constexpr double kGuessedFramesGain = 8.0;
/// The other mode must look better for so long without a break.
inline constexpr int64_t kWishNs = 1'000'000'000;
/// Time between two changes; doubles when a change is undone within twice of it.
inline constexpr int64_t kFirstDwellNs = 5'000'000'000;
inline constexpr int64_t kLongestDwellNs = 80'000'000'000;

/// What is known; numbers that are 0 are unknown and limit nothing.
struct ModeFacts {
  struct StrandClassFacts {
    double bytes_per_s = 0.0;
    double rate_hz = 0.0;
  };
  std::vector<StrandClassFacts> strand_classes;  // best first, at least one
  double strand_decode_ms = 0.0;                 // at the viewer, per state
  double strand_draw_ms = 0.0;                   // at the viewer, per picture
  DrawingDevice device = DrawingDevice::Unknown;

  std::string paint_trouble;       // why the server cannot draw; empty = it can
  double paint_ms = 0.0;           // drawn and coded at the server, with its share of the other views
  bool is_paint_guessed = false;   // nobody has measured that on this processor yet
  double picture_bytes = 0.0;      // of one picture
  double picture_rate_hz = 15.0;   // at most
  double picture_decode_ms = 0.0;  // at the viewer

  double capacity_bytes_per_s = 0.0;
  double round_trip_ms = 0.0;
};

/// What a person would see.
struct ModePrediction {
  enum class Limit { Stream, Link, Viewer, Server };
  double rate_hz = 0.0;
  double latency_ms = 0.0;
  Limit limit = Limit::Stream;  // of the rate
  size_t strand_class = 0;      // the one the link can take, or the last

  /// Useful pictures per second, late ones counted for less.
  double worth() const;
};
ModePrediction predict_strands(const ModeFacts& facts);
ModePrediction predict_frames(const ModeFacts& facts);

struct ModeChoice {
  StreamMode mode = StreamMode::Strands;
  std::string reason;  // one sentence with numbers
  size_t strand_class = 0;
};

class ModePolicy {
 public:
  /// The mode to be in, which may be the present one. Call often; a choice counts as made only with
  /// note_change().
  ModeChoice choose(StreamMode present, const ModeFacts& facts, int64_t time_ns);
  /// A change of mode was made, chosen here or not.
  void note_change(int64_t time_ns);
  /// A choice could not be carried out.
  void note_failure(int64_t time_ns);
  int64_t dwell_ns() const { return dwell_ns_; }

 private:
  bool has_settled(int64_t time_ns) const { return !changed_ns_ || time_ns - *changed_ns_ >= dwell_ns_; }

  std::optional<int64_t> changed_ns_;     // or tried in vain
  std::optional<int64_t> wish_since_ns_;  // the other mode has looked better since
  int64_t dwell_ns_ = kFirstDwellNs;
  bool has_failed_ = false;
};

}  // namespace strandcast
