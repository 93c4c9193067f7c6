// ModePolicy: chooses strands or pictures for one viewer. From measurements it predicts how many different
// pictures per second the person would see, and how late. It takes the better mode, with hysteresis and a
// minimum dwell time. Pure logic on given times: no clock, no I/O, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/wire/messages.h"
#include "server/encode/frame_worker.h"
#include "server/net/net_server.h"

namespace strandcast {

/// Rate beyond which more different pictures per second have no value.
inline constexpr double kMostUsefulHz = 60.0;
/// Delay at which a picture has half the value of one without delay.
inline constexpr double kHalfWorthMs = 250.0;
/// Factor by which pictures must be better than strands to be chosen. Strands need only be as good, because
/// every viewer shares them and turning the view needs no server.
inline constexpr double kFramesGain = 1.5;
/// The same factor while the picture costs of a server without a GPU are only guessed. Such a server may be
/// as busy as the viewer, and a change made on a wrong guess would be undone.
inline constexpr double kGuessedFramesGain = 8.0;
/// Time for which the other mode must look better without interruption.
inline constexpr int64_t kWishNs = 1'000'000'000;
/// Shortest time between two changes; it doubles if a change is undone within twice that time.
inline constexpr int64_t kFirstDwellNs = 5'000'000'000;
inline constexpr int64_t kLongestDwellNs = 80'000'000'000;

/// Measurements that decide; a number that is 0 is unknown and limits nothing.
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

/// Where those come from.
struct ModeSources {
  const std::vector<StrandClass>& strand_classes;
  const LinkState& link;
  ViewerReport report;
  FrameCounters pictures;
  std::string paint_trouble;      // why no pictures can be drawn; empty = they can
  bool is_software = false;       // the server draws on processor cores
  RenderSize picture_size;        // of this viewer
  size_t view_count = 1;          // that the server would draw, this viewer's included
  double picture_rate_hz = 15.0;  // at most
};

/// Guesses used before the first picture: time to draw it per pixel, and its bytes, both measured with the
/// built-in scene.
inline constexpr double kGuessedSoftwareMsPerPixel = 60.0 / (640.0 * 360.0);
inline constexpr double kGuessedHardwareMs = 10.0;
inline constexpr double kGuessedBytesPerPixel = 0.15;

/// Gathers the facts, with guesses for what nobody has measured yet.
ModeFacts gather_mode_facts(const ModeSources& sources);

/// Prediction of what a person would see in one mode.
struct ModePrediction {
  enum class Limit { Stream, Link, Viewer, Server };
  double rate_hz = 0.0;
  double latency_ms = 0.0;
  Limit limit = Limit::Stream;  // of the rate
  size_t strand_class = 0;      // the one the link can take, or the last

  /// Returns useful pictures per second, weighted by lateness.
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
  /// Returns the best mode, which may be the present one; call it often. A change counts only after
  /// note_change().
  ModeChoice choose(StreamMode present, const ModeFacts& facts, int64_t time_ns);
  /// Notes that the mode was changed, by this policy or otherwise.
  void note_change(int64_t time_ns);
  /// Notes that a choice could not be carried out.
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
