// How much is simulated, by what readers see: never too little for a moment, and never back and forth.
#include "server/source/sim_detail.h"
#include "common/base/units.h"

#include <cmath>
#include <random>

namespace strandcast::sim_detail_test {
namespace {

constexpr int64_t kFrameNs = 16'666'667;

DetailDesc by_size() {
  DetailDesc desc;
  desc.mode = kDetailAuto;
  return desc;
}

ReaderSight seen(double hair_px) {
  return {.has_readers = true, .hair_px = hair_px};
}

/// Sights one frame apart, and what came of them.
class Watch {
 public:
  explicit Watch(const DetailDesc& desc) : detail_(desc) {}
  void see(const ReaderSight& sight) {
    time_ns_ += kFrameNs;
    const DetailLevel before = detail_.level();
    const bool has_changed = detail_.update(sight, time_ns_);
    EXPECT_EQ(has_changed, before != detail_.level());
    if (!has_changed) return;
    if (detail_.level() > before) down_ns_.push_back(time_ns_);
    changes_ns_.push_back(time_ns_);
  }
  void see(const ReaderSight& sight, double seconds) {
    for (double s = 0.0; s < seconds; s += 1e-9 * kFrameNs) see(sight);
  }
  DetailLevel level() const { return detail_.level(); }
  const std::string& reason() const { return detail_.reason(); }
  size_t changes() const { return changes_ns_.size(); }
  const std::vector<int64_t>& changes_ns() const { return changes_ns_; }
  const std::vector<int64_t>& down_ns() const { return down_ns_; }

 private:
  SimDetail detail_;
  int64_t time_ns_ = 0;
  std::vector<int64_t> changes_ns_;
  std::vector<int64_t> down_ns_;
};

TEST(SimDetail, LargerHairNeverGetsLess) {
  const DetailDesc desc = by_size();
  EXPECT_EQ(level_for(desc, desc.full_at_px), DetailLevel::Full);
  EXPECT_EQ(level_for(desc, 0.0), DetailLevel::FollowHead);
  EXPECT_EQ(level_for(desc, std::numeric_limits<double>::infinity()), DetailLevel::Full);
  std::set<DetailLevel> levels;
  DetailLevel before = DetailLevel::FollowHead;
  for (double px = 0.0; px < 2.0 * desc.full_at_px; px += 0.5) {
    const DetailLevel level = level_for(desc, px);
    EXPECT_LE(level, before) << px;
    levels.insert(before = level);
  }
  EXPECT_EQ(levels.size(), kDetailLevels) << "every level has its sizes";
  EXPECT_THAT(kLevelShares, testing::ElementsAre(1.0, 0.5, 0.25, 0.125, 0.0625));
}

TEST(SimDetail, AZoomOutGoesThroughAllLevelsAndAZoomInComesBackAtOnce) {
  const DetailDesc desc = by_size();
  Watch watch(desc);
  for (double px = 2.0 * desc.full_at_px; px > 0.01; px *= 0.998) watch.see(seen(px));
  EXPECT_EQ(watch.level(), DetailLevel::FollowHead);
  EXPECT_EQ(watch.changes(), kDetailLevels - 1) << "each once";
  EXPECT_THAT(watch.reason(), testing::HasSubstr("pixels high"));
  watch.see(seen(desc.full_at_px));
  EXPECT_EQ(watch.level(), DetailLevel::Full) << "in the frame in which it is large";
  EXPECT_EQ(watch.reason(), "");
}

TEST(SimDetail, GoesDownALevelAtATimeAndNoSoonerThanAfterAWhile) {
  const DetailDesc desc = by_size();
  Watch watch(desc);
  watch.see(seen(desc.full_at_px));
  watch.see(seen(0.0), 4.5 * desc.settle_s * (kDetailLevels - 1));
  EXPECT_EQ(watch.level(), DetailLevel::FollowHead);
  ASSERT_EQ(watch.changes(), kDetailLevels - 1);
  int64_t before_ns = kFrameNs;
  for (const int64_t time_ns : watch.changes_ns()) {
    EXPECT_GE(static_cast<double>(time_ns - before_ns), 0.99 * desc.settle_s * kSInNs);
    before_ns = time_ns;
  }
}

/// How often hair changes its level that goes slowly from above a threshold to a fifth below and back, and
/// stays for longer than it takes to fall.
size_t changes_about(double share, const DetailDesc& desc) {
  Watch watch(desc);
  for (int i = 0; i < 10; ++i)
    for (const double side : {1.05, 0.8})
      watch.see(seen(side * share * desc.full_at_px), 1.5 * desc.settle_s);
  return watch.changes();
}

TEST(SimDetail, HairAboutAThresholdDoesNotFlicker) {
  DetailDesc desc = by_size();
  for (size_t i = 0; i < std::size(kLevelShares); ++i)
    EXPECT_EQ(changes_about(kLevelShares[i], desc), i) << "down to where it stays, and never up again";
  desc.hysteresis = 0.0;
  for (const double share : kLevelShares) EXPECT_GE(changes_about(share, desc), 18u) << "nothing holds it";
}

TEST(SimDetail, ALeapingReaderIsServedAtItsLargest) {
  const DetailDesc desc = by_size();
  Watch watch(desc);
  // Ten times a second from close to far and back.
  for (int i = 0; i < 3600; ++i) watch.see(seen(i / 3 % 2 == 0 ? 2.0 * desc.full_at_px : 5.0));
  EXPECT_EQ(watch.level(), DetailLevel::Full);
  EXPECT_EQ(watch.changes(), 0u);
}

// Whatever readers do, nothing goes down sooner than a while after anything changed, and they never get less
// than what they see asks for.
TEST(SimDetail, WhateverReadersDoItNeitherFlickersNorFallsShort) {
  const DetailDesc desc = by_size();
  std::mt19937 random(11);
  Watch watch(desc);
  double log_px = 5.0;
  std::normal_distribution<double> step(0.0, 0.05);
  for (int i = 0; i < 20'000; ++i) {
    log_px = std::clamp(log_px + step(random), 0.0, 7.0);
    const double px = std::exp(log_px);
    watch.see(seen(px));
    ASSERT_LE(watch.level(), level_for(desc, px)) << "frame " << i;
  }
  ASSERT_GT(watch.down_ns().size(), 3u);
  for (size_t i = 1; i < watch.down_ns().size(); ++i)
    EXPECT_GE(static_cast<double>(watch.down_ns()[i] - watch.down_ns()[i - 1]),
              0.99 * desc.settle_s * kSInNs);
}

TEST(SimDetail, NobodyThereIsTheCheapestAfterAWhileAndTheFirstReaderGetsAll) {
  const DetailDesc desc;  // as scenes are
  Watch watch(desc);
  const ReaderSight nobody{.has_readers = false, .hair_px = 0.0};
  watch.see(nobody, 0.9 * desc.idle_after_s);
  EXPECT_EQ(watch.level(), DetailLevel::Full);
  watch.see(seen(10.0));
  watch.see(nobody, 0.9 * desc.idle_after_s);
  EXPECT_EQ(watch.level(), DetailLevel::Full) << "the while begins again with who leaves";
  watch.see(nobody, 0.2 * desc.idle_after_s);
  EXPECT_EQ(watch.level(), DetailLevel::FollowHead);
  EXPECT_THAT(watch.reason(), testing::HasSubstr("nobody"));
  watch.see(seen(10.0));
  EXPECT_EQ(watch.level(), DetailLevel::Full) << "small as it is: detail.mode is off";
}

TEST(SimDetail, ScenesThatWantAllOfItGetIt) {
  DetailDesc desc;
  desc.idle = kIdleFull;
  Watch watch(desc);
  watch.see({.has_readers = false, .hair_px = 0.0}, 60.0);
  watch.see(seen(1.0), 60.0);
  EXPECT_EQ(watch.changes(), 0u);
  // Told so while it slept.
  SimDetail detail(DetailDesc{});
  (void)detail.update({.has_readers = false}, 0);
  ASSERT_TRUE(detail.update({.has_readers = false}, 100 * kSInNs));
  detail.change(desc);
  EXPECT_TRUE(detail.update({.has_readers = false}, 101 * kSInNs));
  EXPECT_EQ(detail.level(), DetailLevel::Full);
}

}  // namespace
}  // namespace strandcast::sim_detail_test
