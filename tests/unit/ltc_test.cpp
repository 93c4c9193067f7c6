// Linear timecode from sound: words are made here by SMPTE ST 12-1, and read back at any level, rate and
// speed.
#include "client/app/ltc.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace strandcast::ltc_test {
namespace {

using testing::HasSubstr;

struct Sound {
  double sample_rate_hz = 48'000.0;
  double speed = 1.0;  // of the tape
  double level = 0.5;
  double noise = 0.0;  // of the level
};

/// The 80 bits of a word; those that are no time of day are 0.
std::vector<bool> word_of(const Timecode& timecode) {
  std::vector<bool> bits(80, false);
  const auto put = [&bits](size_t at, uint32_t value) {
    for (; value > 0; value >>= 1, ++at) bits[at] = (value & 1) != 0;
  };
  const TimecodeFields fields = fields_of(timecode);
  const std::pair<size_t, uint32_t> places[] = {
      {0, fields.frames}, {16, fields.seconds}, {32, fields.minutes}, {48, fields.hours}};
  for (const auto& [at, value] : places) {
    put(at, value % 10);
    put(at + 8, value / 10);
  }
  bits[10] = timecode.is_drop;
  const char* const sync = "0011111111111101";
  for (size_t i = 0; i < 16; ++i) bits[64 + i] = sync[i] == '1';
  return bits;
}

/// Some frames as biphase mark: an edge at each bit's beginning, and one in the middle of a 1.
std::vector<float> sound_of(Timecode timecode, int frames, const Sound& sound) {
  std::vector<double> edges;
  double at = 0.01;
  const double bit_s = 1.0 / timecode.rate.hz() / 80.0 / sound.speed;
  for (int frame = 0; frame < frames; ++frame, timecode = advanced(timecode, 1.0))
    for (const bool bit : word_of(timecode)) {
      edges.push_back(at);
      if (bit) edges.push_back(at + 0.5 * bit_s);
      at += bit_s;
    }
  edges.push_back(at);
  std::vector<float> samples;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 1.0);
  size_t edge = 0;
  double high = -1.0;
  constexpr double kRiseS = 40e-6;  // as published: 40 +- 10 us
  for (double t = 0.0; t < at + 0.01; t += 1.0 / sound.sample_rate_hz) {
    while (edge < edges.size() && edges[edge] + 0.5 * kRiseS < t) {
      high = -high;
      ++edge;
    }
    const double share = edge < edges.size() ? std::clamp((t - edges[edge]) / kRiseS, -0.5, 0.5) : -0.5;
    const double value = -high * std::sin(std::numbers::pi * share);
    samples.push_back(static_cast<float>(sound.level * (value + sound.noise * noise(random))));
  }
  return samples;
}

const LtcListener kSilence = [](const std::string&) {};

std::vector<LtcFrame> frames_in(const std::vector<float>& samples, double sample_rate_hz,
                                const FrameRate& fps) {
  LtcDecoder decoder(sample_rate_hz, fps);
  std::vector<LtcFrame> frames;
  for (size_t i = 0; i < samples.size(); i += 64)
    if (const auto frame =
            decoder.add(std::span(samples).subspan(i, std::min<size_t>(64, samples.size() - i))))
      frames.push_back(*frame);
  return frames;
}

TEST(Ltc, EveryFrameIsReadAtAnyRateLevelAndSpeed) {
  const std::pair<const char*, FrameRate> kFirst[] = {{"23:59:59:20", {24, 1}},
                                                      {"01:02:03:04", {24000, 1001}},
                                                      {"10:20:30:12", {25, 1}},
                                                      {"00:59:59;28", {30000, 1001}},
                                                      {"19:09:59:29", {30, 1}}};
  for (const auto& [text, fps] : kFirst)
    for (const Sound& sound : {Sound{}, Sound{44'100.0, 1.0, 0.01, 0.05}, Sound{96'000.0, 1.05, 0.9, 0.02},
                               Sound{22'050.0, 0.95, 0.3, 0.0}}) {
      const Timecode first = *parse_timecode(text, fps);
      constexpr int kFrames = 40;
      const auto frames = frames_in(sound_of(first, kFrames, sound), sound.sample_rate_hz, fps);
      ASSERT_EQ(frames.size(), kFrames) << text << ", " << sound.sample_rate_hz;
      for (int i = 0; i < kFrames; ++i) {
        EXPECT_EQ(frames[i].timecode, advanced(first, i)) << text;
        EXPECT_NEAR(frames[i].end_s, 0.01 + (i + 1) / fps.hz() / sound.speed, 2.0 / sound.sample_rate_hz);
      }
    }
}

TEST(Ltc, TapeMayRunBackwards) {
  for (const auto& [text, fps] :
       {std::pair("01:02:03:04", FrameRate{25, 1}), {"00:59:59;28", {30000, 1001}}}) {
    const Timecode first = *parse_timecode(text, fps);
    constexpr int kFrames = 40;
    std::vector<float> sound = sound_of(first, kFrames, {});
    const double length_s = static_cast<double>(sound.size()) / 48'000.0;
    std::reverse(sound.begin(), sound.end());
    const auto frames = frames_in(sound, 48'000.0, fps);
    ASSERT_EQ(frames.size(), kFrames) << text;
    for (int i = 0; i < kFrames; ++i) {
      const int frame = kFrames - 1 - i;  // that ends where it began when it was recorded
      EXPECT_EQ(frames[i].timecode, advanced(first, frame)) << text;
      EXPECT_NEAR(frames[i].end_s, length_s - (0.01 + frame / fps.hz()), 2.0 / 48'000.0);
      EXPECT_EQ(frames[i].after(0.0), advanced(first, frame));
      EXPECT_EQ(frames[i].after(3.0 / fps.hz() - 1e-6).frame, advanced(first, frame - 3).frame);
    }
  }
}

TEST(Ltc, NoiseAndBrokenWordsAreNoTime) {
  std::vector<float> noise(48'000);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f);
  for (float& sample : noise) sample = any(random);
  EXPECT_EQ(frames_in(noise, 48'000.0, {25, 1}).size(), 0u);
  const Timecode first = *parse_timecode("01:00:00:00", {25, 1});
  std::vector<float> sound = sound_of(first, 20, {});
  std::fill(sound.begin() + 9'000, sound.begin() + 12'000, 0.0f);
  const auto frames = frames_in(sound, 48'000.0, {25, 1});
  EXPECT_GE(frames.size(), 16u);
  for (const LtcFrame& frame : frames) {
    const double place = frames_between(first, frame.timecode) + 1.0;
    EXPECT_NEAR(frame.end_s, 0.01 + place / 25.0, 1e-3) << "a word is that of its place, or none";
  }
}

std::string wav_of(const std::vector<float>& samples, uint16_t bits, uint16_t channels) {
  std::string text = "RIFF";
  const auto put = [&text](auto value, size_t bytes = 0) {
    text.append(reinterpret_cast<const char*>(&value), bytes > 0 ? bytes : sizeof(value));
  };
  put(uint32_t{0xFFFFFFFF});
  text += "WAVELIST";
  put(uint32_t{3});
  text += "abc";
  text += '\0';
  text += "fmt ";
  put(uint32_t{16});
  put(uint16_t{1});
  put(channels);
  put(uint32_t{48'000});
  put(uint32_t{48'000u * channels * bits / 8});
  put(static_cast<uint16_t>(channels * bits / 8));
  put(bits);
  text += "data";
  put(uint32_t{0xFFFFFFFF});
  for (const float sample : samples)
    for (uint16_t channel = 0; channel < channels; ++channel)
      put(static_cast<int32_t>(channel == 0 ? sample * 2147483000.0 : 0.0) >> (32 - bits), bits / 8);
  return text;
}

TEST(Ltc, AWavFileTellsWhereItIs) {
  const TemporaryFolder folder;
  const Timecode first = *parse_timecode("01:00:00:00", {25, 1});
  const std::string path = (folder.path() / "ltc.wav").string();
  for (const uint16_t bits : {16, 24, 32}) {
    std::ofstream(path, std::ios::binary) << wav_of(sound_of(first, 50, {}), bits, bits == 24 ? 2 : 1);
    const auto at = open_ltc(path, FrameRate{25, 1}, kSilence);
    ASSERT_TRUE(at) << at.error().to_string();
    EXPECT_FALSE((*at)(0.02)) << "no word has ended yet";
    EXPECT_NEAR(frames_between(first, *(*at)(1.01)), 25.0, 0.01);
    EXPECT_NEAR(frames_between(first, *(*at)(5.01)), 125.0, 0.1) << "it counts on behind its end";
  }
}

TEST(Ltc, BehindTheEndOfAFileItCountsOnAndSaysSoOnce) {
  const TemporaryFolder folder;
  const Timecode first = *parse_timecode("01:00:00:00", {25, 1});
  const std::string path = (folder.path() / "ltc.wav").string();
  std::ofstream(path, std::ios::binary) << wav_of(sound_of(first, 50, {}), 16, 1);
  std::vector<std::string> said;
  const auto at =
      open_ltc(path, FrameRate{25, 1}, [&](const std::string& sentence) { said.push_back(sentence); });
  ASSERT_TRUE(at) << at.error().to_string();
  for (double time_s = 0.0; time_s < 2.0; time_s += 0.02) (void)(*at)(time_s);
  EXPECT_EQ(said.size(), 1u) << "it is there";
  for (double time_s = 2.2; time_s < 9.0; time_s += 0.02)
    EXPECT_NEAR(frames_between(first, *(*at)(time_s)), 25.0 * (time_s - 0.01), 0.1);
  ASSERT_EQ(said.size(), 2u);
  EXPECT_THAT(said[1], HasSubstr("ends at 01:00:01:24, and is counted on"));
}

// Words do not tell how many there are in a second: their times do, and whether numbers are dropped.
TEST(Ltc, TheRateOfAFileIsMeasured) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "ltc.wav").string();
  const std::pair<const char*, FrameRate> kFirst[] = {
      {"01:00:00:00", {24, 1}},       {"01:00:00:00", {24000, 1001}}, {"01:00:00:00", {25, 1}},
      {"01:00:00;00", {30000, 1001}}, {"01:00:00:00", {30000, 1001}}, {"01:00:00:00", {30, 1}}};
  for (const auto& [text, fps] : kFirst) {
    const Timecode first = *parse_timecode(text, fps);
    std::ofstream(path, std::ios::binary) << wav_of(sound_of(first, 60, {}), 16, 1);
    std::vector<std::string> said;
    const auto at =
        open_ltc(path, std::nullopt, [&](const std::string& sentence) { said.push_back(sentence); });
    ASSERT_TRUE(at) << at.error().to_string();
    const Timecode found = *(*at)(1.0);
    EXPECT_TRUE(is_same_count(found, first)) << text << " at " << fps.hz() << ": " << found.rate.hz();
    EXPECT_NEAR(frames_between(first, found), fps.hz() - 0.01 * fps.hz(), 0.1);
    EXPECT_THAT(said, testing::ElementsAre(testing::EndsWith(
                          fmt::format("of {} frames per second{} on", frame_rate_text(fps.hz()),
                                      first.is_drop ? ", drop-frame" : ""))));
  }
  // At any speed of the tape the last frame of a second tells how many it has.
  for (const double speed : {0.5, 0.96, 1.0417, 2.0})
    for (const uint32_t fps : {24u, 25u, 30u}) {
      const FrameRate rate{fps, 1};
      const Sound sound{48'000.0, speed, 0.5, 0.0};
      std::ofstream(path, std::ios::binary)
          << wav_of(sound_of(*parse_timecode("01:00:00:00", rate), 70, sound), 16, 1);
      const auto at = open_ltc(path, std::nullopt, kSilence);
      ASSERT_TRUE(at) << at.error().to_string();
      EXPECT_EQ((*at)(1.0)->rate, rate) << speed;
      const FrameRate other{fps == 24 ? 25u : 24u, 1};
      EXPECT_THAT(open_ltc(path, other, kSilence).error().to_string(), HasSubstr("leave --fps out"));
    }
  std::ofstream(path, std::ios::binary)
      << wav_of(sound_of(*parse_timecode("01:00:00:00", {30, 1}), 60, {}), 16, 1);
  EXPECT_THAT(open_ltc(path, FrameRate{24, 1}, kSilence).error().to_string(),
              HasSubstr("counts 30 frames per second, and --fps says 24"));
}

TEST(Ltc, SaysWhatIsWrongWithAFile) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "ltc.wav").string();
  const auto refusal = [&](const std::string& bytes, const FrameRate& fps = {25, 1}) {
    std::ofstream(path, std::ios::binary) << bytes;
    const auto opened = open_ltc(path, fps, kSilence);
    return opened ? std::string() : opened.error().to_string();
  };
  const std::string silent = wav_of(std::vector<float>(4'800), 16, 1);
  EXPECT_THAT(refusal("hair"), HasSubstr("RIFF and WAVE"));
  EXPECT_THAT(refusal(silent.substr(0, 30)), HasSubstr("ends before its sound"));
  EXPECT_THAT(refusal(silent.substr(0, 40)), HasSubstr("cut off"));
  EXPECT_THAT(refusal(wav_of({}, 8, 1)), HasSubstr("16, 24 or 32 bits"));
  EXPECT_THAT(refusal(wav_of({}, 16, 0)), HasSubstr("are possible"));
  EXPECT_THAT(refusal(silent), HasSubstr("no timecode of 24 to 30 frames per second in its first channel"));
  EXPECT_THAT(refusal(silent, {15, 1}), HasSubstr("no timecode counts 15"));
  EXPECT_THAT(open_ltc((folder.path() / "none.wav").string(), FrameRate{25, 1}, kSilence).error().to_string(),
              HasSubstr("cannot be read"));
  // Any cut of a file is read as far as it goes, or refused.
  const std::string whole = wav_of(sound_of(*parse_timecode("01:00:00:00", {25, 1}), 3, {}), 16, 1);
  for (size_t size = 0; size < whole.size(); size += 1 + size / 5) refusal(whole.substr(0, size));
}

}  // namespace
}  // namespace strandcast::ltc_test
