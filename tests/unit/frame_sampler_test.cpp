// Frames of an export at an even rate, and how its numbers are written.
#include "client/export/frame_sampler.h"
#include "client/export/number_text.h"
#include "tests/support/made_states.h"

namespace strandcast::frame_sampler_test {
namespace {

using export_test::kStepNs;
using export_test::positions_at;
using export_test::state_at;

TEST(NumberText, IsShortAndRoundsToTheStep) {
  const auto text = [](double value, int decimals) {
    char digits[kMostDecimalChars];
    return std::string(digits, put_decimal(digits, value, decimals));
  };
  EXPECT_EQ(text(0.0, 4), "0");
  EXPECT_EQ(text(-0.00001, 4), "0");
  EXPECT_EQ(text(-0.00005, 4), "-0.0001");
  EXPECT_EQ(text(12.5, 4), "12.5");
  EXPECT_EQ(text(-12.0203, 4), "-12.0203");
  EXPECT_EQ(text(0.000001, 6), "0.000001");
  EXPECT_EQ(text(9.99999, 4), "10");
  EXPECT_EQ(text(123456.0, 0), "123456");
  EXPECT_LE(text(-999'999'999.123456789, 9).size(), kMostDecimalChars);
}

TEST(FrameSampler, FramesAreEvenAndNeedTheStateAfterTheLaterOne) {
  FrameSampler sampler({{24, 1}, 0.0, {}}, StrandFill());
  uint64_t given = 0;
  for (int i = 0; i < 60; ++i) {
    EXPECT_EQ(sampler.add(state_at(i * kStepNs)), FrameSampler::Outcome::Kept);
    while (const auto frame = sampler.next()) {
      EXPECT_EQ(frame->index, given);
      EXPECT_NEAR(frame->time_s, static_cast<double>(given) / 24.0, 1e-9);
      const double newest_s = static_cast<double>(i) * kStepNs * 1e-9;
      EXPECT_TRUE(given == 0 || frame->time_s < newest_s - 0.5 * kStepNs * 1e-9);
      // Cubics of time are hit but for the lattice, also where the first and last have only a line.
      const auto exact = positions_at(frame->time_s);
      for (size_t v = 0; v < exact.size(); ++v)
        EXPECT_LT(glm::distance(frame->strands.position_m[v], exact[v]), given == 1 ? 1e-4f : 3e-5f) << given;
      ++given;
    }
  }
  sampler.finish();
  while (sampler.next()) ++given;
  EXPECT_EQ(given, static_cast<uint64_t>(59.0 * kStepNs * 1e-9 * 24.0) + 1);
}

TEST(FrameSampler, ARangeIsKeptAndTimeThatBeginsAnewEndsIt) {
  FrameSampler sampler({{30, 1}, 0.1, 0.3}, StrandFill());
  std::vector<double> times;
  int64_t at_ns = 5'000'000'000;  // a server that has run for a while
  while (!sampler.is_done()) {
    sampler.add(state_at(at_ns));
    at_ns += kStepNs;
    while (const auto frame = sampler.next()) times.push_back(frame->time_s);
  }
  ASSERT_EQ(times.size(), 7u);
  EXPECT_NEAR(times.front(), 5.1, 1e-9);
  EXPECT_NEAR(times.back(), 5.3, 1e-9);

  FrameSampler reset({{30, 1}, 0.0, {}}, StrandFill());
  EXPECT_EQ(reset.add(state_at(2 * kStepNs)), FrameSampler::Outcome::Kept);
  EXPECT_EQ(reset.add(state_at(2 * kStepNs)), FrameSampler::Outcome::Repeated);
  EXPECT_EQ(reset.add(state_at(0)), FrameSampler::Outcome::WentBack);
}

}  // namespace
}  // namespace strandcast::frame_sampler_test
