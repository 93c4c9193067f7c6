#include "server/net/stream_costs.h"

#include <algorithm>
#include <utility>

namespace strandcast {
namespace {

/// The newest frame weighs a twentieth in what a strand class costs: a change shows within half a second.
constexpr uint32_t kAlikeFrames = 20;
/// What a class cost longer ago than this is estimated from another one instead.
constexpr int64_t kStrandAgeNs = 5'000'000'000;

/// The same for pictures, which are fewer.
constexpr double kPictureSmoothing = 0.15;
constexpr int64_t kPictureAgeNs = 60'000'000'000;
constexpr int64_t kLongestPictureIntervalNs = 1'500'000'000;
constexpr double kShortestPictureIntervalS = 1e-3;

}  // namespace

StrandCosts::StrandCosts(std::vector<StrandClass> classes, std::vector<StrandByteModel> codecs)
    : classes_(std::move(classes)),
      codecs_(std::move(codecs)),
      loads_(codecs_.size(), std::vector<Load>(classes_.size())) {}

void StrandCosts::note_frame(const FrameHeader& header, size_t bytes, int64_t time_ns) {
  const StrandStream stream = strand_stream_of(header.stream_id);
  const bool is_known = stream.codec < loads_.size() && stream.strand_class < classes_.size();
  if (header.opcode != Opcode::StrandDelta || !is_known) return;
  Load& load = loads_[stream.codec][stream.strand_class];
  const auto measured = static_cast<double>(bytes);
  // At first all count alike: the first one of a chain has no past to be foretold from.
  load.frame_count += load.frame_count < kAlikeFrames ? 1 : 0;
  const double weight = 1.0 / load.frame_count;
  load.delta_bytes += weight * (measured - load.delta_bytes);
  load.time_ns = time_ns;
}

std::vector<double> StrandCosts::bytes_per_s(size_t codec) const {
  const std::vector<Load>& loads = loads_[codec];
  const auto newest = std::max_element(loads.begin(), loads.end(),
                                       [](const Load& a, const Load& b) { return a.time_ns < b.time_ns; });
  if (newest == loads.end() || newest->time_ns == 0) return {};
  const MeasuredClass reference{classes_[static_cast<size_t>(newest - loads.begin())], newest->delta_bytes};
  std::vector<double> costs;
  for (size_t i = 0; i < classes_.size(); ++i) {
    const bool is_fresh = loads[i].time_ns > newest->time_ns - kStrandAgeNs && loads[i].time_ns != 0;
    costs.push_back(is_fresh ? loads[i].delta_bytes * classes_[i].frame_rate_hz
                             : expected_bytes_per_s(codecs_[codec], reference, classes_[i]));
  }
  return costs;
}

void PictureCosts::note_picture(PictureClass picture_class, size_t bytes, int64_t time_ns) {
  std::erase_if(loads_, [&](const auto& entry) {
    return entry.first != picture_class && time_ns - entry.second.time_ns > kPictureAgeNs;
  });
  const auto [entry, is_new] = loads_.try_emplace(picture_class);
  Load& load = entry->second;
  const int64_t interval_ns = time_ns - std::exchange(load.time_ns, time_ns);
  // The first one is whole, and one after a pause says nothing about the rate.
  if (is_new || interval_ns > kLongestPictureIntervalNs) return;
  const auto measured_bytes = static_cast<double>(bytes);
  const double measured_s = static_cast<double>(interval_ns) * 1e-9;
  const double weight = load.bytes == 0.0 ? 1.0 : kPictureSmoothing;
  load.bytes += weight * (measured_bytes - load.bytes);
  load.interval_s += weight * (measured_s - load.interval_s);
}

double PictureCosts::bytes_per_s(PictureClass picture_class) const {
  const auto found = loads_.find(picture_class);
  if (found == loads_.end() || found->second.bytes == 0.0) return 0.0;
  return found->second.bytes / std::max(found->second.interval_s, kShortestPictureIntervalS);
}

}  // namespace strandcast
