#include "server/app/mode_policy.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/units.h"
#include "server/net/flow_control.h"

namespace strandcast {
namespace {

using Limit = ModePrediction::Limit;

constexpr double kBitsPerMbit = 1e6;

double usable_bytes_per_s(const ModeFacts& facts) {
  return kUsableShare * facts.capacity_bytes_per_s;
}

/// Lowers the rate to what something allows.
void limit_to(ModePrediction& prediction, double rate_hz, Limit limit) {
  if (rate_hz >= prediction.rate_hz) return;
  prediction.rate_hz = rate_hz;
  prediction.limit = limit;
}

/// Lowers it to what work of so long allows; 0 = unknown.
void limit_to_work(ModePrediction& prediction, double work_ms, Limit limit) {
  if (work_ms > 0.0) limit_to(prediction, kMsPerS / work_ms, limit);
}

/// What the way takes: half a round trip, the frame itself, and on a link that is full what waits before it.
double way_ms(const ModeFacts& facts, double frame_bytes, bool is_full) {
  if (facts.capacity_bytes_per_s <= 0.0) return facts.round_trip_ms / 2.0;
  const double waiting_ms = is_full ? static_cast<double>(kGateDelayNs) / kMsInNs : 0.0;
  return facts.round_trip_ms / 2.0 + frame_bytes / facts.capacity_bytes_per_s * kMsPerS + waiting_ms;
}

double mbit(double bytes_per_s) {
  return bytes_per_s * 8.0 / kBitsPerMbit;
}

std::string what_limits_strands(const ModeFacts& facts, const ModePrediction& strands) {
  switch (strands.limit) {
    case Limit::Link: {
      const ModeFacts::StrandClassFacts& least = facts.strand_classes.back();
      return fmt::format("the link takes {:.2f} Mbit/s and strands at {:.0f} Hz need one of {:.2f}",
                         mbit(facts.capacity_bytes_per_s), least.rate_hz,
                         mbit(least.bytes_per_s / kUsableShare));
    }
    case Limit::Viewer:
      return fmt::format("this machine draws {:.1f} pictures per second of these strands", strands.rate_hz);
    default:
      return fmt::format("strands come at {:.1f} Hz, {:.0f} ms late", strands.rate_hz, strands.latency_ms);
  }
}

std::string reason_for_frames(const ModeFacts& facts) {
  if (facts.device == DrawingDevice::None) return "pictures: this machine cannot draw strands";
  const ModePrediction frames = predict_frames(facts);
  return fmt::format("pictures: {}, the server {:.1f}", what_limits_strands(facts, predict_strands(facts)),
                     frames.rate_hz);
}

/// Why the rates alone say something else than the choice; empty where they do not.
std::string why_still(StreamMode chosen, const ModeFacts& facts, double gain) {
  if (facts.device == DrawingDevice::None || !facts.paint_trouble.empty()) return {};
  const ModePrediction strands = predict_strands(facts);
  const ModePrediction frames = predict_frames(facts);
  const bool is_frames = chosen == StreamMode::Frames;
  if (is_frames && strands.worth() > frames.worth()) return "; strands come when that has lasted";
  if (!is_frames && frames.worth() > gain * strands.worth()) return "; pictures come when that has lasted";
  if (!is_frames && frames.worth() > strands.worth())
    return fmt::format("; pictures would have to be worth {:g} times as much", gain);
  if (is_frames ? frames.rate_hz >= strands.rate_hz : strands.rate_hz >= frames.rate_hz) return {};
  return fmt::format("; strands are {:.0f} ms late, pictures {:.0f}", strands.latency_ms, frames.latency_ms);
}

std::string reason_for_strands(const ModeFacts& facts) {
  if (!facts.paint_trouble.empty())
    return fmt::format("strands: the server can draw no pictures: {}", facts.paint_trouble);
  const ModePrediction strands = predict_strands(facts);
  const ModePrediction frames = predict_frames(facts);
  return fmt::format("strands: {:.1f} pictures per second drawn here, {:.1f} from the server",
                     strands.rate_hz, frames.rate_hz);
}

}  // namespace

ModeFacts gather_mode_facts(const ModeSources& sources) {
  ModeFacts facts;
  const std::vector<double>& bytes_per_s = sources.link.strand_bytes_per_s;
  for (size_t i = 0; i < sources.strand_classes.size(); ++i)
    facts.strand_classes.push_back(
        {i < bytes_per_s.size() ? bytes_per_s[i] : 0.0, sources.strand_classes[i].frame_rate_hz});
  facts.strand_decode_ms = sources.report.decode_ms;
  facts.strand_draw_ms = sources.report.draw_ms;
  facts.picture_decode_ms = sources.report.picture_decode_ms;
  facts.device = sources.report.device;

  const auto pixels =
      static_cast<double>(sources.picture_size.width) * static_cast<double>(sources.picture_size.height);
  const FrameCounters& pictures = sources.pictures;
  const bool is_measured = pictures.frames > 0;
  const double guessed_ms = sources.is_software ? kGuessedSoftwareMsPerPixel * pixels : kGuessedHardwareMs;
  const double one_ms = is_measured ? pictures.paint_median_ms + pictures.encode_median_ms : guessed_ms;
  facts.paint_ms = one_ms * static_cast<double>(sources.view_count);
  facts.is_paint_guessed = !is_measured && sources.is_software;
  facts.picture_bytes = is_measured
                            ? static_cast<double>(pictures.bytes) / static_cast<double>(pictures.frames)
                            : kGuessedBytesPerPixel * pixels;
  facts.picture_rate_hz = sources.picture_rate_hz;
  facts.paint_trouble = sources.paint_trouble;

  facts.capacity_bytes_per_s = sources.link.capacity_bytes_per_s;
  facts.round_trip_ms = sources.link.round_trip_ms;
  return facts;
}

double ModePrediction::worth() const {
  return std::min(rate_hz, kMostUsefulHz) * kHalfWorthMs / (kHalfWorthMs + latency_ms);
}

ModePrediction predict_strands(const ModeFacts& facts) {
  const double usable = usable_bytes_per_s(facts);
  const auto& classes = facts.strand_classes;
  ModePrediction strands;
  const auto is_fitting = [&](const auto& row) { return usable <= 0.0 || row.bytes_per_s <= usable; };
  const auto fitting = std::find_if(classes.begin(), classes.end(), is_fitting);
  const bool is_full = fitting == classes.end();
  strands.strand_class = static_cast<size_t>((is_full ? std::prev(fitting) : fitting) - classes.begin());
  const ModeFacts::StrandClassFacts& row = classes[strands.strand_class];
  strands.rate_hz = row.rate_hz;
  if (is_full) limit_to(strands, row.rate_hz * usable / row.bytes_per_s, Limit::Link);
  limit_to_work(strands, std::max(facts.strand_decode_ms, facts.strand_draw_ms), Limit::Viewer);
  strands.latency_ms =
      way_ms(facts, row.bytes_per_s / row.rate_hz, is_full) + facts.strand_decode_ms + facts.strand_draw_ms;
  return strands;
}

ModePrediction predict_frames(const ModeFacts& facts) {
  const double usable = usable_bytes_per_s(facts);
  ModePrediction frames;
  frames.rate_hz = facts.picture_rate_hz;
  const bool is_full = usable > 0.0 && facts.picture_bytes * facts.picture_rate_hz > usable;
  if (is_full) limit_to(frames, usable / facts.picture_bytes, Limit::Link);
  limit_to_work(frames, facts.paint_ms, Limit::Server);
  limit_to_work(frames, facts.picture_decode_ms, Limit::Viewer);
  frames.latency_ms = way_ms(facts, facts.picture_bytes, is_full) + facts.paint_ms + facts.picture_decode_ms;
  return frames;
}

ModeChoice ModePolicy::choose(StreamMode present, const ModeFacts& facts, int64_t time_ns) {
  const bool can_draw = facts.device != DrawingDevice::None;
  const bool can_paint = facts.paint_trouble.empty();
  const ModePrediction strands = predict_strands(facts);
  const double gain = facts.is_paint_guessed ? kGuessedFramesGain : kFramesGain;
  const auto choice = [&](StreamMode mode) {
    const std::string reason =
        mode == StreamMode::Frames ? reason_for_frames(facts) : reason_for_strands(facts);
    return ModeChoice{mode, reason + why_still(mode, facts, gain), strands.strand_class};
  };
  // What is impossible waits for nothing, except for another try of what has just failed.
  const bool may_try = !has_failed_ || has_settled(time_ns);
  if (!can_paint) return choice(may_try ? StreamMode::Strands : present);
  if (!can_draw) return choice(may_try ? StreamMode::Frames : present);

  const double frames_worth = predict_frames(facts).worth();
  const bool is_other_better =
      present == StreamMode::Strands ? frames_worth > gain * strands.worth() : strands.worth() > frames_worth;
  if (!is_other_better) {
    wish_since_ns_.reset();
    return choice(present);
  }
  if (!wish_since_ns_) wish_since_ns_ = time_ns;
  if (!has_settled(time_ns) || time_ns - *wish_since_ns_ < kWishNs) return choice(present);
  return choice(present == StreamMode::Strands ? StreamMode::Frames : StreamMode::Strands);
}

void ModePolicy::note_change(int64_t time_ns) {
  if (changed_ns_) {
    const bool is_undone = time_ns - *changed_ns_ <= 2 * dwell_ns_;
    dwell_ns_ = is_undone ? std::min(2 * dwell_ns_, kLongestDwellNs) : kFirstDwellNs;
  }
  changed_ns_ = time_ns;
  has_failed_ = false;
  wish_since_ns_.reset();
}

void ModePolicy::note_failure(int64_t time_ns) {
  dwell_ns_ = std::min(2 * dwell_ns_, kLongestDwellNs);
  changed_ns_ = time_ns;
  has_failed_ = true;
  wish_since_ns_.reset();
}

}  // namespace strandcast
