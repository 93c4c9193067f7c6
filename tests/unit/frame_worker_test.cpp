#include "server/encode/frame_worker.h"

#include <atomic>
#include <condition_variable>
#include <map>
#include <set>
#include <thread>

#include "common/pictures/image_codec.h"
#include "common/pictures/jpeg_tiles.h"
#include "tests/support/eventually.h"

namespace strandcast::frame_worker_test {
namespace {

constexpr uint32_t kStrands = 6;
constexpr uint32_t kVertices = 4;
constexpr double kFastHz = 1e6;    // no pause between frames
constexpr double kNeverHz = 1e-6;  // the first frame and no other
constexpr std::chrono::milliseconds kSlowPaint{20};

Snapshot make_state(uint64_t tick) {
  Snapshot snapshot;
  snapshot.tick = tick;
  snapshot.sim_time_ns = static_cast<int64_t>(tick) * 1000;
  snapshot.strand_count = kStrands;
  snapshot.vertex_count = kVertices;
  snapshot.quantum_m = 1e-4f;
  for (uint32_t i = 0; i < 3 * kStrands * kVertices; ++i)
    snapshot.lattice.push_back(static_cast<int32_t>(i * 100 + (tick * (i + 1)) % 17));
  return snapshot;
}

/// What the painters of one test did, and a gate that can hold them inside paint().
struct Studio {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_held = false;
  bool is_inside = false;
  bool is_failing = false;
  bool is_dark = false;
  int paints = 0;
  uint32_t largest_width = 1000;  // of what can be painted
  uint32_t quick_width = 1000;    // of what is painted at once; larger pictures take kSlowPaint
  std::map<uint32_t, int> paints_by_width;
  int painters_made = 0;
  int painters_alive = 0;
  std::set<std::thread::id> threads;
  std::vector<uint64_t> hashes;
  float look = 0.0f;         // exposure of the newest
  float worst_look = 1e9f;   // what cannot be painted begins here
  std::vector<float> looks;  // of the paintings

  template <class Read>
  auto get(Read read) {
    const std::lock_guard lock(mutex);
    return read(*this);
  }
  void hold(bool is_now_held) {
    const std::lock_guard lock(mutex);
    is_held = is_now_held;
    changed.notify_all();
  }
};

class FakePainter : public PicturePainter {
 public:
  explicit FakePainter(Studio& studio) : studio_(studio) {
    const std::lock_guard lock(studio_.mutex);
    studio_.look = 0.0f;
    ++studio_.painters_made;
    ++studio_.painters_alive;
    studio_.threads.insert(std::this_thread::get_id());
  }
  ~FakePainter() override {
    const std::lock_guard lock(studio_.mutex);
    --studio_.painters_alive;
    studio_.threads.insert(std::this_thread::get_id());
  }
  Status set_look(const LookDesc& look) override {
    const std::lock_guard lock(studio_.mutex);
    if (look.exposure >= studio_.worst_look) return make_error(ErrorCode::Unsupported, "too bright");
    studio_.look = look.exposure;
    return {};
  }
  Result<Image> paint(const std::shared_ptr<const Snapshot>& snapshot, const PictureView& view) override {
    std::unique_lock lock(studio_.mutex);
    studio_.threads.insert(std::this_thread::get_id());
    studio_.hashes.push_back(state_hash(*snapshot));
    studio_.is_inside = true;
    studio_.changed.wait(lock, [&] { return !studio_.is_held; });
    studio_.is_inside = false;
    if (studio_.is_failing) return make_error(ErrorCode::Unavailable, "out of paint");
    const auto [width, height] = view.size;
    if (width > studio_.largest_width)
      return make_error(ErrorCode::LimitExceeded, "the canvas has {} columns", studio_.largest_width);
    ++studio_.paints;
    studio_.looks.push_back(studio_.look);
    ++studio_.paints_by_width[width];
    if (width > studio_.quick_width) std::this_thread::sleep_for(kSlowPaint);
    // Another state or camera gives another picture, unless the studio is dark.
    Image image{width, height, std::vector<uint8_t>(static_cast<size_t>(width) * height * 4, 255)};
    const auto level =
        static_cast<uint8_t>(snapshot->tick * 50 + static_cast<uint64_t>(view.camera.offset_m.x * 90) +
                             static_cast<uint64_t>(studio_.look * 40));
    for (size_t i = 0; i < 64 && !studio_.is_dark; i += 4) image.rgba[i] = level;
    return image;
  }

 private:
  Studio& studio_;
};

/// A frame worker with a chain of strand frames to offer.
class FrameWork : public testing::Test {
 protected:
  FrameWork() : encoder_(std::move(*make_strand_encoder("delta"))) {}

  std::unique_ptr<FrameWorker> start(double rate_hz, uint32_t still_periods = 0) {
    FrameWorker::Hooks hooks;
    hooks.sink = [this](uint32_t picture_class, PicturePtr picture) {
      const std::lock_guard lock(mutex_);
      frames_.emplace_back(picture_class, picture->after(0));
    };
    hooks.request_keyframe = [this] { ++requests_; };
    hooks.request_state = [this](int64_t not_before_ns) {
      const std::lock_guard lock(mutex_);
      states_wanted_ns_.push_back(not_before_ns);
    };
    hooks.on_refused = [this](uint32_t picture_class, const Error&) {
      const std::lock_guard lock(mutex_);
      refused_.push_back(picture_class);
    };
    hooks.on_look_refused = [this](uint32_t picture_class, const Error&) {
      const std::lock_guard lock(mutex_);
      refused_looks_.push_back(picture_class);
    };
    hooks.on_failure = [this](const Error&) { ++failures_; };
    return std::make_unique<FrameWorker>(
        std::move(*make_strand_decoder("delta", {kStrands, kVertices})),
        [this]() -> Result<std::unique_ptr<PicturePainter>> {
          if (has_no_gl_) return make_error(ErrorCode::Unavailable, "no OpenGL");
          return std::unique_ptr<PicturePainter>(std::make_unique<FakePainter>(studio_));
        },
        FrameWorkerConfig{rate_hz, still_periods}, std::move(hooks));
  }
  std::vector<std::pair<uint32_t, EncodedFramePtr>> frames() {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  size_t frame_count() { return frames().size(); }
  EncodedFramePtr next_delta() { return encoder_->encode(make_state(++tick_)); }
  EncodedFramePtr keyframe() { return encoder_->encode_for_join(make_state(tick_)).keyframe; }
  /// Waits for the request and answers it as the encode worker does.
  void join_chain(FrameWorker& worker) {
    ASSERT_TRUE(eventually([&] { return requests_ > 0; }));
    requests_ = 0;
    worker.offer(keyframe());
  }
  static std::map<uint32_t, PictureView> one_view() {
    PictureView view;
    view.size = {32, 16};
    return {{1, view}};
  }

  std::unique_ptr<StrandEncoder> encoder_;
  uint64_t tick_ = 0;
  Studio studio_;
  std::atomic<bool> has_no_gl_{false};
  std::atomic<int> requests_{0};
  std::atomic<int> failures_{0};
  std::mutex mutex_;
  std::vector<std::pair<uint32_t, EncodedFramePtr>> frames_;
  std::vector<uint32_t> refused_;  // classes
  std::vector<int64_t> states_wanted_ns_;
  std::vector<uint32_t> refused_looks_;
};

TEST_F(FrameWork, NothingIsDecodedOrMadeWithoutViews) {
  const auto worker = start(kFastHz);
  for (int i = 0; i < 20; ++i) worker->offer(next_delta());
  give_time_to_misbehave();
  EXPECT_FALSE(worker->has_views());
  EXPECT_EQ(worker->counters().decoded, 0u);
  EXPECT_EQ(studio_.get([](Studio& s) { return s.painters_made; }), 0);
  EXPECT_EQ(requests_, 0);
}

TEST_F(FrameWork, DrawsTheDecodedStateForEveryView) {
  const auto worker = start(kFastHz);
  next_delta();
  auto views = one_view();
  views[7].size = {64, 48};
  worker->set_views(views);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 2; }));
  for (const auto& [picture_class, frame] : frames()) {
    const auto header = unpack_frame_header(frame->message);
    ASSERT_TRUE(header);
    EXPECT_EQ(header->opcode, Opcode::JpegFrame);
    EXPECT_EQ(header->sequence, 1u);
    EXPECT_EQ(header->sim_time_ns, 1000);
    const auto image = decode_jpeg(std::span(frame->message).subspan(kFrameHeaderBytes));
    ASSERT_TRUE(image) << image.error().to_string();
    EXPECT_EQ(image->width, views[picture_class].size.width);
    EXPECT_EQ(image->height, views[picture_class].size.height);
  }
  const auto hashes = studio_.get([](Studio& s) { return s.hashes; });
  EXPECT_EQ(std::set<uint64_t>(hashes.begin(), hashes.end()), std::set<uint64_t>{state_hash(make_state(1))});
}

TEST_F(FrameWork, EachDrawingAsksForTheStateOfTheNext) {
  const auto worker = start(kFastHz);
  next_delta();
  const auto wanted = [this] {
    const std::lock_guard lock(mutex_);
    return states_wanted_ns_;
  };
  worker->set_views(one_view());
  join_chain(*worker);
  for (size_t drawn = 1; drawn <= 5; ++drawn) {
    ASSERT_TRUE(eventually([&] { return frame_count() == drawn; }));
    EXPECT_EQ(wanted().size(), drawn);
    worker->offer(next_delta());
  }
  ASSERT_TRUE(eventually([&] { return frame_count() == 6; }));
  EXPECT_LE(wanted().front(), now_ns()) << "pictures without a pause: at once";
}

TEST_F(FrameWork, AStateIsNotWantedBeforeItsPictureIsDue) {
  const auto worker = start(kNeverHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  const std::lock_guard lock(mutex_);
  ASSERT_EQ(states_wanted_ns_.size(), 1u);
  constexpr int64_t kHourNs = 3'600'000'000'000;
  EXPECT_GT(states_wanted_ns_[0], now_ns() + kHourNs);
}

TEST_F(FrameWork, TellsWhichDrawingsWereTheFirstWithAMotionSample) {
  const auto worker = start(kFastHz);
  const auto offer = [&](int64_t motion_time_ns) {
    Snapshot state = make_state(++tick_);
    state.motion_time_ns = motion_time_ns;
    return encoder_->encode(state);
  };
  offer(0);
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  EXPECT_TRUE(worker->take_motions().empty()) << "there was none";
  size_t drawn = 1;
  for (const int64_t motion_time_ns : {500, 500, 900}) {
    worker->offer(offer(motion_time_ns));
    ++drawn;
    ASSERT_TRUE(eventually([&] { return frame_count() == drawn; }));
  }
  EXPECT_EQ(worker->take_motions(), (std::vector<PictureMotion>{{2000, 500}, {4000, 900}}))
      << "not what is held";
  EXPECT_TRUE(worker->take_motions().empty()) << "each once";
}

TEST_F(FrameWork, WithoutANewStateNothingIsDrawnAgainUnlessTheCameraMoves) {
  const auto worker = start(kFastHz);
  next_delta();
  auto views = one_view();
  worker->set_views(views);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  worker->set_views(views);
  give_time_to_misbehave();
  EXPECT_EQ(frame_count(), 1u);
  views[1].camera.offset_m.x += 0.5f;
  worker->set_views(views);
  ASSERT_TRUE(eventually([&] { return frame_count() == 2; }));
  EXPECT_EQ(frames()[1].second->header.sequence, 2u);
}

LookDesc exposed(float exposure) {
  LookDesc look;
  look.exposure = exposure;
  return look;
}

TEST_F(FrameWork, AnotherLookDrawsTheSameStateAgainWithoutANewPainterOrAKeyframe) {
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  for (const float exposure : {1.0f, 2.0f}) worker->set_look(exposed(exposure));
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.looks.back(); }) == 2.0f; }));
  ASSERT_TRUE(eventually([&] { return frame_count() >= 2; }));
  EXPECT_EQ(studio_.get([](Studio& s) { return s.painters_made; }), 1);
  EXPECT_EQ(requests_, 0) << "no keyframe";
  // Whoever comes back when nobody watched meanwhile sees the newest, too.
  worker->set_views({});
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.painters_alive; }) == 0; }));
  worker->set_look(exposed(3.0f));
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.looks.back(); }) == 3.0f; }));
  EXPECT_EQ(studio_.get([](Studio& s) { return s.looks.back(); }), 3.0f);
}

// Without that time each painter ends with the last view, as above.
TEST_F(FrameWork, APainterRestsForWhoLooksAway) {
  const auto alive = [&] { return studio_.get([](Studio& s) { return s.painters_alive; }); };
  const auto worker = start(kFastHz);
  for (int round = 0; round < 2; ++round) {
    const size_t before = frame_count();
    worker->set_views(one_view());
    ASSERT_TRUE(eventually([&] {
      next_delta();
      worker->offer(keyframe());
      return frame_count() > before;
    }));
    worker->set_views({}, kPainterRestNs);
    give_time_to_misbehave();
  }
  EXPECT_EQ(studio_.get([](Studio& s) { return s.painters_made; }), 1) << "the second time it is the same";
  EXPECT_EQ(alive(), 1);
  worker->set_views({});
  EXPECT_TRUE(eventually([&] { return alive() == 0; })) << "nobody is awaited any more";
}

TEST_F(FrameWork, APainterRestsForAWhileOnly) {
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  worker->set_views({}, 1'000'000);
  EXPECT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.painters_alive; }) == 0; }));
}

TEST_F(FrameWork, WhoLooksAwayAndBackWithinADrawingJoinsTheChainAnew) {
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  studio_.hold(true);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.is_inside; }); }));
  worker->set_views({}, kPainterRestNs);
  worker->offer(next_delta());  // nobody wants it
  worker->set_views(one_view());
  worker->offer(next_delta());
  studio_.hold(false);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] {
    const auto given = frames();
    return !given.empty() && given.back().second->header.sim_time_ns == 3000;
  }));
  EXPECT_EQ(worker->counters().chain_losses, 0u) << "it is no fault, and nothing is logged";
}

TEST_F(FrameWork, ALookThatCannotBeDrawnIsToldAndTheOneBeforeStays) {
  studio_.worst_look = 5.0f;
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  worker->set_look(exposed(2.0f));
  ASSERT_TRUE(eventually(
      [&] { return studio_.get([](Studio& s) { return !s.looks.empty() && s.looks.back() == 2.0f; }); }));
  worker->set_look(exposed(7.0f));
  const auto told = [&] {
    const std::lock_guard lock(mutex_);
    return refused_looks_;
  };
  ASSERT_TRUE(eventually([&] { return !told().empty(); }));
  EXPECT_EQ(told(), std::vector<uint32_t>{1});
  worker->offer(next_delta());
  ASSERT_TRUE(eventually([&] { return worker->counters().decoded >= 2; }));
  give_time_to_misbehave();
  EXPECT_EQ(studio_.get([](Studio& s) { return s.looks.back(); }), 2.0f);
  EXPECT_FALSE(worker->failure());
  // A painter that is made anew has it as well.
  worker->set_views({});
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.painters_alive; }) == 0; }));
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.painters_made; }) == 2; }));
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.looks.back(); }) == 2.0f; }));
  give_time_to_misbehave();
  EXPECT_EQ(studio_.get([](Studio& s) { return s.looks.back(); }), 2.0f);
  EXPECT_EQ(told().size(), 1u) << "told once";
}

TEST_F(FrameWork, TheFrameRateIsALimitAndTheDecoderKeepsUp) {
  const auto worker = start(kNeverHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  for (int i = 0; i < 10; ++i) worker->offer(next_delta());
  ASSERT_TRUE(eventually([&] { return worker->counters().decoded == 11; }));
  EXPECT_EQ(frame_count(), 1u);
  auto views = one_view();
  views[2].size = {48, 48};
  worker->set_views(views);  // a new viewer need not wait for the old one's turn
  ASSERT_TRUE(eventually([&] { return frame_count() == 2; }));
  EXPECT_EQ(frames()[1].second->header.sim_time_ns, 11'000);
}

TEST_F(FrameWork, ASlowPainterHoldsUpNobodyAndRejoinsTheChain) {
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  studio_.hold(true);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.is_inside; }); }));
  for (int i = 0; i < 1000; ++i) worker->offer(next_delta());  // returns although nothing is taken
  studio_.hold(false);
  join_chain(*worker);  // too many to keep: a keyframe is asked for
  ASSERT_TRUE(eventually([&] {
    const auto given = frames();
    return !given.empty() && given.back().second->header.sim_time_ns == 1'001'000;
  }));
  EXPECT_EQ(worker->counters().chain_losses, 1u);
}

TEST_F(FrameWork, AKeyframeCrowdedOutOfTheQueueIsAskedForAgain) {
  const auto worker = start(kFastHz);
  next_delta();
  auto views = one_view();
  worker->set_views(views);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  next_delta();  // lost on the way
  worker->offer(next_delta());
  ASSERT_TRUE(eventually([&] { return requests_ > 0; }));
  studio_.hold(true);
  views[1].camera.offset_m.y += 0.5f;
  worker->set_views(views);
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.is_inside; }); }));
  requests_ = 0;
  worker->offer(keyframe());
  for (int i = 0; i < 400; ++i) worker->offer(next_delta());
  studio_.hold(false);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frames().back().second->header.sim_time_ns == 403'000; }));
}

TEST_F(FrameWork, BrokenStrandFramesCostAKeyframeAndNothingElse) {
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  auto broken = std::make_shared<EncodedFrame>(*next_delta());
  broken->message.back() ^= std::byte{0x55};
  broken->message[kFrameHeaderBytes] ^= std::byte{0xff};
  worker->offer(broken);
  worker->offer(next_delta());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frames().back().second->header.sim_time_ns == 3000; }));
  EXPECT_EQ(worker->counters().chain_losses, 1u);
}

TEST_F(FrameWork, ThePainterLivesWithTheViewsOnOneThread) {
  const auto worker = start(kFastHz);
  next_delta();
  for (int round = 1; round <= 3; ++round) {
    worker->set_views(one_view());
    join_chain(*worker);
    ASSERT_TRUE(eventually([&] { return frame_count() == static_cast<size_t>(round); }));
    worker->set_views({});
    ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.painters_alive; }) == 0; }));
    requests_ = 0;
  }
  EXPECT_EQ(studio_.get([](Studio& s) { return s.painters_made; }), 3);
  const auto threads = studio_.get([](Studio& s) { return s.threads; });
  EXPECT_EQ(threads.size(), 1u);
  EXPECT_FALSE(threads.contains(std::this_thread::get_id()));
}

TEST_F(FrameWork, NoGlIsReportedOnceAndTheRestLivesOn) {
  has_no_gl_ = true;
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return failures_ == 1; }));
  ASSERT_TRUE(worker->failure());
  EXPECT_EQ(worker->failure()->message, "no OpenGL");
  EXPECT_FALSE(worker->has_views());
  worker->set_views(one_view());
  for (int i = 0; i < 5; ++i) worker->offer(next_delta());
  give_time_to_misbehave();
  EXPECT_EQ(failures_, 1);
  EXPECT_EQ(frame_count(), 0u);
}

TEST_F(FrameWork, AViewThatCannotBeDrawnCostsTheOthersNothing) {
  const auto worker = start(kFastHz);
  next_delta();
  auto views = one_view();
  views[2] = views[1];
  views[2].size.width = 1016;
  worker->set_views(views);
  join_chain(*worker);
  const auto refused = [&] {
    const std::lock_guard lock(mutex_);
    return refused_;
  };
  ASSERT_TRUE(eventually([&] { return refused().size() == 1 && frame_count() == 1; }));
  EXPECT_EQ(refused()[0], 2u);
  worker->offer(next_delta());
  ASSERT_TRUE(eventually([&] { return frame_count() == 2; }));
  EXPECT_EQ(refused().size(), 1u) << "it is not tried at every state";
  EXPECT_FALSE(worker->failure());
  views[2].size.width = 1000;
  worker->set_views(views);
  ASSERT_TRUE(eventually([&] { return frame_count() == 3; })) << "another view of that class may do";
  EXPECT_EQ(frames().back().first, 2u);
  EXPECT_EQ(failures_, 0);
}

TEST_F(FrameWork, AnUnchangedPictureIsNotSent) {
  studio_.is_dark = true;
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  worker->offer(next_delta());
  ASSERT_TRUE(eventually([&] { return worker->counters().unchanged == 1; }));
  EXPECT_EQ(frame_count(), 1u);
  EXPECT_EQ(worker->counters().paints, 2u);
}

TEST_F(FrameWork, WhatStandsStillIsSentOnceMoreFinely) {
  const auto worker = start(kFastHz, 5);
  next_delta();
  auto views = one_view();
  views[1].codec = PictureCodec::JpegTiles;
  views[1].quality = 30;
  worker->set_views(views);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return worker->counters().stills == 1; }));
  ASSERT_TRUE(eventually([&] { return frame_count() == 2; }));
  EXPECT_EQ(static_cast<int>(frames()[1].second->message[kFrameHeaderBytes + kTilesFixedBytes + 2]),
            kStillQuality);
  EXPECT_EQ(worker->counters().paints, 1u) << "nothing is drawn for it";
  give_time_to_misbehave();
  EXPECT_EQ(frame_count(), 2u);
  worker->offer(next_delta());
  ASSERT_TRUE(eventually([&] { return worker->counters().stills == 2; })) << "after every change";
}

// A view that is drawn more rarely than pictures are refined: the state that is to be drawn next has not
// been.
TEST_F(FrameWork, AStillIsOfTheStateThatWasDrawnAndOfNoOlderThanTheNewest) {
  const auto worker = start(10.0, 5);
  auto views = one_view();
  views[1].rate_divisor = 8;
  next_delta();
  worker->set_views(views);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  worker->offer(next_delta());
  ASSERT_TRUE(eventually([&] { return frame_count() == 3; }));
  EXPECT_EQ(worker->counters().stills, 1u);
  const int64_t first_ns = make_state(1).sim_time_ns, next_ns = make_state(2).sim_time_ns;
  using Mark = std::pair<int64_t, int>;
  std::vector<Mark> marks;
  for (const auto& [picture_class, frame] : frames())
    marks.emplace_back(frame->header.sim_time_ns, frame->header.flags);
  EXPECT_EQ(marks, (std::vector<Mark>{{first_ns, 0}, {next_ns, 0}, {next_ns, kStillPicture}}));
}

TEST_F(FrameWork, AStillWaitsForItsPeriods) {
  const auto worker = start(kNeverHz, 5);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  give_time_to_misbehave();
  EXPECT_EQ(frame_count(), 1u);
}

TEST_F(FrameWork, ClassesThatLookAlikeAreDrawnOnceAndEncodedOnceEach) {
  const auto worker = start(kFastHz);
  next_delta();
  auto views = one_view();
  views[2] = views[1];
  views[2].quality = 30;
  views[3] = views[1];
  views[3].codec = PictureCodec::Vp8;
  views[4] = views[1];
  views[4].size = {64, 48};
  worker->set_views(views);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 4; }));
  for (size_t i = 1; i <= 3; ++i) {
    worker->offer(next_delta());
    ASSERT_TRUE(eventually([&] { return frame_count() == 4 * (i + 1); }));
  }
  EXPECT_EQ(worker->counters().frames, 16u);
  EXPECT_EQ(worker->counters().paints, 8u);
}

TEST_F(FrameWork, AWholePictureIsGivenAgainOnRequest) {
  const auto worker = start(kNeverHz);
  next_delta();
  auto views = one_view();
  views[1].codec = PictureCodec::JpegTiles;
  worker->set_views(views);
  worker->request_whole(1);
  worker->request_whole(99);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  worker->request_whole(1);
  ASSERT_TRUE(eventually([&] { return frame_count() == 2; }));
  EXPECT_EQ(frames()[1].second->header.sequence, 1u);
  EXPECT_EQ(worker->counters().frames, 1u) << "nothing is encoded for it";
  EXPECT_EQ(worker->counters().wholes, 1u);
  EXPECT_EQ(worker->counters().paints, 1u);
}

TEST_F(FrameWork, AnotherSizeOrCodecGoesOnWithTheNumbersOfTheClass) {
  const auto worker = start(kFastHz);
  next_delta();
  auto views = one_view();
  views[1].codec = PictureCodec::JpegTiles;
  worker->set_views(views);
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return frame_count() == 1; }));
  views[1].size = {64, 48};
  worker->set_views(views);
  ASSERT_TRUE(eventually([&] { return frame_count() == 2; }));
  views[1].codec = PictureCodec::Vp8;
  worker->set_views(views);
  ASSERT_TRUE(eventually([&] { return frame_count() == 3; }));
  for (uint32_t i = 0; i < 3; ++i) EXPECT_EQ(frames()[i].second->header.sequence, i + 1);
  EXPECT_EQ(frames()[2].second->header.opcode, Opcode::Vp8Frame);
}

// Both wait for a turn all the time: taking turns one by one would give each as many.
TEST_F(FrameWork, AViewThatTakesLongIsDrawnMoreRarelyThanOneThatDoesNot) {
  studio_.quick_width = 100;
  const auto worker = start(kFastHz);
  next_delta();
  auto views = one_view();
  views[2].size = {112, 16};
  worker->set_views(views);
  join_chain(*worker);
  const auto paints = [&](uint32_t width) {
    return studio_.get([&](Studio& s) { return s.paints_by_width[width]; });
  };
  ASSERT_TRUE(eventually([&] {
    worker->offer(next_delta());
    if (requests_.exchange(0) > 0) worker->offer(keyframe());
    return paints(112) >= 8;
  }));
  EXPECT_GE(paints(32), 3 * paints(112));
}

TEST_F(FrameWork, AFailedDrawingEndsFramesToo) {
  studio_.is_failing = true;
  const auto worker = start(kFastHz);
  next_delta();
  worker->set_views(one_view());
  join_chain(*worker);
  ASSERT_TRUE(eventually([&] { return worker->failure().has_value(); }));
  ASSERT_TRUE(eventually([&] { return studio_.get([](Studio& s) { return s.painters_alive; }) == 0; }));
}

}  // namespace
}  // namespace strandcast::frame_worker_test
