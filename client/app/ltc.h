// LtcDecoder: reads linear timecode (SMPTE ST 12-1, biphase mark) from the samples of a sound. Pure logic;
// one thread. Tape may run backwards.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <istream>
#include <optional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/base/timecode.h"

namespace strandcast {

/// A frame of linear timecode.
struct LtcFrame {
  Timecode timecode;
  double end_s = 0.0;         // of its word since the first sample: the next frame begins here
  bool is_backwards = false;  // the word ends with its own beginning, and the frame before follows
  bool has_drop_flag = false;

  /// Returns the timecode so long after the word's end.
  Timecode after(double passed_s) const {
    const double frames = passed_s * timecode.rate.hz();
    return advanced(timecode, is_backwards ? -frames : 1.0 + frames);
  }
};

class LtcDecoder {
 public:
  /// Makes a decoder for samples at `sample_rate_hz`; the words do not tell their `fps`. The tape's speed may
  /// differ from `speed` by a fifth at first.
  LtcDecoder(double sample_rate_hz, const FrameRate& fps, double speed = 1.0);

  /// Reads further samples, and returns the newest frame that ended within them. Words that are no time of
  /// day are left out.
  std::optional<LtcFrame> add(std::span<const float> samples);
  /// Counts words from the next one on as frames of another rate.
  void set_fps(const FrameRate& fps) { fps_ = fps; }

 private:
  void note_edge(double at);
  void note_bit(bool bit, double at);

  const double sample_rate_hz_;
  FrameRate fps_;
  double bit_samples_ = 0.0;  // length of a bit, as it was of late
  double level_ = 0.0;        // of the loudest samples, as it was of late
  bool is_high_ = false;
  float last_ = 0.0f;
  uint64_t sample_count_ = 0;
  double edge_at_ = 0.0;         // of the newest edge, in samples
  bool has_half_ = false;        // the first edge of a 1 was there
  std::array<bool, 80> bits_{};  // the newest ones, a ring
  size_t bit_count_ = 0;
  std::optional<LtcFrame> newest_;
};

/// How many frames a second linear timecode counts, by the time from one to the next.
class LtcRateMeter {
 public:
  void add(const LtcFrame& frame);
  /// Returns the number of pairs of neighbours so far.
  uint32_t pair_count() const { return pair_count_; }
  /// Returns frames per second as they come, at the tape's speed; call it after the first pair.
  double hz() const { return pair_count_ / sum_s_; }
  /// Returns true once the last frame of a second was seen, which tells how many there are at any speed.
  bool is_counted() const { return counted_ > 0; }
  /// Returns the rate that is counted, else the nearest; 29.97 where words say that they drop numbers.
  FrameRate rate() const;

 private:
  std::optional<LtcFrame> last_;
  double sum_s_ = 0.0;
  uint32_t pair_count_ = 0;
  uint32_t counted_ = 0;  // frames a second, whole; 0 = not yet seen
  bool drops_ = false;
};

/// The sound of a WAV file as it comes; its first channel.
class WavReader {
 public:
  /// Reads the header; `in` must outlive the reader. BadInput for what is no WAV file of whole or float
  /// numbers.
  static Result<WavReader> open(std::istream& in);

  double sample_rate_hz() const { return sample_rate_hz_; }
  /// Reads up to `samples.size()` samples within -1..1 and returns their number; 0 at the end.
  size_t read(std::span<float> samples);

 private:
  explicit WavReader(std::istream& in) : in_(&in) {}

  std::istream* in_;
  double sample_rate_hz_ = 0.0;
  uint32_t channel_count_ = 0;
  uint32_t sample_bytes_ = 0;
  bool is_float_ = false;
  uint64_t left_bytes_ = 0;
};

/// Where linear timecode is at a time since its beginning; empty before the first frame. Any thread.
using TimecodeAt = std::function<std::optional<Timecode>(double time_s)>;

/// Receives sentences for a person, on any thread.
using LtcListener = std::function<void(const std::string&)>;

/// Reads a WAV file with linear timecode, or standard input ("-") as it comes, on a thread of its own that
/// ends with the program. Without `fps` its rate is measured. BadInput or NotFound if it cannot be read; a
/// file needs one frame at least, and no other rate than `fps`.
Result<TimecodeAt> open_ltc(const std::string& path, const std::optional<FrameRate>& fps,
                            const LtcListener& listener);

}  // namespace strandcast
