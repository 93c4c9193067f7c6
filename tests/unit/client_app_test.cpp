// What the client's programs keep and how they stop, without a server.
#include <atomic>
#include <csignal>

#include "client/app/clip_store.h"
#include "client/app/mode_control.h"
#include "client/app/notice_list.h"
#include "client/app/scenario/scenario_run.h"
#include "client/app/stop_signal.h"
#include "client/app/stream_check.h"
#include "common/base/units.h"

namespace strandcast::client_app_test {
namespace {

std::shared_ptr<const Snapshot> state_at(int64_t sim_time_ns, size_t lattice_values) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->sim_time_ns = sim_time_ns;
  snapshot->lattice.resize(lattice_values);
  return snapshot;
}

Image image_of(uint32_t width, uint32_t height) {
  return {width, height, std::vector<uint8_t>(size_t{4} * width * height)};
}

TEST(ClipStore, KeepsStatesAtAnEvenRateUntilTheClipHasItsLength) {
  ClipStore clip(10.0, 0.5);
  for (int64_t i = 0; i < 100 && !clip.is_full(); ++i) clip.add(state_at(i * 20 * kMsInNs, 3));
  ASSERT_EQ(clip.snapshots().size(), 5u);
  for (size_t i = 0; i < 5; ++i)
    EXPECT_EQ(clip.snapshots()[i]->sim_time_ns, static_cast<int64_t>(i) * 100 * kMsInNs);
  EXPECT_FALSE(clip.is_cut());
}

TEST(ClipStore, KeepsNoMoreBytesThanItsLimit) {
  constexpr uint64_t kLimit = 1000;
  ClipStore exact(10.0, 60.0, kLimit);
  ClipStore over(10.0, 60.0, kLimit - 1);
  for (int64_t i = 0; i < 100; ++i)
    for (ClipStore* clip : {&exact, &over}) clip->add(state_at(i * 100 * kMsInNs, 50));
  EXPECT_EQ(exact.snapshots().size(), 5u) << "five times 50 numbers of 4 bytes";
  EXPECT_EQ(over.snapshots().size(), 4u);
  EXPECT_TRUE(exact.is_cut() && exact.is_full());
  EXPECT_TRUE(over.is_cut() && over.is_full());

  ClipStore pictures(10.0, 60.0, 5 * 4 * 8 * 8);
  for (int64_t i = 0; i < 100; ++i) pictures.add(image_of(8, 8), i * 100 * kMsInNs);
  EXPECT_EQ(pictures.images().size(), 5u);
}

TEST(ClipStore, KeepsPicturesOfOneSize) {
  ClipStore clip(10.0, 1.0);
  for (int64_t i = 0; i < 20; ++i) clip.add(i % 2 == 0 ? image_of(8, 6) : image_of(4, 3), i * 100 * kMsInNs);
  ASSERT_EQ(clip.images().size(), 10u);
  for (const Image& image : clip.images()) EXPECT_EQ(image.width, 8u);
}

TEST(LineBudget, LetsSoManyLinesThroughInASecondAndCountsTheOthers) {
  LineBudget lines;
  uint32_t written = 0;
  for (int64_t i = 0; i < 1000; ++i) written += lines.take(i * kMsInNs) ? 1 : 0;
  EXPECT_EQ(written, kMaxForeignLinesPerS);
  EXPECT_EQ(lines.take_left_out(), 1000u - kMaxForeignLinesPerS);
  EXPECT_EQ(lines.take_left_out(), 0u);
  EXPECT_TRUE(lines.take(1000 * kMsInNs)) << "the next second";
}

TEST(LineBudget, NoSecondHasMoreWhereverItBegins) {
  LineBudget lines;
  std::vector<int64_t> written_ns;
  // Nothing for long, then all at once: at the end of one second of a clock and the begin of the next.
  for (int64_t i = 0; i < 3000; ++i)
    if (i % 1000 >= 900 || i % 1000 < 100)
      if (lines.take(i * kMsInNs)) written_ns.push_back(i * kMsInNs);
  ASSERT_GT(written_ns.size(), kMaxForeignLinesPerS);
  for (size_t i = kMaxForeignLinesPerS; i < written_ns.size(); ++i)
    EXPECT_GE(written_ns[i] - written_ns[i - kMaxForeignLinesPerS], 1000 * kMsInNs);
}

TEST(NoticeList, TheOldestGiveWay) {
  NoticeList list;
  for (size_t i = 0; i < kMaxWaitingNotices + 3; ++i) list.add({false, std::to_string(i)});
  const auto taken = list.take();
  ASSERT_EQ(taken.size(), kMaxWaitingNotices);
  EXPECT_EQ(taken.front().text, "3");
  EXPECT_TRUE(list.take().empty());
}

TEST(TickHashes, KeepTheNewestAlsoWhenTicksBeginAgain) {
  TickHashes hashes(3);
  for (const uint64_t tick : {100u, 101u, 102u, 0u, 1u}) hashes.add({tick, 0}, tick + 7);
  hashes.add({1, 0}, 9);
  EXPECT_EQ(hashes.hash_by_key().size(), 3u);
  EXPECT_FALSE(hashes.find({101, 0}));
  EXPECT_FALSE(hashes.find({102, 1})) << "another stream";
  EXPECT_FALSE(hashes.find({102, 0, 1})) << "told again to a joiner";
  EXPECT_EQ(hashes.find({102, 0}), 109u);
  EXPECT_EQ(hashes.find({1, 0}), 9u) << "again: the newer counts";
}

Welcome welcome_to(StreamMode mode) {
  Welcome welcome;
  welcome.mode = mode;
  welcome.mode_reason = "at first";
  return welcome;
}

TEST(ModeControl, AWishIsTakenOnceAndGivenBackWhenItCouldNotBeSent) {
  ModeControl modes(StreamMode::Auto);
  modes.begin_session(StreamMode::Auto, welcome_to(StreamMode::Strands));
  EXPECT_FALSE(modes.take_request()) << "the Hello has said it";
  modes.want(StreamMode::Frames);
  EXPECT_EQ(modes.take_request(), StreamMode::Frames);
  EXPECT_FALSE(modes.take_request());
  modes.give_back_request();
  modes.want(StreamMode::Strands);
  EXPECT_EQ(modes.take_request(), StreamMode::Strands) << "of several the newest";
  modes.want(StreamMode::Strands);
  EXPECT_EQ(modes.take_request(), StreamMode::Strands) << "a person may ask again";
}

TEST(ModeControl, AWishThatCameBetweenTwoSessionsIsTold) {
  ModeControl modes(StreamMode::Auto);
  modes.begin_session(StreamMode::Auto, welcome_to(StreamMode::Strands));
  modes.want(StreamMode::Frames);  // while the next session is being opened with the old wish
  modes.begin_session(StreamMode::Auto, welcome_to(StreamMode::Strands));
  EXPECT_FALSE(modes.look().is_answered);
  EXPECT_EQ(modes.take_request(), StreamMode::Frames);
  modes.begin_session(StreamMode::Frames, welcome_to(StreamMode::Frames));
  EXPECT_FALSE(modes.take_request()) << "this Hello has said it";
  EXPECT_TRUE(modes.look().is_answered);
}

TEST(ModeControl, TellsWhatWasAskedWhatWasGivenAndWhatIsShownApart) {
  ModeControl modes(StreamMode::Auto);
  modes.begin_session(StreamMode::Auto, welcome_to(StreamMode::Strands));
  EXPECT_EQ(modes.look().wish(), "auto");
  EXPECT_EQ(modes.look().reason, "at first");
  modes.want(StreamMode::Frames);
  EXPECT_EQ(modes.look().wish(), "frames, asking the server");
  (void)modes.take_request();
  modes.note_answer({StreamMode::Frames, "asked for", 64, 36});
  EXPECT_EQ(modes.look().given, StreamMode::Frames);
  EXPECT_EQ(modes.look().shown, StreamMode::Strands) << "until the first picture is decoded";
  EXPECT_EQ(modes.look().wish(), "frames, not here yet");
  EXPECT_TRUE(modes.note_shown(StreamMode::Frames));
  EXPECT_FALSE(modes.note_shown(StreamMode::Frames));
  EXPECT_EQ(modes.look().changes, 1u);
  EXPECT_EQ(modes.look().wish(), "frames");
  modes.want(StreamMode::Strands);
  (void)modes.take_request();
  modes.note_answer({StreamMode::Frames, "no strands today", 64, 36});
  EXPECT_EQ(modes.look().wish(), "strands, not to be had");
  EXPECT_EQ(modes.look().reason, "no strands today");
}

/// A program that is in the middle of something that looks at nothing.
[[noreturn]] void stop_while_busy() {
  const auto& stop = catch_stop_signals();
  std::raise(SIGTERM);
  if (!stop) std::_Exit(1);
  for (std::atomic<uint64_t> turns{0};;) turns.fetch_add(1);
}

TEST(FindMetric, OfSeveralHeadsIsThatOfEach) {
  const std::string text =
      "# HELP a_total what it is\na_total{head=\"main\"} 0\na_total{head=\"my \\\"ben\\\"\"} 3\n"
      "a_total_b 7\nb{head=\"main\",kind=\"k\"} 1\n";
  using Values = std::vector<double>;
  EXPECT_EQ(find_metric(text, "a_total"), (Values{0.0, 3.0}));
  EXPECT_EQ(find_metric(text, "a_total{head=\"main\"}"), Values{0.0});
  EXPECT_EQ(find_metric(text, "a_total_b"), Values{7.0});
  EXPECT_EQ(find_metric(text, "b"), Values{}) << "its labels are part of its name";
  EXPECT_EQ(find_metric(text, "b{head=\"main\",kind=\"k\"}"), Values{1.0});
}

TEST(StopSignal, EndsAProgramThatDoesNotLookInTime) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(stop_while_busy(), testing::KilledBySignal(SIGTERM), "stopped in the middle");
}

TEST(StopSignal, ASecondOneEndsItAtOnce) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        catch_stop_signals();
        std::raise(SIGINT);
        std::raise(SIGINT);
        std::_Exit(1);
      },
      testing::KilledBySignal(SIGINT), "");
}

}  // namespace
}  // namespace strandcast::client_app_test
