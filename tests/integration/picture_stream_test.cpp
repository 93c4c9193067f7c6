// Pictures from a whole server to viewers and raw clients: joining in the middle, requests, drops, idle
// stills, one encode for many, and slow links.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/app/viewer_session.h"
#include "server/app/server.h"
#include "tests/support/eventually.h"
#include "tests/support/raw_client.h"
#include "tests/tools/chaos_relay.h"

namespace strandcast {
namespace {

using test::RawClient;

SceneDesc small_scene() {
  SceneDesc scene = built_in_scene();
  ProceduralGroomDesc groom;
  groom.strand_count = 150;
  groom.vertex_count = 8;
  scene.groom = groom;
  scene.head.is_visible = false;
  scene.wind.mean_mps = {3.0f, 0.0f, 1.0f};
  scene.wind.gust_intensity = 0.4f;
  scene.stream.frame_width = 160;
  scene.stream.frame_height = 120;
  scene.stream.frame_rate_hz = 30.0;
  return scene;
}

class PictureStream : public testing::Test {
 protected:
  void start(const SceneDesc& scene = small_scene()) {
    ServerConfig config;
    config.scene = scene;
    config.net.port = 0;
    auto server = Server::start(config);
    if (!server.ok() && server.error().code == ErrorCode::Unavailable)
      GTEST_SKIP() << "needs OpenGL 4.5: " << server.error().to_string();
    ASSERT_TRUE(server.ok()) << server.error().to_string();
    server_ = std::move(*server);
  }
  std::unique_ptr<ViewerSession> join(PictureCodec codec, uint16_t port = 0) {
    ClientConfig config;
    config.address = {"127.0.0.1", port != 0 ? port : server_->port()};
    config.hello.mode = StreamMode::Frames;
    config.hello.picture_codecs = codec_bit(codec);
    auto session = ViewerSession::open(config);
    EXPECT_TRUE(session.ok()) << session.error().to_string();
    return session.ok() ? std::move(*session) : nullptr;
  }
  template <class Condition>
  bool pump_until(const std::vector<ViewerSession*>& sessions, Condition condition) {
    return eventually([&] {
      for (ViewerSession* session : sessions) EXPECT_TRUE(session->pump(std::chrono::milliseconds(2)).ok());
      return condition();
    });
  }
  void command(Command what) {
    RawClient controller(server_->port());
    ASSERT_TRUE(controller.handshake());
    Hello hello;
    hello.role = Role::Controller;
    controller.send(hello);
    controller.send(ControlCommand{what});
    ASSERT_TRUE(controller.read_control<Notice>().has_value());
  }

  std::unique_ptr<Server> server_;
};

TEST_F(PictureStream, EveryCodecIsGivenToWhoDecodesIt) {
  ASSERT_NO_FATAL_FAILURE(start());
  if (server_ == nullptr) return;
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

TEST_F(PictureStream, ManyViewersOfOneClassCostOneEncodePerPicture) {
  ASSERT_NO_FATAL_FAILURE(start());
  if (server_ == nullptr) return;
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

TEST_F(PictureStream, TwoCodecsOfOneViewAreDrawnOnce) {
  ASSERT_NO_FATAL_FAILURE(start());
  if (server_ == nullptr) return;
  const auto tiles = join(PictureCodec::JpegTiles);
  const auto video = join(PictureCodec::Vp8);
  ASSERT_TRUE(tiles && video);
  ASSERT_TRUE(pump_until({tiles.get(), video.get()},
                         [&] { return tiles->image_count() >= 20 && video->image_count() >= 20; }));
  const FrameCounters counters = server_->counters().frames;
  EXPECT_LT(counters.paints, 0.75 * static_cast<double>(counters.frames));
}

TEST_F(PictureStream, WhoJoinsWhenNothingMovesGetsThePictureAndItsStill) {
  ASSERT_NO_FATAL_FAILURE(start());
  if (server_ == nullptr) return;
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
  ASSERT_NO_FATAL_FAILURE(start());
  if (server_ == nullptr) return;
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
  ASSERT_NO_FATAL_FAILURE(start());
  if (server_ == nullptr) return;
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
  SceneDesc scene = small_scene();
  scene.stream.frame_width = 480;
  scene.stream.frame_height = 360;
  ASSERT_NO_FATAL_FAILURE(start(scene));
  if (server_ == nullptr) return;
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
      return quality(*slow) != 0 && quality(*slow) < scene.stream.jpeg_quality;
    })) << to_string(codec);
    EXPECT_GE(quality(*good), scene.stream.jpeg_quality);
    EXPECT_EQ(good->picture_stats().rejected_frames, 0u);
    const uint64_t shown = slow->image_count();
    ASSERT_TRUE(pump_until({good.get(), slow.get()}, [&] { return slow->image_count() > shown + 3; }));
    EXPECT_EQ(slow->picture_stats().rejected_frames, 0u) << "what was dropped is made up for by the server";
  }
}

}  // namespace
}  // namespace strandcast
