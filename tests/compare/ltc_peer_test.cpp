// Linear timecode as libltc makes it, the library of Debian's and other programs: words with its parity, at
// its rise time, forwards and backwards, read by a decoder that shares no code with it.
#include <gtest/gtest.h>
#include <ltc.h>

#include <memory>
#include <vector>

#include "client/app/ltc.h"

namespace strandcast::ltc_peer_test {
namespace {

constexpr double kSampleRateHz = 48'000.0;
constexpr int kFrames = 100;

struct Count {
  const char* first;
  FrameRate fps;
  LTC_TV_STANDARD standard;
};
constexpr Count kCounts[] = {{"23:59:58:20", {24, 1}, LTC_TV_FILM_24},
                             {"01:02:03:04", {24000, 1001}, LTC_TV_FILM_24},
                             {"10:20:30:12", {25, 1}, LTC_TV_625_50},
                             {"00:59:58;28", {30000, 1001}, LTC_TV_525_60},
                             {"19:09:59:29", {30, 1}, LTC_TV_1125_60}};

enum class Tape { Forwards, Backwards };

/// The frames that we read of what the library makes from `first` on.
std::vector<LtcFrame> frames_of_library(const Count& count, const Timecode& first, Tape tape) {
  const std::unique_ptr<LTCEncoder, void (*)(LTCEncoder*)> encoder(
      ltc_encoder_create(kSampleRateHz, count.fps.hz(), count.standard, 0), ltc_encoder_free);
  const TimecodeFields fields = fields_of(first);
  SMPTETimecode begin{};
  begin.hours = static_cast<unsigned char>(fields.hours);
  begin.mins = static_cast<unsigned char>(fields.minutes);
  begin.secs = static_cast<unsigned char>(fields.seconds);
  begin.frame = static_cast<unsigned char>(fields.frames);
  ltc_encoder_set_timecode(encoder.get(), &begin);
  LtcDecoder decoder(kSampleRateHz, count.fps);
  std::vector<LtcFrame> frames;
  // A word ends with the first edge of the next.
  for (int i = 0; i <= kFrames; ++i) {
    if (tape == Tape::Forwards)
      ltc_encoder_encode_frame(encoder.get());
    else
      ltc_encoder_encode_reversed_frame(encoder.get());
    std::vector<float> samples;
    ltcsnd_sample_t* sound = nullptr;
    const int size = ltc_encoder_get_bufferptr(encoder.get(), &sound, 1);
    for (int k = 0; k < size; ++k) samples.push_back((static_cast<float>(sound[k]) - 128.0f) / 128.0f);
    if (const auto frame = decoder.add(samples)) frames.push_back(*frame);
    if (tape == Tape::Forwards)
      ltc_encoder_inc_timecode(encoder.get());
    else
      ltc_encoder_dec_timecode(encoder.get());
  }
  return frames;
}

TEST(LtcOfLibltc, IsReadForwardsAndBackwards) {
  for (const Count& count : kCounts)
    for (const Tape tape : {Tape::Forwards, Tape::Backwards}) {
      SCOPED_TRACE(count.first);
      const Timecode first = *parse_timecode(count.first, count.fps);
      const auto frames = frames_of_library(count, first, tape);
      ASSERT_GE(frames.size(), static_cast<size_t>(kFrames) - 1) << "all but the one that is cut";
      const double step = tape == Tape::Forwards ? 1.0 : -1.0;
      const double skipped = static_cast<double>(kFrames) - static_cast<double>(frames.size());
      for (size_t i = 0; i < frames.size(); ++i) {
        EXPECT_EQ(frames[i].timecode, advanced(first, step * (static_cast<double>(i) + skipped))) << i;
        EXPECT_EQ(frames[i].is_backwards, tape == Tape::Backwards) << i;
      }
    }
}

}  // namespace
}  // namespace strandcast::ltc_peer_test
