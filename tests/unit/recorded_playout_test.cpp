// Hair as the server's own solvers move it, with every second state taken away: how far what a viewer shows
// in its place is off.
#include <fmt/format.h>
#include <cmath>

#include "common/replay/interpolation.h"
#include "common/replay/strand_replay.h"
#include "server/report/stream_recording.h"
#include "server/sim/executor/lanes_executor.h"
#include "tests/support/shared_data.h"

namespace strandcast::recorded_playout_test {
namespace {

constexpr StreamSize kSize = {200, 16};
constexpr double kSeconds = 2.0;
constexpr float kQuantumM = 1e-6f;  // what is lost by rounding is no part of this

/// Root mean squares, of the line and of the cubic.
struct Off {
  double line = 0.0;
  double cubic = 0.0;

  void add(double line_off, double cubic_off) {
    line += line_off * line_off;
    cubic += cubic_off * cubic_off;
    ++count;
  }
  Off mean() const {
    const double n = static_cast<double>(count);
    return {std::sqrt(line / n), std::sqrt(cubic / n), count};
  }
  size_t count = 0;
};
struct Measured {
  Off in_head_m, in_world_m, length_m;
  Off strands_in_world_m;  // on the head's line, of both
};

PosedStrands as_received(const StreamFrame& frame) {
  QuantiseInput input;
  input.strand_count = kSize.strand_count;
  input.vertex_count = kSize.vertex_count;
  input.quantum_m = kQuantumM;
  input.position_in_head_m = frame.position_in_head_m;
  input.world_from_head = frame.published.world_from_head;
  StrandFill fill;
  return posed_strands_of(quantise(input).snapshot, fill);
}

Measured halved(const StreamRecording& recording) {
  Measured off;
  const auto& frames = recording.frames;
  for (size_t i = 3; i + 3 < frames.size(); i += 2) {
    std::array<PosedStrands, 4> states;
    for (size_t k = 0; k < states.size(); ++k) states[k] = as_received(frames[i - 3 + 2 * k]);
    const int64_t tick_ns = 16'666'667;
    const KnotTimes times = {0, 2 * tick_ns, 4 * tick_ns, 6 * tick_ns};
    const CubicTerms terms = cubic_terms(times, 3 * tick_ns);
    const PosedStrands line = blend(states[1], states[2], terms.blend);
    const PosedStrands cubic = blend({&states[0], &states[1], &states[2], &states[3]}, terms);
    const StreamFrame& right = frames[i];
    const size_t strands = kSize.strand_count;
    for (size_t v = 0; v < right.position_in_head_m.size(); ++v) {
      const glm::dvec3 at(right.position_in_head_m[v]), on_line(line.position_m[v]),
          on_cubic(cubic.position_m[v]);
      off.in_head_m.add(glm::distance(on_line, at), glm::distance(on_cubic, at));
      const glm::dvec3 in_world = right.published.world_from_head * at;
      off.in_world_m.add(glm::distance(line.world_from_head * on_line, in_world),
                         glm::distance(cubic.world_from_head * on_cubic, in_world));
      off.strands_in_world_m.add(glm::distance(line.world_from_head * on_line, in_world),
                                 glm::distance(line.world_from_head * on_cubic, in_world));
      if (v < strands) continue;
      const auto length = [&](const auto& points) {
        return static_cast<double>(glm::distance(points[v], points[v - strands]));
      };
      off.length_m.add(length(line.position_m) - length(right.position_in_head_m),
                       length(cubic.position_m) - length(right.position_in_head_m));
    }
  }
  return {off.in_head_m.mean(), off.in_world_m.mean(), off.length_m.mean(), off.strands_in_world_m.mean()};
}

Measured measure(const StreamMotion& motion, const std::string& solver, MotionPart part) {
  auto executor = make_lanes_executor();
  EXPECT_TRUE(executor.ok());
  const auto recording = record_strands({motion, kSize, kSeconds, solver, executor->get(), part});
  EXPECT_TRUE(recording.ok()) << recording.error().to_string();
  if (!recording.ok()) return {};
  const Measured off = halved(*recording);
  const auto print = [](const char* what, const Off& of) {
    fmt::print(", {} {:.3f} -> {:.3f} mm ({:.2f})", what, 1e3 * of.line, 1e3 * of.cubic, of.cubic / of.line);
  };
  fmt::print("{} {} {}: line -> cubic, rms", motion.name, solver, to_string(part));
  print("in the head", off.in_head_m);
  print("in the world", off.in_world_m);
  print("there with the head on its line", off.strands_in_world_m);
  print("segments' lengths", off.length_m);
  fmt::print("\n");
  return off;
}

class RecordedPlayout : public testing::TestWithParam<const char*> {};

// The built-in turning head without noise: what smooth motion lets expect.
TEST_P(RecordedPlayout, CubicsAreMuchNearerThanLinesOnASmoothHead) {
  const Measured off = measure(built_in_stream_motions()[1], GetParam(), MotionPart::Median);
  EXPECT_LT(off.in_head_m.cubic, 0.45 * off.in_head_m.line);
  EXPECT_LT(off.in_world_m.cubic, 0.3 * off.in_world_m.line);
  EXPECT_LT(off.in_world_m.cubic, 0.5 * off.strands_in_world_m.cubic) << "the head needs its cubic too";
  EXPECT_LT(off.length_m.cubic, 0.75 * off.length_m.line);
}

// A captured walk, whose head trembles.
TEST_P(RecordedPlayout, CubicsAreNearerThanLinesOnACapturedWalk) {
  const std::filesystem::path file = std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap/cmu_131_03.bvh";
  REQUIRE_SHARED(file);
  const auto motion = load_stream_motion(file, {});
  ASSERT_TRUE(motion.ok()) << motion.error().to_string();
  for (const MotionPart part : kMotionParts) {
    const Measured off = measure(*motion, GetParam(), part);
    EXPECT_LT(off.in_head_m.cubic, 0.6 * off.in_head_m.line) << to_string(part);
    EXPECT_LT(off.in_world_m.cubic, 0.6 * off.in_world_m.line) << to_string(part);
    EXPECT_LT(off.in_world_m.cubic, off.strands_in_world_m.cubic) << "the head needs its cubic too";
    EXPECT_LT(off.length_m.cubic, 0.8 * off.length_m.line) << to_string(part);
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, RecordedPlayout, testing::Values("dftl", "direct_rod"));

}  // namespace
}  // namespace strandcast::recorded_playout_test
