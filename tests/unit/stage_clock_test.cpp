// What a stage tells the time by.
#include "server/app/stage_clock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/timex.h>

#include <cstdlib>

namespace strandcast::stage_clock_test {
namespace {

using testing::HasSubstr;

constexpr int64_t kSecondNs = 1'000'000'000;
const Timecode kFilm{{24, 1}};

std::string told(const StageClock& clock, int64_t second) {
  return timecode_text(clock.timecode_at(second * kSecondNs, kFilm));
}
std::string refusal(const std::string& text) {
  const auto clock = StageClock::open(text);
  return clock ? "it opened" : clock.error().to_string();
}

// 29 March 2026, 01:00:00 UTC, when summer begins in the European Union: 20,541 days and an hour after 1970.
TEST(StageClock, LocalTimeJumpsWithSummerAndUtcDoesNot) {
  constexpr int64_t kSummer = 20'541LL * 86'400 + 3600;
  const char* zone = std::getenv("TZ");
  const std::string before = zone == nullptr ? "" : zone;
  ASSERT_EQ(setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3", 1), 0);
  ::tzset();
  EXPECT_EQ(told(StageClock(), kSummer - 1), "01:59:59:00");
  EXPECT_EQ(told(StageClock(), kSummer), "03:00:00:00");
  zone == nullptr ? unsetenv("TZ") : setenv("TZ", before.c_str(), 1);
  ::tzset();
  const StageClock utc = StageClock::open("utc").value();
  EXPECT_EQ(told(utc, kSummer - 1), "00:59:59:00");
  EXPECT_EQ(told(utc, kSummer), "01:00:00:00");
  EXPECT_EQ(told(utc, -1), "23:59:59:00");
  EXPECT_EQ(timecode_text(utc.timecode_at(kSecondNs / 2, kFilm)), "00:00:00:12");
}

// TAI is 37 s ahead of UTC since 2017, as the kernel knows where somebody told it.
TEST(StageClock, TaiIsAheadOfUtcOrRefused) {
  timex state{};
  ASSERT_GE(::adjtimex(&state), 0);
  const auto tai = StageClock::open("tai");
  ASSERT_EQ(tai.ok(), state.tai != 0);
  if (!tai) {
    EXPECT_THAT(tai.error().to_string(), HasSubstr("how far TAI is ahead"));
    return;
  }
  const int64_t ahead_ns = tai->time_ns() - StageClock::open("utc")->time_ns();
  EXPECT_NEAR(static_cast<double>(ahead_ns) * 1e-9, state.tai, 0.5);
}

TEST(StageClock, SaysWhatIsNoClock) {
  EXPECT_THAT(refusal("gps"), HasSubstr("local, utc, tai and /dev/ptpN"));
  EXPECT_THAT(refusal("/dev/no-such-clock"), HasSubstr("/dev/no-such-clock cannot be opened"));
  EXPECT_THAT(refusal("/dev/null"), HasSubstr("/dev/null is no PTP device"));
}

}  // namespace
}  // namespace strandcast::stage_clock_test
