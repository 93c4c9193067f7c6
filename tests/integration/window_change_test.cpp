// A viewer's window: pictures are as large as it is now, within the limits of a Hello, and a hidden one gets
// nothing until it is seen again; at a server and behind a relay.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "server/relay/relay.h"
#include "tests/support/server_fixture.h"
#include "tests/support/test_pictures.h"

namespace strandcast::window_change_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

/// Lines that wave from state to state: cheap to draw.
class LinesPainter : public PicturePainter {
 public:
  Result<Image> paint(const std::shared_ptr<const Snapshot>& snapshot, const PictureView& view) override {
    return test::waving_lines(view.size.width, view.size.height, 0.1 * static_cast<double>(snapshot->tick));
  }
};

class WindowChanges : public test::ServerFixture {
 protected:
  [[nodiscard]] bool begin() {
    ServerConfig config;
    config.scene = test::bald_scene();
    config.scene.stream.frame_rate_hz = 30.0;
    config.sim_device = "lanes";
    config.make_painter = [](const PainterConfig&) -> MakePicturePainter {
      return []() -> Result<std::unique_ptr<PicturePainter>> {
        return std::unique_ptr<PicturePainter>(std::make_unique<LinesPainter>());
      };
    };
    return start(std::move(config));
  }
  std::unique_ptr<Relay> relay() {
    RelayConfig config;
    config.net.port = 0;
    config.upstream.address = {"127.0.0.1", server_->port()};
    auto relay = Relay::start(config);
    EXPECT_TRUE(relay) << relay.error().to_string();
    if (!relay || !eventually([&] { return (*relay)->readiness().ok(); })) return nullptr;
    return std::move(relay).value();
  }
  std::unique_ptr<ViewerSession> join(StreamMode mode, PictureCodecs codecs = kAllPictureCodecs,
                                      uint16_t port = 0) {
    ClientConfig config = client_config(mode, Role::Viewer, port);
    config.hello.picture_codecs = codecs;
    return open(config);
  }
  static bool shows(const ViewerSession& viewer, uint32_t width, uint32_t height) {
    return viewer.image() != nullptr && viewer.image()->width == width && viewer.image()->height == height;
  }
  /// Pumps for so long; false when the session ends.
  static bool pump_for(ViewerSession& viewer, milliseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end)
      if (!viewer.pump(milliseconds(5))) return false;
    return true;
  }
  /// What comes to a hidden window in a second, after what was on its way.
  static uint64_t frames_while_hidden(ViewerSession& viewer) {
    EXPECT_TRUE(viewer.client().send(WindowChange{0, 0, true}));
    EXPECT_TRUE(pump_for(viewer, milliseconds(300)));
    const uint64_t before = totals_of(viewer).received_frames;
    EXPECT_TRUE(pump_for(viewer, milliseconds(1000)));
    return totals_of(viewer).received_frames - before;
  }
};

TEST_F(WindowChanges, PicturesOfEveryCodecGoOnInTheNewSize) {
  if (!begin()) return;
  for (const PictureCodec codec : kPictureCodecs) {
    if ((encodable_picture_codecs() & codec_bit(codec)) == 0) continue;
    const auto viewer = join(StreamMode::Frames, codec_bit(codec));
    ASSERT_NE(viewer, nullptr);
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->image_count() >= 3; })) << to_string(codec);
    ASSERT_TRUE(shows(*viewer, 64, 48));
    ASSERT_TRUE(viewer->client().send(WindowChange{96, 160, false}));
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return shows(*viewer, 96, 160); })) << to_string(codec);
    const uint64_t count = viewer->image_count();
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->image_count() >= count + 3; }));
    EXPECT_TRUE(shows(*viewer, 96, 160));
    EXPECT_EQ(viewer->picture_stats().rejected_frames, 0u) << "it began with a whole picture";
    ASSERT_TRUE(viewer->frame_quality().has_value());
    EXPECT_EQ(viewer->frame_quality()->height, 160u);
    EXPECT_EQ(viewer->frame_quality()->codec, codec);
    // One side alone may change, and no size leaves it as it is.
    ASSERT_TRUE(viewer->client().send(WindowChange{128, 0, false}));
    ASSERT_TRUE(viewer->client().send(WindowChange{}));
    EXPECT_TRUE(pump_until({viewer.get()}, [&] { return shows(*viewer, 128, 160); })) << to_string(codec);
  }
}

TEST_F(WindowChanges, AreLimitedLikeAHello) {
  if (!begin()) return;
  const auto viewer = join(StreamMode::Frames, codec_bit(PictureCodec::Jpeg));
  ASSERT_NE(viewer, nullptr);
  ASSERT_TRUE(viewer->client().send(WindowChange{kMaxPictureWidth, kMaxPictureHeight, false}));
  const RenderSize fitted = fit_picture({kMaxPictureWidth, kMaxPictureHeight}, kSoftwareBudget);
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return shows(*viewer, fitted.width, fitted.height); }));
  EXPECT_THAT(viewer->frame_quality()->reason, HasSubstr("instead of 3840 x 2160"));
}

TEST_F(WindowChanges, ShareTheBudgetOfTheViews) {
  if (!begin()) return;
  // All of them are of one address. Each alone would be drawn; the last of them has no room any more.
  const uint64_t most = kSoftwareBudget.peer_pixels() / kSoftwareBudget.picture_pixels + 1;
  std::vector<std::unique_ptr<ViewerSession>> viewers;
  std::vector<ViewerSession*> all;
  for (uint64_t i = 0; i < most; ++i) {
    viewers.push_back(join(StreamMode::Frames, codec_bit(PictureCodec::JpegTiles)));
    ASSERT_NE(viewers.back(), nullptr);
    all.push_back(viewers.back().get());
    const auto width = static_cast<uint32_t>(1280 - 4 * i);
    ASSERT_TRUE(all.back()->client().send(WindowChange{width, 720, false}));
    if (i + 1 == most) break;
    ASSERT_TRUE(pump_until(all, [&] { return shows(*all.back(), width, 720); })) << i;
  }
  std::string said;
  ASSERT_TRUE(pump_until(all, [&] {
    for (const Notice& notice : all.back()->take_notices()) said += notice.is_error ? notice.text : "";
    return !said.empty() && all.back()->image_count() > 3;
  }));
  EXPECT_THAT(said, HasSubstr("one address would have"));
  EXPECT_TRUE(shows(*all.back(), 64, 48)) << "it keeps what it had";
}

TEST_F(WindowChanges, AHiddenViewerGetsNothingAndCostsNothing) {
  if (!begin()) return;
  for (const StreamMode mode : {StreamMode::Strands, StreamMode::Frames}) {
    const auto viewer = join(mode);
    ASSERT_NE(viewer, nullptr);
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return totals_of(*viewer).decoded_frames >= 5; }));
    EXPECT_EQ(frames_while_hidden(*viewer), 0u) << to_string(mode);
    const auto before = server_->counters();
    EXPECT_TRUE(pump_for(*viewer, milliseconds(300)));
    EXPECT_EQ(server_->counters().frames.paints, before.frames.paints) << "nothing is drawn for nobody";
    EXPECT_EQ(server_->counters().encode.encodes, before.encode.encodes) << "nor encoded";
    const SessionTotals hidden = totals_of(*viewer);
    ASSERT_TRUE(viewer->client().send(WindowChange{}));
    ASSERT_TRUE(pump_until({viewer.get()}, [&] {
      return totals_of(*viewer).decoded_frames >= hidden.decoded_frames + 5;
    })) << to_string(mode);
    const SessionTotals seen = totals_of(*viewer);
    EXPECT_EQ(seen.rejected_frames, hidden.rejected_frames) << "it goes on with a whole one";
    EXPECT_EQ(seen.blank_pictures, 0u);
  }
}

TEST_F(WindowChanges, AHiddenViewerHearsOfTheServerOnceASecond) {
  if (!begin()) return;
  const auto between = relay();
  ASSERT_NE(between, nullptr);
  struct Listener {
    std::unique_ptr<ViewerClient> client;
    int count = 0;
  };
  std::vector<Listener> listeners;
  const auto listen = [&](const ClientConfig& config, const WindowChange& window) {
    auto client = ViewerClient::connect(config);
    ASSERT_TRUE(client) << client.error().to_string();
    ASSERT_TRUE((*client)->send(window));
    listeners.push_back({std::move(*client)});
  };
  listen(client_config(), {});
  listen(client_config(), {0, 0, true});
  // A relay hears of the state by its own session and by that of the pictures.
  listen(client_config(StreamMode::Frames, Role::Viewer, between->port()), {0, 0, true});
  if (HasFatalFailure()) return;
  const auto end = std::chrono::steady_clock::now() + milliseconds(3000);
  while (std::chrono::steady_clock::now() < end)
    for (Listener& listener : listeners)
      if (const auto event = listener.client->next(milliseconds(2)))
        listener.count += std::holds_alternative<ServerStatus>(*event) ? 1 : 0;
  EXPECT_GE(listeners[0].count, 5);
  EXPECT_LE(listeners[1].count, 4);
  EXPECT_LE(listeners[2].count, 4);
}

TEST_F(WindowChanges, AModeThatIsAskedForMeanwhileComesWhenTheWindowIsSeen) {
  if (!begin()) return;
  const auto viewer = join(StreamMode::Strands);
  ASSERT_NE(viewer, nullptr);
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return totals_of(*viewer).decoded_frames >= 5; }));
  viewer->request_mode(StreamMode::Frames);
  EXPECT_EQ(frames_while_hidden(*viewer), 0u);
  ASSERT_TRUE(viewer->client().send(WindowChange{96, 160, false}));
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->mode() == StreamMode::Frames; }));
  EXPECT_TRUE(shows(*viewer, 96, 160));
  EXPECT_EQ(viewer->blank_pictures(), 0u);
}

TEST_F(WindowChanges, GoThroughARelay) {
  if (!begin()) return;
  const auto between = relay();
  ASSERT_NE(between, nullptr);
  const auto pictures = join(StreamMode::Frames, kAllPictureCodecs, between->port());
  const auto strands = join(StreamMode::Strands, kAllPictureCodecs, between->port());
  ASSERT_TRUE(pictures && strands);
  ASSERT_TRUE(pump_until({pictures.get(), strands.get()}, [&] {
    return pictures->image_count() >= 3 && totals_of(*strands).decoded_frames >= 3;
  }));
  ASSERT_TRUE(pictures->client().send(WindowChange{96, 160, false}));
  ASSERT_TRUE(pump_until({pictures.get(), strands.get()}, [&] { return shows(*pictures, 96, 160); }));
  EXPECT_EQ(frames_while_hidden(*strands), 0u);
  EXPECT_EQ(frames_while_hidden(*pictures), 0u);
  const uint64_t paints = server_->counters().frames.paints;
  EXPECT_TRUE(pump_for(*strands, milliseconds(300)));
  EXPECT_EQ(server_->counters().frames.paints, paints) << "the server above knows";
  const uint64_t count = pictures->image_count();
  const uint64_t decoded = totals_of(*strands).decoded_frames;
  ASSERT_TRUE(pictures->client().send(WindowChange{}));
  ASSERT_TRUE(strands->client().send(WindowChange{}));
  ASSERT_TRUE(pump_until({pictures.get(), strands.get()}, [&] {
    return pictures->image_count() >= count + 3 && totals_of(*strands).decoded_frames >= decoded + 3;
  }));
  EXPECT_TRUE(shows(*pictures, 96, 160));
}

}  // namespace
}  // namespace strandcast::window_change_test
