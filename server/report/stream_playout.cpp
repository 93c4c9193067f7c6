#include "server/report/stream_playout.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/report/view_painter.h"

namespace strandcast {
namespace {

constexpr size_t kStep = 2;  // frames from state to state
// States before and after a moment that a cubic takes, in frames.
constexpr size_t kReach = kStep + kStep / 2;
constexpr Interpolation kWays[] = {Interpolation::None, Interpolation::Linear, Interpolation::Cubic};

PosedStrands strands_of(const StreamFrame& frame) {
  return {frame.published.world_from_head, frame.position_in_head_m};
}

std::vector<size_t> compared_moments(size_t frame_count, size_t wanted) {
  const size_t count = frame_count - 2 * kReach;
  std::vector<size_t> moments;
  for (size_t i = 0; i < std::min(wanted, count); ++i)
    moments.push_back(kReach + (2 * i + 1) * count / (2 * std::min(wanted, count)));
  return moments;
}

/// What a viewer shows of the moment halfway between the two states around it.
PosedStrands shown(const std::vector<StreamFrame>& frames, size_t moment, Interpolation way) {
  std::array<PosedStrands, 4> states;
  KnotTimes times_ns{};
  for (size_t k = 0; k < states.size(); ++k) {
    const StreamFrame& frame = frames[moment - kReach + kStep * k];
    states[k] = strands_of(frame);
    times_ns[k] = frame.published.sim_time_ns;
  }
  const CubicTerms terms = cubic_terms(times_ns, frames[moment].published.sim_time_ns);
  switch (way) {
    case Interpolation::None:
      return states[1];
    case Interpolation::Linear:
      return blend(states[1], states[2], terms.blend);
    case Interpolation::Cubic:
      return blend({&states[0], &states[1], &states[2], &states[3]}, terms);
  }
  return states[1];
}

double mean_square_m2(const PosedStrands& seen, const PosedStrands& truth) {
  double sum_m2 = 0.0;
  for (size_t i = 0; i < truth.position_m.size(); ++i) {
    const glm::dvec3 off = seen.world_from_head * glm::dvec3(seen.position_m[i]) -
                           truth.world_from_head * glm::dvec3(truth.position_m[i]);
    sum_m2 += glm::dot(off, off);
  }
  return sum_m2 / static_cast<double>(truth.position_m.size());
}

}  // namespace

Result<std::vector<PlayoutRow>> measure_playout(const StreamPlayoutDesc& desc, const SceneDesc& scene,
                                                const StreamRecording& recording) {
  const std::vector<StreamFrame>& frames = recording.frames;
  if (frames.size() <= 2 * kReach)
    return make_error(ErrorCode::BadInput, "{} frames are too few for a cubic (at least {})", frames.size(),
                      2 * kReach + 1);
  const std::vector<size_t> moments = compared_moments(frames.size(), desc.compared_pictures);
  std::vector<PlayoutRow> rows;
  for (const Interpolation way : kWays)
    rows.push_back({recording.motion_name, recording.solver, way, moments.size()});
  ASSIGN_OR_RETURN(const auto painter, ViewPainter::make(scene, desc.size));
  const double share = 1.0 / static_cast<double>(moments.size());
  for (const size_t moment : moments) {
    const PosedStrands exact = strands_of(frames[moment]);
    ASSIGN_OR_RETURN(const HairPicture truth, painter->hair(exact, desc.distance_m));
    for (PlayoutRow& row : rows) {
      const PosedStrands strands = shown(frames, moment, row.interpolation);
      ASSIGN_OR_RETURN(const HairPicture seen, painter->hair(strands, desc.distance_m));
      ASSIGN_OR_RETURN(const PictureError error,
                       picture_error(seen.image, truth.image, either(truth.hair, seen.hair)));
      row.rms_error_m += share * mean_square_m2(strands, exact);
      row.psnr_db += share * error.psnr_db;
      row.ssim += share * error.ssim;
      row.delta_e += share * error.delta_e;
    }
  }
  for (PlayoutRow& row : rows) row.rms_error_m = std::sqrt(row.rms_error_m);
  return rows;
}

}  // namespace strandcast
