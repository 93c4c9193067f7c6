#include "client/app/ltc.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iostream>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/profile.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr size_t kWordBits = 80;
constexpr double kLevelShare = 0.25;    // of the loudest samples, that an edge has to pass
constexpr double kLevelFall = 0.9995;   // per sample: silence is forgotten within a few frames
constexpr double kBitShare = 1.0 / 16;  // of the newest bit in their usual length
constexpr double kHalfBelow = 0.75;     // of a bit; shorter is the half of a 1
constexpr double kLeastHalf = 0.3, kLongestBit = 1.6;
constexpr double kLeastLevel = 1e-4;
constexpr uint32_t kMaxWavChannels = 64;
constexpr uint32_t kMaxWavRateHz = 768'000;
constexpr size_t kChunkSamples = 1024;
constexpr size_t kMaxLtcFrames = 24 * 3600 * 60;
constexpr int64_t kLiveStaleNs = 1'000'000'000;
constexpr FrameRate kMostFrames{30, 1};  // of linear timecode: all numbers are read so
constexpr double kOtherRate = 0.1;       // a tape runs at another speed by less
constexpr uint32_t kMeasuredPairs = 40;  // of sound as it comes, where no second ended meanwhile
constexpr uint32_t kSettledPairs = 10;   // after which it is known how late sound comes
constexpr double kSpeeds[] = {1.0, 2.0, 0.5};
constexpr double kClockError = 5e-4;       // of who made sound, at most
constexpr double kClockDrift = 1e-3;       // of who plays sound, at most
constexpr double kOverS = 0.1;             // behind the last word: sound has ended
constexpr double kHeldUpS = 0.5;           // of sound that comes: it was held up
constexpr int64_t kSilentNs = 5 * kSInNs;  // without timecode, until that is said

template <class T>
T number_at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(value));
  return value;
}

/// Of a second, that `fps` has.
uint32_t value_of(const std::array<bool, kWordBits>& bits, size_t begin, size_t count) {
  uint32_t value = 0;
  for (size_t i = 0; i < count; ++i) value |= static_cast<uint32_t>(bits[begin + i]) << i;
  return value;
}

constexpr size_t kDropAt = 10;

/// Nothing for what is no time of day.
std::optional<Timecode> counted_as(const FrameRate& fps, const TimecodeFields& fields, bool has_drop_flag) {
  const auto timecode = make_timecode(fields, fps, has_drop_flag && is_timecode_rate(fps, true));
  return timecode ? std::optional(*timecode) : std::nullopt;
}

std::optional<Timecode> timecode_of_word(const std::array<bool, kWordBits>& bits, const FrameRate& fps) {
  constexpr size_t kSyncAt = 64;
  constexpr uint32_t kSync = 0xBFFC;  // 0011 1111 1111 1101, the first bit lowest
  if (value_of(bits, kSyncAt, 16) != kSync) return std::nullopt;
  const auto two_digits = [&](size_t units_at, size_t tens_at, size_t tens_bits) {
    return value_of(bits, units_at, 4) + 10 * value_of(bits, tens_at, tens_bits);
  };
  const TimecodeFields fields{two_digits(48, 56, 2), two_digits(32, 40, 3), two_digits(16, 24, 3),
                              two_digits(0, 8, 2)};
  return counted_as(fps, fields, bits[kDropAt]);
}

}  // namespace

LtcDecoder::LtcDecoder(double sample_rate_hz, const FrameRate& fps, double speed)
    : sample_rate_hz_(sample_rate_hz),
      fps_(fps),
      bit_samples_(sample_rate_hz / fps.hz() / speed / kWordBits) {}

std::optional<LtcFrame> LtcDecoder::add(std::span<const float> samples) {
  newest_.reset();
  for (const float sample : samples) {
    level_ = std::max(level_ * kLevelFall, static_cast<double>(std::abs(sample)));
    const double edge = std::max(kLevelShare * level_, kLeastLevel);
    if (is_high_ ? sample < -edge : sample > edge) {
      is_high_ = !is_high_;
      // Where the line between the two samples is half way through the edge.
      const double rise = static_cast<double>(sample) - last_;
      const double back = rise == 0.0 ? 0.0 : std::clamp(sample / rise, 0.0, 1.0);
      note_edge(static_cast<double>(sample_count_) - back);
    }
    last_ = sample;
    ++sample_count_;
  }
  return newest_;
}

/// A bit begins with an edge, and a 1 has another in its middle.
void LtcDecoder::note_edge(double at) {
  const double length = at - std::exchange(edge_at_, at);
  const double share = length / bit_samples_;
  if (share < kLeastHalf || share > kLongestBit) {
    has_half_ = false;
    bit_count_ = 0;
  } else if (share >= kHalfBelow) {
    bit_samples_ += kBitShare * (length - bit_samples_);
    has_half_ = false;
    note_bit(false, at);
  } else if (std::exchange(has_half_, !has_half_)) {
    note_bit(true, at);
  } else {
    bit_samples_ += kBitShare * (2.0 * length - bit_samples_);
  }
}

void LtcDecoder::note_bit(bool bit, double at) {
  std::rotate(bits_.begin(), bits_.begin() + 1, bits_.end());
  bits_.back() = bit;
  if (++bit_count_ < kWordBits) return;
  if (const auto timecode = timecode_of_word(bits_, fps_))
    newest_ = LtcFrame{*timecode, at / sample_rate_hz_, false, bits_[kDropAt]};
  // An edge in the middle of a bit is so either way round, and no word holds the end of another backwards.
  std::array<bool, kWordBits> turned;
  std::reverse_copy(bits_.begin(), bits_.end(), turned.begin());
  if (const auto timecode = timecode_of_word(turned, fps_))
    newest_ = LtcFrame{*timecode, at / sample_rate_hz_, true, turned[kDropAt]};
}

void LtcRateMeter::add(const LtcFrame& frame) {
  const std::optional<LtcFrame> before = std::exchange(last_, frame);
  drops_ = drops_ || frame.has_drop_flag;
  if (!before) return;
  const double passed_s = frame.end_s - before->end_s;
  // Where a second begins the numbers tell how many one has.
  TimecodeFields end = fields_of(before->timecode), begin = fields_of(frame.timecode);
  if (frame.is_backwards) std::swap(end, begin);
  const bool are_neighbours = pair_count_ > 0 && passed_s < 1.5 * sum_s_ / pair_count_;
  const bool is_next_second = begin.frames == 0 && begin.seconds == (end.seconds + 1) % 60;
  const uint32_t count = end.frames + 1;
  if (are_neighbours && is_next_second && (count == 24 || count == 25 || count == 30)) counted_ = count;
  if (std::abs(frames_between(before->timecode, frame.timecode)) != 1.0) return;
  sum_s_ += passed_s;
  ++pair_count_;
}

FrameRate LtcRateMeter::rate() const {
  constexpr FrameRate kRates[] = {{24000, 1001}, {24, 1}, {25, 1}, {30000, 1001}, {30, 1}};
  if (drops_) return kRates[3];
  const auto distance = [this](const FrameRate& rate) {
    // A tape at another speed is none of television.
    const bool is_at_speed = pair_count_ > 0 && std::abs(hz() / rate.hz() - 1.0) < kClockError;
    const bool is_counted_so =
        counted_ == 0 || (std::lround(rate.hz()) == counted_ && (rate.denominator == 1 || is_at_speed));
    return (is_counted_so ? 0.0 : kMostFrames.hz()) + (pair_count_ > 0 ? std::abs(rate.hz() - hz()) : 0.0);
  };
  return *std::min_element(std::begin(kRates), std::end(kRates),
                           [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
}

Result<WavReader> WavReader::open(std::istream& in) {
  const auto refuse = [](std::string_view why) {
    return make_error(ErrorCode::BadInput, "this is no WAV file that can be read: {}", why);
  };
  char head[12];
  if (!in.read(head, sizeof(head)) || std::memcmp(head, "RIFF", 4) != 0 ||
      std::memcmp(head + 8, "WAVE", 4) != 0)
    return refuse("it does not begin with RIFF and WAVE");
  WavReader reader(in);
  constexpr uint32_t kMostFormatBytes = 4096;
  constexpr uint16_t kWhole = 1, kFloat = 3, kExtended = 0xFFFE;
  while (true) {
    char chunk[8];
    if (!in.read(chunk, sizeof(chunk))) return refuse("it ends before its sound");
    const auto size = number_at<uint32_t>(chunk + 4);
    if (std::memcmp(chunk, "data", 4) == 0) {
      if (reader.sample_bytes_ == 0) return refuse("its format does not stand before its sound");
      // A pipe does not know how long it will be.
      constexpr uint32_t kUnknown = 0xFFFFFFFF;
      reader.left_bytes_ = size == 0 || size == kUnknown ? ~uint64_t{0} : size;
      return reader;
    }
    if (std::memcmp(chunk, "fmt ", 4) != 0) {
      in.ignore(static_cast<std::streamsize>(size) + size % 2);
      continue;
    }
    if (size < 16 || size > kMostFormatBytes) return refuse("its format has a wrong size");
    std::vector<char> format(size + size % 2);
    if (!in.read(format.data(), static_cast<std::streamsize>(format.size()))) return refuse("it is cut off");
    auto kind = number_at<uint16_t>(format.data());
    if (kind == kExtended && size >= 26) kind = number_at<uint16_t>(format.data() + 24);
    reader.channel_count_ = number_at<uint16_t>(format.data() + 2);
    const auto rate_hz = number_at<uint32_t>(format.data() + 4);
    const auto bits = number_at<uint16_t>(format.data() + 14);
    reader.is_float_ = kind == kFloat;
    reader.sample_rate_hz_ = rate_hz;
    const bool is_known =
        (kind == kWhole && (bits == 16 || bits == 24 || bits == 32)) || (kind == kFloat && bits == 32);
    if (!is_known || reader.channel_count_ == 0 || reader.channel_count_ > kMaxWavChannels || rate_hz == 0 ||
        rate_hz > kMaxWavRateHz)
      return refuse("16, 24 or 32 bits of whole numbers, or 32 of float, are possible");
    reader.sample_bytes_ = bits / 8;
  }
}

size_t WavReader::read(std::span<float> samples) {
  const size_t row = size_t{sample_bytes_} * channel_count_;
  std::vector<char> bytes(samples.size() * row);
  const uint64_t wanted = std::min<uint64_t>(bytes.size(), left_bytes_ / row * row);
  in_->read(bytes.data(), static_cast<std::streamsize>(wanted));
  const auto got = static_cast<size_t>(in_->gcount());
  if (left_bytes_ != ~uint64_t{0}) left_bytes_ -= got;
  const size_t count = got / row;
  for (size_t i = 0; i < count; ++i) {
    const char* const at = bytes.data() + i * row;
    if (is_float_) {
      const auto value = number_at<float>(at);
      samples[i] = std::isfinite(value) ? std::clamp(value, -1.0f, 1.0f) : 0.0f;
      continue;
    }
    uint32_t raw = 0;  // in the upper bytes
    for (uint32_t byte = 0; byte < sample_bytes_; ++byte)
      raw |= uint32_t{static_cast<uint8_t>(at[byte])} << (8 * (4 - sample_bytes_ + byte));
    samples[i] = static_cast<float>(static_cast<double>(std::bit_cast<int32_t>(raw)) / 2147483648.0);
  }
  return count;
}

namespace {

std::string other_rate_text(const LtcRateMeter& meter, const FrameRate& fps) {
  return fmt::format("its timecode counts {} frames per second, and --fps says {}: leave --fps out",
                     frame_rate_text(meter.rate().hz()), frame_rate_text(fps.hz()));
}

bool is_other_rate(const LtcRateMeter& meter, const FrameRate& fps) {
  if (meter.is_counted()) return std::lround(meter.rate().hz()) != std::lround(fps.hz());
  return meter.pair_count() > 0 && std::abs(meter.hz() / fps.hz() - 1.0) > kOtherRate;
}

std::string count_text(const Timecode& timecode) {
  return fmt::format("{} of {} frames per second{}", timecode_text(timecode),
                     frame_rate_text(timecode.rate.hz()), timecode.is_drop ? ", drop-frame" : "");
}

using LtcFrames = std::vector<LtcFrame>;

Result<LtcFrames> frames_of_file(const std::string& path, double speed) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return at(path, make_error(ErrorCode::NotFound, "cannot be read"));
  auto reader = WavReader::open(file);
  if (!reader) return at(path, reader.error());
  LtcDecoder decoder(reader->sample_rate_hz(), kMostFrames, speed);
  LtcFrames frames;
  std::vector<float> samples(kChunkSamples);
  while (const size_t count = reader->read(samples))
    if (const auto frame = decoder.add(std::span(samples).first(count));
        frame && frames.size() < kMaxLtcFrames)
      frames.push_back(*frame);
  return frames;
}

Result<TimecodeAt> read_ltc_file(const std::string& path, const std::optional<FrameRate>& fps,
                                 const LtcListener& listener) {
  LtcFrames counted;
  for (const double speed : kSpeeds) {
    ASSIGN_OR_RETURN(LtcFrames frames, frames_of_file(path, speed));
    if (frames.size() > counted.size()) counted = std::move(frames);
  }
  if (counted.empty())
    return at(path, make_error(ErrorCode::BadInput,
                               "has no timecode of 24 to 30 frames per second in its first channel"));
  LtcRateMeter meter;
  for (const LtcFrame& frame : counted) meter.add(frame);
  if (fps && is_other_rate(meter, *fps))
    return at(path, make_error(ErrorCode::BadInput, "{}", other_rate_text(meter, *fps)));
  const FrameRate rate = fps ? *fps : meter.pair_count() > 0 ? meter.rate() : counted.front().timecode.rate;
  LtcFrames kept;
  for (LtcFrame& frame : counted) {
    const auto timecode = counted_as(rate, fields_of(frame.timecode), frame.has_drop_flag);
    if (!timecode) continue;
    frame.timecode = *timecode;
    kept.push_back(frame);
  }
  if (kept.empty()) return at(path, make_error(ErrorCode::BadInput, "{}", other_rate_text(meter, rate)));
  const auto frames = std::make_shared<const LtcFrames>(std::move(kept));
  listener(fmt::format("{}: timecode from {} on", path, count_text(frames->front().timecode)));
  const auto was_over = std::make_shared<std::atomic<bool>>(false);
  return TimecodeAt([frames, was_over, path, listener](double time_s) -> std::optional<Timecode> {
    const LtcFrame& last = frames->back();
    if (time_s > last.end_s + kOverS && !was_over->exchange(true))
      listener(fmt::format("{}: its timecode ends at {}, and is counted on from there", path,
                           timecode_text(last.timecode)));
    const auto later = std::upper_bound(frames->begin(), frames->end(), time_s,
                                        [](double t_s, const LtcFrame& frame) { return t_s < frame.end_s; });
    if (later == frames->begin()) return std::nullopt;
    return std::prev(later)->after(time_s - std::prev(later)->end_s);
  });
}

/// Timecode in sound as it comes.
class LiveLtc {
 public:
  LiveLtc(const WavReader& reader, const std::optional<FrameRate>& fps, LtcListener listener)
      : reader_(reader), fps_(fps), listener_(std::move(listener)) {}

  /// Reads to the end, on a thread of its own.
  void run() {
    const double rate_hz = reader_.sample_rate_hz();
    LtcDecoder decoder(rate_hz, fps_.value_or(kMostFrames));
    LtcRateMeter meter;
    std::vector<float> samples(kChunkSamples / 4);
    double read_s = 0.0;
    bool is_counted = false;
    while (const size_t count = reader_.read(samples)) {
      const auto frame = decoder.add(std::span(samples).first(count));
      read_s += static_cast<double>(count) / rate_hz;
      note_arrival(read_s);
      if (!frame) continue;
      if (is_counted || (fps_ && meter.pair_count() > kSettledPairs)) put(*frame);
      if (is_counted) continue;
      meter.add(*frame);
      if (!meter.is_counted() && meter.pair_count() < kMeasuredPairs) continue;
      is_counted = true;
      if (fps_ && is_other_rate(meter, *fps_))
        listener_("standard input: " + other_rate_text(meter, *fps_));
      else
        listener_(fmt::format("standard input: timecode of {} frames per second",
                              frame_rate_text(fps_.value_or(meter.rate()).hz())));
      if (!fps_) decoder.set_fps(meter.rate());
    }
    end();
  }

  std::optional<Timecode> now() {
    const std::lock_guard lock(mutex_);
    if (!frame_ && now_ns() - begin_ns_ > kSilentNs && !std::exchange(was_silent_, true))
      listener_("standard input: no timecode yet in the first channel of the sound");
    const int64_t passed_ns = now_ns() - end_ns_;
    if (!frame_ || (!has_ended_ && passed_ns > kLiveStaleNs)) return std::nullopt;
    return frame_->after(static_cast<double>(passed_ns) * kSPerNs);
  }

 private:
  /// Sound comes in pieces: what was the least late tells when it is played.
  void note_arrival(double read_s) {
    const double now_s = static_cast<double>(now_ns()) * kSPerNs - read_s;
    const double allowed_s = offset_s_ + kClockDrift * (read_s - read_s_);
    const bool begins = read_s_ == 0.0 || now_s > allowed_s + kHeldUpS;
    offset_s_ = begins ? now_s : std::min(allowed_s, now_s);
    read_s_ = read_s;
  }

  void put(const LtcFrame& frame) {
    const std::lock_guard lock(mutex_);
    end_ns_ = static_cast<int64_t>((offset_s_ + frame.end_s) * kNsPerS);
    frame_ = frame;
  }

  /// What played when sound ended goes on.
  void end() {
    const std::lock_guard lock(mutex_);
    has_ended_ = frame_ && now_ns() - end_ns_ <= kLiveStaleNs;
    if (has_ended_)
      listener_(fmt::format("standard input: the sound has ended at {}, and its timecode is counted on",
                            timecode_text(frame_->timecode)));
  }

  WavReader reader_;
  const std::optional<FrameRate> fps_;
  const LtcListener listener_;
  const int64_t begin_ns_ = now_ns();
  std::mutex mutex_;  // guards the block below
  bool was_silent_ = false;
  bool has_ended_ = false;
  std::optional<LtcFrame> frame_;
  int64_t end_ns_ = 0;  // of its word
  // Of the reading thread.
  double offset_s_ = 0.0;  // from sound that was read to the clock, s
  double read_s_ = 0.0;    // of the newest sound
};

Result<TimecodeAt> read_live_ltc(const std::optional<FrameRate>& fps, const LtcListener& listener) {
  auto reader = WavReader::open(std::cin);
  if (!reader) return at("standard input", reader.error());
  const auto live = std::make_shared<LiveLtc>(*reader, fps, listener);
  std::thread([live] { live->run(); }).detach();
  return TimecodeAt([live](double) { return live->now(); });
}

}  // namespace

Result<TimecodeAt> open_ltc(const std::string& path, const std::optional<FrameRate>& fps,
                            const LtcListener& listener) {
  if (fps && !is_timecode_rate(*fps, false)) return make_timecode({}, *fps, false).error();
  return path == "-" ? read_live_ltc(fps, listener) : read_ltc_file(path, fps, listener);
}

}  // namespace strandcast
