// Pictures from a whole server to viewers and raw clients: joining in the middle, requests, drops, idle
// stills, one encode for many, and slow links.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "client/app/view_report.h"
#include "common/chaos/chaos_relay.h"
#include "tests/support/server_fixture.h"
#include "tests/support/sim_devices.h"
#include "tests/support/test_pictures.h"

namespace strandcast::picture_stream_test {
namespace {

SceneDesc windy_scene(RenderSize size = {160, 120}) {
  SceneDesc scene = test::bald_scene();
  scene.wind.mean_mps = {3.0f, 0.0f, 1.0f};
  scene.wind.gust_intensity = 0.4f;
  scene.stream.frame_width = size.width;
  scene.stream.frame_height = size.height;
  scene.stream.frame_rate_hz = 30.0;
  return scene;
}

/// Lines that wave from state to state, which cost little to draw: many pictures come on a busy machine too.
class LinesPainter : public PicturePainter {
 public:
  Result<Image> paint(const std::shared_ptr<const Snapshot>& snapshot, const PictureView& view) override {
    return test::waving_lines(view.size.width, view.size.height, 0.1 * static_cast<double>(snapshot->tick));
  }
};
MakePicturePainter lines_painter(const PainterConfig&) {
  return []() -> Result<std::unique_ptr<PicturePainter>> {
    return std::unique_ptr<PicturePainter>(std::make_unique<LinesPainter>());
  };
}

class PictureStream : public test::ServerFixture {
 protected:
  using ServerFixture::start;
  [[nodiscard]] bool start() { return start(windy_scene()); }
  std::unique_ptr<ViewerSession> join(PictureCodec codec, uint16_t port = 0) {
    ClientConfig config = client_config(StreamMode::Frames, Role::Viewer, port);
    config.hello.picture_codecs = codec_bit(codec);
    return open(config);
  }
  void command(Command what) { ASSERT_EQ(run_command(ctl_target(), ControlCommand{what}), kDoneExit); }
};

TEST_F(PictureStream, EveryCodecIsGivenToWhoDecodesIt) {
  if (!start()) return;
  for (const PictureCodec codec : kPictureCodecs) {
    if ((encodable_picture_codecs() & codec_bit(codec)) == 0) continue;
    const auto viewer = join(codec);
    ASSERT_NE(viewer, nullptr);
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->image_count() >= 5; })) << to_string(codec);
    ASSERT_TRUE(viewer->frame_quality().has_value());
    EXPECT_EQ(viewer->frame_quality()->codec, codec);
    EXPECT_EQ(viewer->frame_quality()->width, 160u);
    EXPECT_EQ(viewer->image()->width, 160u);
    EXPECT_EQ(viewer->picture_stats().rejected_frames, 0u);
    // Whole JPEGs all stand alone; of the others only the first.
    EXPECT_EQ(viewer->picture_stats().whole_frames == viewer->image_count(), codec == PictureCodec::Jpeg);
  }
}

TEST_F(PictureStream, AViewerKnowsHowLateMotionIs) {
  if (!start()) return;
  const auto viewer = join(PictureCodec::JpegTiles);
  ASSERT_NE(viewer, nullptr);
  const auto source = ViewerClient::connect(client_config(StreamMode::Frames, Role::Source));
  ASSERT_TRUE(source) << source.error().to_string();
  int64_t sent_ns = 0;
  const auto feed = [&] {
    constexpr int64_t kPauseNs = 10'000'000;
    if (now_ns() - sent_ns < kPauseNs) return;
    sent_ns = now_ns();
    Pose pose;
    pose.position_m.x = 1e-12 * static_cast<double>(sent_ns % 1'000'000'000);
    ASSERT_TRUE((*source)->send(MotionSamples{{{sent_ns, pose}}}));
  };
  const int64_t begin_ns = now_ns();
  EXPECT_TRUE(pump_until({viewer.get()}, [&] {
    feed();
    return viewer->motion_latency_timer().count() >= 5;
  }));
  const double longest_ms = viewer->motion_latency_timer().quantile_ms(1.0);
  EXPECT_GT(longest_ms, 0.0);
  EXPECT_LT(longest_ms, static_cast<double>(now_ns() - begin_ns) * 1e-6)
      << "no sample is older than the first";
  const ViewReport report = make_report(*viewer);
  const auto line = std::find_if(report.begin(), report.end(),
                                 [](const ReportEntry& entry) { return entry.key == "motion_samples_seen"; });
  ASSERT_NE(line, report.end());
  EXPECT_GE(std::stoi(line->text), 5);
}

TEST_F(PictureStream, ManyViewersOfOneClassCostOneEncodePerPicture) {
  if (!start()) return;
  std::vector<std::unique_ptr<ViewerSession>> viewers;
  std::vector<ViewerSession*> sessions;
  for (int i = 0; i < 6; ++i) {
    viewers.push_back(join(PictureCodec::JpegTiles));
    ASSERT_NE(viewers.back(), nullptr);
    sessions.push_back(viewers.back().get());
  }
  const auto least = [&] {
    uint64_t count = UINT64_MAX;
    for (const ViewerSession* session : sessions) count = std::min(count, session->image_count());
    return count;
  };
  ASSERT_TRUE(pump_until(sessions, [&] { return least() >= 20; }));
  const FrameCounters counters = server_->counters().frames;
  // One drawing and one encode for each picture, whoever watches; a drawing may be under way. On a busy
  // machine a viewer may have stepped down, into a class of its own.
  const uint64_t classes = 1 + server_->counters().net.class_changes;
  EXPECT_LE(counters.frames + counters.unchanged, classes * (counters.paints + counters.stills + 1));
  uint64_t received = 0;
  for (const ViewerSession* session : sessions) received += session->image_count();
  EXPECT_GT(received, counters.frames) << "each picture went to many";
}

// Where their turns fall together: two that joined half a period apart may go on so.
TEST_F(PictureStream, TwoCodecsOfOneViewAreDrawnOnce) {
  constexpr int kTries = 6;
  if (!start()) return;
  double share = 1.0;  // of the frames that were drawn
  for (int i = 0; i < kTries && share >= 0.75; ++i) {
    const auto tiles = join(PictureCodec::JpegTiles);
    const auto video = join(PictureCodec::Vp8);
    ASSERT_TRUE(tiles && video);
    const FrameCounters before = server_->counters().frames;
    ASSERT_TRUE(pump_until({tiles.get(), video.get()},
                           [&] { return tiles->image_count() >= 20 && video->image_count() >= 20; }));
    const FrameCounters after = server_->counters().frames;
    share =
        static_cast<double>(after.paints - before.paints) / static_cast<double>(after.frames - before.frames);
  }
  EXPECT_LT(share, 0.75);
}

TEST_F(PictureStream, WhoJoinsWhenNothingMovesGetsThePictureAndItsStill) {
  if (!start()) return;
  for (const PictureCodec codec : kPictureCodecs) {
    if ((encodable_picture_codecs() & codec_bit(codec)) == 0) continue;
    const auto early = join(codec);
    ASSERT_NE(early, nullptr);
    ASSERT_TRUE(pump_until({early.get()}, [&] { return early->image_count() >= 3; })) << to_string(codec);
    ASSERT_NO_FATAL_FAILURE(command(Command::Pause));
    const uint64_t stills = server_->counters().frames.stills;
    ASSERT_TRUE(pump_until({early.get()}, [&] { return server_->counters().frames.stills > stills; }));
    const auto late = join(codec);
    ASSERT_NE(late, nullptr);
    ASSERT_TRUE(pump_until({early.get(), late.get()}, [&] { return late->has_picture(); }))
        << to_string(codec);
    // Both end with the same pixels, and then nothing more is sent.
    ASSERT_TRUE(pump_until({early.get(), late.get()}, [&] { return *early->image() == *late->image(); }))
        << to_string(codec);
    ASSERT_NO_FATAL_FAILURE(command(Command::Resume));
  }
}

TEST_F(PictureStream, NothingIsSentWhileNothingMoves) {
  if (!start()) return;
  const auto viewer = join(PictureCodec::JpegTiles);
  ASSERT_NE(viewer, nullptr);
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->image_count() >= 3; }));
  ASSERT_NO_FATAL_FAILURE(command(Command::Pause));
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return server_->counters().frames.stills >= 1; }));
  const uint64_t frames = server_->counters().frames.frames;
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(viewer->pump(std::chrono::milliseconds(5)));
  EXPECT_EQ(server_->counters().frames.frames, frames);
}

TEST_F(PictureStream, ARequestBringsAWholePictureToWhoAskedOnly) {
  if (!start()) return;
  const auto asks = join(PictureCodec::JpegTiles);
  const auto other = join(PictureCodec::JpegTiles);
  ASSERT_TRUE(asks && other);
  ASSERT_TRUE(pump_until({asks.get(), other.get()},
                         [&] { return asks->image_count() >= 3 && other->image_count() >= 3; }));
  const uint64_t before = asks->picture_stats().whole_frames;
  asks->client().request_keyframe();
  ASSERT_TRUE(
      pump_until({asks.get(), other.get()}, [&] { return asks->picture_stats().whole_frames > before; }));
  EXPECT_EQ(other->picture_stats().whole_frames, 1u);
  EXPECT_EQ(other->picture_stats().rejected_frames, 0u);
}

TEST_F(PictureStream, ASlowLinkStepsDownTheLadderAndTheOthersDoNot) {
  ServerConfig server;
  server.scene = windy_scene({480, 360});
  server.make_painter = lines_painter;
  const auto usual_quality = server.scene.stream.jpeg_quality;
  if (!start(std::move(server))) return;
  chaos::RelayConfig config;
  config.to_port = server_->port();
  config.down.bytes_per_s = 20'000;
  const auto relay = chaos::ChaosRelay::start(config);
  ASSERT_TRUE(relay.ok());
  for (const PictureCodec codec : {PictureCodec::JpegTiles, PictureCodec::Vp8}) {
    const auto good = join(codec);
    const auto slow = join(codec, (*relay)->port());
    ASSERT_TRUE(good && slow);
    const auto quality = [](const ViewerSession& session) {
      return session.frame_quality() ? session.frame_quality()->quality : 0;
    };
    ASSERT_TRUE(pump_until({good.get(), slow.get()}, [&] {
      return quality(*slow) != 0 && quality(*slow) < usual_quality;
    })) << to_string(codec);
    EXPECT_GE(quality(*good), usual_quality);
    EXPECT_EQ(good->picture_stats().rejected_frames, 0u);
    const uint64_t shown = slow->image_count();
    ASSERT_TRUE(pump_until({good.get(), slow.get()}, [&] { return slow->image_count() > shown + 3; }));
    EXPECT_EQ(slow->picture_stats().rejected_frames, 0u) << "what was dropped is made up for by the server";
  }
}

// A server whose strands are simulated by processors may draw with a GPU, and the other way round.
TEST_F(PictureStream, HowLargePicturesMayBeFollowsWhatDrawsNotWhatSimulates) {
  for (const SimDevice device : sim_devices()) {
    for (const bool is_drawn_by_processors : {false, true}) {
      SCOPED_TRACE(fmt::format("{}, {}", to_string(device), is_drawn_by_processors));
      ServerConfig config;
      config.scene = windy_scene({480, 360});
      config.sim_device = to_string(device);
      config.renderer = "tiles";
      config.is_drawn_by_processors = [&](const RenderDeviceConfig& asked) {
        EXPECT_EQ(asked.renderer, "tiles");
        return is_drawn_by_processors;
      };
      if (!start(std::move(config))) return;
      EXPECT_EQ(server_->counters().sim.sim_device, to_string(device));
      const PictureBudget budget = server_->hub().picture_budget();
      EXPECT_EQ(budget.picture_pixels,
                (is_drawn_by_processors ? kSoftwareBudget : kHardwareBudget).picture_pixels);
      server_->stop();
    }
  }
}

}  // namespace
}  // namespace strandcast::picture_stream_test
