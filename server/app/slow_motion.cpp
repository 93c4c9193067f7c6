#include "server/app/slow_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/units.h"
#include "common/groom/groom.h"
#include "server/app/codec_choice.h"
#include "server/app/server.h"

namespace strandcast {
namespace {

/// Work that takes less of a step's time than this is not what makes the simulation slow.
constexpr double kLittleWork = 0.5;

/// Half as many vertices per strand.
std::string fewer_vertices(const SceneDesc& scene, uint32_t vertex_count) {
  const bool is_file = std::holds_alternative<FileGroomDesc>(scene.groom);
  return fmt::format("groom.{}.vertex_count={}", is_file ? "file" : "procedural", vertex_count / 2);
}

uint32_t vertex_count_of(const SceneDesc& scene) {
  constexpr uint32_t kAssumedOfFiles = 16;
  if (const auto* grown = std::get_if<ProceduralGroomDesc>(&scene.groom)) return grown->vertex_count;
  const uint32_t wanted = std::get<FileGroomDesc>(scene.groom).vertex_count;
  return wanted > 0 ? wanted : kAssumedOfFiles;
}

}  // namespace

SlowMotionWatch::Change SlowMotionWatch::update(double realtime_factor, bool is_paused, int64_t time_ns) {
  if (is_paused) {
    is_slow_ = is_turning_ = false;
    return Change::None;
  }
  const bool is_below = realtime_factor < kSlowFactor;
  if (is_below == is_slow_) {
    is_turning_ = false;
    return Change::None;
  }
  if (!is_turning_) turned_ns_ = time_ns;
  is_turning_ = true;
  if (time_ns - turned_ns_ < kSlowNs) return Change::None;
  is_turning_ = false;
  is_slow_ = is_below;
  return is_slow_ ? Change::Began : Change::Ended;
}

StepWork work_per_step(const SceneDesc& scene, const ServerCounters& now) {
  StepWork work;
  work.simulate_ms = now.sim.step_median_ms;
  const bool is_watched = now.strand_viewers + now.frame_viewers > 0;
  if (!is_watched) return work;
  work.publish_ms = now.sim.read_median_ms + now.sim.quantise_median_ms;
  const double state_ms = now.encode.encode_median_ms;
  if (now.strand_viewers > 0) work.encode_ms = state_ms * states_per_second(scene) / scene.step_rate_hz;
  if (now.frame_viewers > 0)
    work.picture_ms = (now.frames.paint_median_ms + now.frames.encode_median_ms +
                       (now.strand_viewers > 0 ? 0.0 : state_ms)) *
                      std::min(1.0, scene.stream.frame_rate_hz / scene.step_rate_hz);
  return work;
}

std::vector<WayOut> ways_out(const SceneDesc& scene, const StepWork& work) {
  // Those that a person sees least first.
  std::vector<WayOut> ways;
  ways.push_back({fmt::format("stream.strand_rate_hz={:g}", std::round(0.5 * states_per_second(scene))),
                  0.5 * work.encode_ms, true});
  if (scene.substeps > 1) {
    const uint32_t fewer = scene.substeps / 2;
    ways.push_back({fmt::format("substeps={}", fewer),
                    work.simulate_ms * (1.0 - static_cast<double>(fewer) / scene.substeps), true});
  }
  ways.push_back({fmt::format("stream.frame_rate_hz={:g}", 0.5 * scene.stream.frame_rate_hz),
                  0.5 * work.picture_ms, false});
  if (scene.solver.name != kCheapestSolver && work.vertices > 0)
    ways.push_back(
        {fmt::format("solver.name={}", kCheapestSolver),
         work.simulate_ms - kCheapestSolverMsPerVertex * static_cast<double>(work.vertices) * scene.substeps,
         true});
  const double hair_ms = work.simulate_ms + work.publish_ms + work.encode_ms;
  if (const uint32_t vertices = vertex_count_of(scene); vertices / 2 >= kMinVertexCount)
    ways.push_back({fewer_vertices(scene, vertices), 0.5 * hair_ms, false});
  if (const auto* grown = std::get_if<ProceduralGroomDesc>(&scene.groom); grown && grown->strand_count > 1)
    ways.push_back(
        {fmt::format("groom.procedural.strand_count={}", grown->strand_count / 2), 0.5 * hair_ms, false});
  // A step less often: the same as half of everything that a step does.
  ways.push_back({fmt::format("step_rate_hz={:g}", 0.5 * scene.step_rate_hz), 0.5 * hair_ms, false});
  std::erase_if(ways, [&](const WayOut& way) { return way.saved_ms < kLeastSaved * work.total_ms(); });
  std::stable_partition(ways.begin(), ways.end(), [&](const WayOut& way) {
    return work.total_ms() - way.saved_ms <= kMsPerS / scene.step_rate_hz;
  });
  if (ways.size() > kShownWaysOut) ways.resize(kShownWaysOut);
  return ways;
}

std::string slow_motion_text(double realtime_factor, const SceneDesc& scene, const StepWork& work) {
  const std::string pace = realtime_factor < kSlowFactor
                               ? fmt::format("the simulation runs at {:.2f} of real time", realtime_factor)
                               : "the simulation was slower than real time until a moment ago";
  if (work.total_ms() < kLittleWork * kMsPerS / scene.step_rate_hz)
    return fmt::format(
        "Slow motion: {}; its work takes {:.1f} ms a step, a step has {:.1f} ms: other programs hold the "
        "processors.",
        pace, work.total_ms(), kMsPerS / scene.step_rate_hz);
  std::string text = fmt::format(
      "Slow motion: {}; its work takes {:.1f} ms a step on all threads, a step has {:.1f} ms. Cheapest ways "
      "out: ",
      pace, work.total_ms(), kMsPerS / scene.step_rate_hz);
  bool is_first = true;
  for (const WayOut& way : ways_out(scene, work)) {
    text += fmt::format("{}{} ({:.1f} ms less, {})", is_first ? "" : "; ", way.setting, way.saved_ms,
                        way.is_live ? "strandcast-ctl set" : "--set at start");
    is_first = false;
  }
  return text + ".";
}

}  // namespace strandcast
