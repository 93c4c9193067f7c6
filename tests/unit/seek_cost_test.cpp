// When a recording needs a keyframe, by what showing a moment of it costs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "common/base/units.h"
#include "server/record/recorder.h"

namespace strandcast::seek_cost_test {
namespace {

/// Seconds at 60 Hz until a keyframe is due.
double due_s(uint64_t vertex_count, double step_cost, bool is_exact) {
  SeekCost cost(true);
  for (int frame = 1;; ++frame) {
    cost.add({is_exact, vertex_count, step_cost});
    if (cost.is_keyframe_due(int64_t{frame} * kSInNs / 60)) return frame / 60.0;
  }
}

/// What is dearest to show is so for no longer than without exact frames, or than the limit says.
TEST(SeekCost, ExactFramesWaitLongerForAKeyframeAndAreShownAsSoon) {
  constexpr uint64_t kVertices = 32'000;
  constexpr double kFrameS = 1.0 / 60.0;
  for (const double step_cost : {1.0, 4.0, 24.0}) {
    const double exact_s = due_s(kVertices, step_cost, true);
    const double other_s = due_s(kVertices, step_cost, false);
    const auto frames_ms = [&](double seconds, double frame_ns) {
      return 60.0 * seconds * kVertices * (frame_ns + step_cost * kRecordStepNs) * kMsPerNs;
    };
    EXPECT_GE(other_s, 2.0) << step_cost;
    EXPECT_LE(exact_s, 4.0 + kFrameS) << step_cost;
    EXPECT_GT(exact_s, 1.05 * other_s) << step_cost;
    EXPECT_LE(frames_ms(exact_s - kFrameS, 0.0),
              std::max(frames_ms(std::min(other_s, 2.0 + kFrameS), kRecordPredictedNs), kRecordSeekMs))
        << step_cost;
  }
  EXPECT_NEAR(due_s(10, 1.0, false), 4.0, kFrameS);
}

}  // namespace
}  // namespace strandcast::seek_cost_test
