// Changing between strands and frames in mid-session, by a person and by `auto`: somebody who watches must
// never see nothing. A painter without OpenGL stands in for the server's, so that pictures cost nothing.
// Counts decide, never times.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "common/base/profile.h"
#include "common/chaos/chaos_relay.h"
#include "common/strands/strand_codec.h"
#include "tests/support/raw_client.h"
#include "tests/support/server_fixture.h"

namespace strandcast::mode_switch_test {
namespace {

using test::RawClient;
using testing::HasSubstr;

/// Pictures that differ from pixel to pixel and from state to state, in waves that no codec makes flat.
class PatternPainter : public PicturePainter {
 public:
  Result<Image> paint(const std::shared_ptr<const Snapshot>& snapshot, const PictureView& view) override {
    Image image{view.size.width, view.size.height, {}};
    image.rgba.resize(size_t{4} * view.size.width * view.size.height);
    for (size_t i = 0; i < image.rgba.size(); ++i)
      image.rgba[i] =
          static_cast<uint8_t>((i / 4 % view.size.width * 256 / view.size.width + snapshot->tick * 5) % 256);
    return image;
  }
};

MakePicturePainter pattern_painter(const PainterConfig&) {
  return []() -> Result<std::unique_ptr<PicturePainter>> {
    return std::unique_ptr<PicturePainter>(std::make_unique<PatternPainter>());
  };
}
MakePicturePainter broken_painter(const PainterConfig&) {
  return []() -> Result<std::unique_ptr<PicturePainter>> {
    return make_error(ErrorCode::Unavailable, "no OpenGL on this server");
  };
}

class ModeSwitching : public test::ServerFixture {
 protected:
  [[nodiscard]] bool start(SceneDesc scene = test::bald_scene(),
                           std::function<MakePicturePainter(PainterConfig)> painter = pattern_painter) {
    ServerConfig config;
    config.scene = std::move(scene);
    config.scene.stream.frame_width = picture_.width;
    config.scene.stream.frame_height = picture_.height;
    config.net.limits.link_memory_ms = 4'000;
    config.fallback_codec = fallback_codec_;
    config.make_painter = std::move(painter);
    return ServerFixture::start(std::move(config));
  }
  void join(StreamMode mode, uint16_t port = 0) {
    ClientConfig client = client_config(mode, Role::Viewer, port);
    client.hello.picture_codecs = picture_codecs_;
    client.hello.codec_wish = fallback_codec_;
    viewer_ = open(client);
    ASSERT_NE(viewer_, nullptr);
    ASSERT_TRUE(pump_until([&] { return viewer_->has_picture(); }));
  }
  template <class Condition>
  bool pump_until(Condition condition) {
    return ServerFixture::pump_until({viewer_.get()}, condition);
  }
  /// Until the viewer shows this mode and has decoded ten more frames.
  bool pump_to(StreamMode mode) {
    if (!pump_until([&] { return viewer_->mode() == mode; })) return false;
    const uint64_t frames = viewer_->decoded_frames();
    return pump_until([&] { return viewer_->decoded_frames() >= frames + 10; });
  }
  void expect_no_gap() const {
    EXPECT_EQ(viewer_->blank_pictures(), 0u);
    EXPECT_EQ(viewer_->picture_stats().rejected_frames, 0u);
  }

  // H.264 makes a first picture of 64 x 48 flat: what x264 says of itself takes all bits that it may have.
  RenderSize picture_{160, 120};
  PictureCodecs picture_codecs_ = decodable_picture_codecs();
  std::string fallback_codec_;  // that viewers get; empty = none
  std::unique_ptr<ViewerSession> viewer_;
};

TEST_F(ModeSwitching, APersonSwitchesThereAndBackWithoutABlankFrame) {
  if (!start()) return;
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Strands));
  for (int round = 0; round < 2; ++round) {
    viewer_->request_mode(StreamMode::Frames);
    ASSERT_TRUE(pump_to(StreamMode::Frames));
    EXPECT_THAT(viewer_->mode_reason(), HasSubstr("pictures were asked for"));
    EXPECT_TRUE(eventually([&] { return server_->counters().strand_viewers == 0; }));
    viewer_->request_mode(StreamMode::Strands);
    ASSERT_TRUE(pump_to(StreamMode::Strands));
    EXPECT_TRUE(eventually([&] { return server_->counters().frame_viewers == 0; }));
  }
  expect_no_gap();
  EXPECT_EQ(viewer_->mode_changes(), 4u);
  EXPECT_EQ(server_->counters().net.mode_changes, 4u);
  EXPECT_EQ(viewer_->replay().stats().rejected_frames, 0u) << viewer_->replay().stats().last_error;
  EXPECT_LE(viewer_->replay().stats().missed_frames, server_->counters().net.frames_dropped)
      << "frames that were not meant for it are not missing";
}

// Nobody looks at the link in this test but because of the request.
TEST_F(ModeSwitching, TheSecondCodecStaysThroughModesAndBounds) {
  SceneDesc scene = test::bald_scene();
  scene.stream.codec = "delta";
  scene.stream.has_codec = true;
  fallback_codec_ = "raw";
  if (!start(scene)) return;
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Strands));
  EXPECT_EQ(viewer_->welcome().codec, "raw");
  viewer_->request_mode(StreamMode::Frames);
  ASSERT_TRUE(pump_to(StreamMode::Frames));
  viewer_->request_mode(StreamMode::Strands);
  ASSERT_TRUE(pump_to(StreamMode::Strands));
  ASSERT_EQ(run_command(ctl_target(), SetParameter{"stream.bound_m=0.0004"}), kDoneExit);
  const float quantum_m = lattice_step_m("raw", 4e-4f).value();
  EXPECT_TRUE(pump_until([&] { return viewer_->replay().newest()->quantum_m == quantum_m; }));
  expect_no_gap();
  EXPECT_EQ(viewer_->replay().stats().rejected_frames, 0u) << viewer_->replay().stats().last_error;
  EXPECT_FALSE(server_->counters().strand_streams.contains(0)) << "neither viewer nor pictures took delta";
}

TEST_F(ModeSwitching, ARequestIsActedOnWithoutWaitingForALookAtTheLink) {
  ServerConfig config;
  config.scene = test::bald_scene();
  config.scene.stream.frame_width = picture_.width;
  config.scene.stream.frame_height = picture_.height;
  config.net.limits.link_interval_ms = 3'600'000;
  config.make_painter = pattern_painter;
  if (!ServerFixture::start(std::move(config))) return;
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Strands));
  viewer_->request_mode(StreamMode::Frames);
  ASSERT_TRUE(pump_to(StreamMode::Frames));
  // Soon after the first: it has its turn a second later, without being asked for again.
  viewer_->request_mode(StreamMode::Strands);
  ASSERT_TRUE(pump_to(StreamMode::Strands));
  expect_no_gap();
}

TEST_F(ModeSwitching, WhoBeganWithFramesGetsTheAssetBeforeStrands) {
  if (!start()) return;
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Frames));
  EXPECT_EQ(viewer_->asset(), nullptr);
  viewer_->request_mode(StreamMode::Strands);
  ASSERT_TRUE(pump_to(StreamMode::Strands));
  EXPECT_NE(viewer_->asset(), nullptr);
  EXPECT_EQ(viewer_->replay().stats().rejected_frames, 0u) << viewer_->replay().stats().last_error;
  expect_no_gap();
}

TEST_F(ModeSwitching, FramesThatCannotBeDrawnAreRefusedAndStrandsGoOn) {
  if (!start(test::bald_scene(), broken_painter)) return;
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Strands));
  viewer_->request_mode(StreamMode::Frames);
  ASSERT_TRUE(pump_until([&] {
    return viewer_->mode_reason().find("no OpenGL on this server") != std::string::npos;
  })) << viewer_->mode_reason();
  ASSERT_TRUE(pump_to(StreamMode::Strands));
  EXPECT_EQ(viewer_->mode_changes(), 0u);
  expect_no_gap();
}

TEST_F(ModeSwitching, AFloodOfRequestsCausesOneChangeASecondAtMost) {
  if (!start()) return;
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Strands));
  const int64_t begin_ns = now_ns();
  for (int i = 0; i < 400; ++i)
    ASSERT_TRUE(viewer_->client().send(ModeRequest{i % 2 == 0 ? StreamMode::Strands : StreamMode::Frames}));
  ASSERT_TRUE(pump_to(StreamMode::Frames)) << "the newest request counts";
  const auto seconds = static_cast<uint64_t>((now_ns() - begin_ns) / 1'000'000'000);
  EXPECT_LE(server_->counters().net.mode_changes, seconds + 1);
  expect_no_gap();
}

TEST_F(ModeSwitching, ASourceHasNoMode) {
  if (!start()) return;
  for (const ClientMessage& message : {ClientMessage(ModeRequest{}), ClientMessage(ViewerReport{})}) {
    RawClient source(server_->port());
    ASSERT_TRUE(source.handshake());
    Hello hello;
    hello.role = Role::Source;
    source.send(hello);
    ASSERT_TRUE(source.read_control<Welcome>().has_value());
    source.send(message);
    EXPECT_EQ(source.read_end().close_code, static_cast<uint16_t>(CloseCode::Policy));
  }
}

TEST_F(ModeSwitching, AutoFollowsHowFastTheViewerDraws) {
  if (!start()) return;
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Auto));
  EXPECT_EQ(viewer_->mode(), StreamMode::Strands) << "until something speaks against it";
  ASSERT_TRUE(viewer_->client().send(ViewerReport{2.0, 500.0, 0.0, 2.0, DrawingDevice::Software}));
  ASSERT_TRUE(pump_to(StreamMode::Frames));
  EXPECT_THAT(viewer_->mode_reason(), HasSubstr("this machine draws 2.0 pictures per second"));
  ASSERT_TRUE(viewer_->client().send(ViewerReport{2.0, 5.0, 1.0, 15.0, DrawingDevice::Software}));
  ASSERT_TRUE(pump_to(StreamMode::Strands));
  EXPECT_THAT(viewer_->mode_reason(), HasSubstr("drawn here"));
  expect_no_gap();
}

TEST_F(ModeSwitching, AutoGivesFramesToWhoCannotDrawStrands) {
  if (!start()) return;
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Auto));
  ASSERT_TRUE(viewer_->client().send(ViewerReport{0.0, 0.0, 0.0, 0.0, DrawingDevice::None}));
  ASSERT_TRUE(pump_to(StreamMode::Frames));
  EXPECT_THAT(viewer_->mode_reason(), HasSubstr("cannot draw strands"));
  expect_no_gap();
}

TEST_F(ModeSwitching, AutoTakesFramesOnALinkTooSlowForStrandsAndComesBack) {
  constexpr uint32_t kStrands = 240;  // long ones: no class can leave out more than half of so few
  picture_ = {32, 24};                // that go through a link which is too slow for strands
  picture_codecs_ &= ~codec_bit(PictureCodec::H264);
  SceneDesc scene = test::bald_scene(kStrands, 64);
  scene.stream.codec = "tangent";  // what steps tell of so few strands no link is too slow for
  scene.stream.has_codec = true;
  if (!start(scene)) return;
  chaos::RelayConfig relay;
  relay.to_port = server_->port();
  auto link = chaos::ChaosRelay::start(relay);
  ASSERT_TRUE(link);
  ASSERT_NO_FATAL_FAILURE(join(StreamMode::Auto, (*link)->port()));
  // A link that is too slow for the cheapest class.
  const std::vector<StrandClass> classes = make_strand_classes({60.0, 0.0, 1e-4f, kStrands});
  const StrandClass cheapest = classes.back();
  const StrandEncodeCounters before = server_->counters().encode;
  const int64_t begin_ns = now_ns();
  ASSERT_TRUE(pump_until([&] { return viewer_->decoded_frames() >= 90; }));
  const StrandEncodeCounters after = server_->counters().encode;
  const auto encodes = static_cast<double>(after.encodes - before.encodes);
  if (const double rate_hz = encodes * 1e9 / static_cast<double>(now_ns() - begin_ns);
      rate_hz < 2.0 * cheapest.frame_rate_hz)
    GTEST_SKIP() << fmt::format(
        "{:.1f} states a second: this machine is too slow to fill a link (sanitizers?)", rate_hz);
  const double full = static_cast<double>(after.delta_bytes - before.delta_bytes) / encodes * 60.0;
  chaos::LinkPlan slow;
  slow.bytes_per_s = static_cast<uint64_t>(
      0.3 * expected_bytes_per_s(strand_codec_info("tangent")->bytes, {classes[0], full / 60.0}, cheapest));
  (*link)->set_plan(chaos::Direction::Down, slow);
  // On so slow a link the server may try strands again before ten pictures are here, so it is not waited for
  // them.
  ASSERT_TRUE(pump_until([&] { return viewer_->mode() == StreamMode::Frames; })) << viewer_->mode_reason();
  EXPECT_THAT(viewer_->mode_reason(), HasSubstr("the link takes"));
  (*link)->set_plan(chaos::Direction::Down, {});
  ASSERT_TRUE(pump_to(StreamMode::Strands)) << viewer_->mode_reason();
  expect_no_gap();
}

}  // namespace
}  // namespace strandcast::mode_switch_test
