// ViewerSession against servers whose messages are well framed but whose contents are not what they should
// be.
#include <zstd.h>

#include <atomic>
#include <future>

#include "client/app/viewer_session.h"
#include "client/app/viewer_thread.h"
#include "tests/support/client_config.h"
#include "tests/support/eventually.h"
#include "tests/support/fake_server.h"
#include "tests/support/hair_motion.h"

namespace strandcast::client_session_test {
namespace {

using std::chrono::milliseconds;
using test::config_for;
using test::FakePeer;
using test::FakeServer;
using test::make_welcome;
using testing::HasSubstr;

constexpr uint32_t kStrands = 20;
constexpr uint32_t kVertices = 8;
constexpr milliseconds kLong{20'000};  // never reached by code that works

/// Zeros that zstd makes a thousandth of.
std::vector<std::byte> zstd_bomb(size_t zeros) {
  const std::vector<std::byte> source(zeros);
  std::vector<std::byte> bomb(ZSTD_compressBound(zeros));
  bomb.resize(ZSTD_compress(bomb.data(), bomb.size(), source.data(), source.size(), 1));
  return bomb;
}

TEST(ClientSession, UnusableStrandFramesAreCountedAndAKeyframeAskedFor) {
  std::atomic<int> requests{0};
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    const std::vector<std::byte> bomb = zstd_bomb(64u << 20);
    const std::vector<std::byte> noise(5000, std::byte{0xa5});
    for (uint32_t sequence = 1; sequence <= 20; ++sequence) {
      const Opcode opcode = sequence % 2 == 0 ? Opcode::StrandDelta : Opcode::StrandKeyframe;
      const FrameHeader header{.opcode = opcode, .sequence = sequence};
      peer.send(*make_encoded_frame(header, sequence % 3 == 0 ? bomb : noise));
    }
    if (peer.read_until<KeyframeRequest>()) ++requests;
    peer.send(Notice{false, "done"});
    peer.read_to_end();
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  while ((*session)->take_notices().empty()) ASSERT_TRUE((*session)->pump(kLong));
  EXPECT_EQ(requests, 1);
  EXPECT_EQ((*session)->replay().stats().rejected_frames, 20u);
  EXPECT_EQ((*session)->replay().stats().decoded_frames, 0u);
  EXPECT_FALSE((*session)->replay().stats().last_error.empty());
  EXPECT_FALSE((*session)->has_picture());
}

TEST(ClientSession, AWrongAssetEndsTheSession) {
  const std::vector<std::vector<std::byte>> payloads = {
      {}, std::vector<std::byte>(1000, std::byte{0x11}), zstd_bomb(64u << 20)};
  for (const auto& payload : payloads) {
    const FakeServer server([&](FakePeer& peer) {
      peer.welcome(make_welcome(kStrands, kVertices));
      peer.send(*make_encoded_frame({.opcode = Opcode::Asset, .sequence = 1}, payload));
      peer.read_to_end();
    });
    auto session = ViewerSession::open(config_for(server.port()));
    ASSERT_TRUE(session) << session.error().to_string();
    Status pumped;
    while (pumped && (*session)->client().counters().received_messages < 100)
      pumped = (*session)->pump(kLong);
    EXPECT_FALSE(pumped) << payload.size();
    EXPECT_EQ((*session)->asset(), nullptr);
  }
}

TEST(ClientSession, AnAssetOfOtherSizesThanAnnouncedIsRefused) {
  SceneAsset asset;
  asset.strand_count = kStrands + 1;
  asset.vertex_count = kVertices;
  asset.rest_position_m.resize((kStrands + 1) * kVertices);
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    peer.send(*make_encoded_frame({.opcode = Opcode::Asset, .sequence = 1}, encode_scene_asset(asset)));
    peer.read_to_end();
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  const auto pumped = (*session)->pump(kLong);
  ASSERT_FALSE(pumped);
  EXPECT_EQ(pumped.error().code, ErrorCode::BadInput);
  EXPECT_THAT(pumped.error().message, HasSubstr("21 x 8"));
}

TEST(ClientSession, BrokenPicturesAreSkipped) {
  const FakeServer server([&](FakePeer& peer) {
    Welcome welcome = make_welcome(kStrands, kVertices);
    welcome.mode = StreamMode::Frames;
    peer.welcome(welcome);
    const std::vector<std::byte> noise(500, std::byte{0x42});
    peer.send(*make_encoded_frame({.opcode = Opcode::JpegFrame, .sequence = 1}, noise));
    peer.send(Notice{false, "picture"});
    peer.read_until<KeyframeRequest>();
    const Image image{16, 16, std::vector<uint8_t>(16 * 16 * 4, 128)};
    const auto jpeg = encode_jpeg(image, 80);
    if (jpeg) peer.send(*make_encoded_frame({.opcode = Opcode::JpegFrame, .sequence = 3}, *jpeg));
    peer.read_to_end();
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  while ((*session)->take_notices().empty()) ASSERT_TRUE((*session)->pump(kLong));
  EXPECT_EQ((*session)->picture_stats().rejected_frames, 1u);
  (*session)->client().request_keyframe();  // only to wake the script
  while (!(*session)->has_picture()) ASSERT_TRUE((*session)->pump(kLong));
  EXPECT_EQ((*session)->image()->width, 16u);
  EXPECT_EQ((*session)->decoded_frames(), 1u);
}

TEST(ClientSession, ALateKeyframeBringsTheStreamBack) {
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    HairMotion hair({.strand_count = kStrands, .vertex_count = kVertices});
    auto encoder = make_strand_encoder("delta");
    const auto next = [&] {
      hair.step();
      return (*encoder)->encode(hair.snapshot(quantum_for_bound(1e-4f)));
    };
    (void)next();  // the keyframe is lost
    for (int i = 0; i < 5; ++i) peer.send(*next());
    peer.read_until<KeyframeRequest>();
    peer.send(*(*encoder)->encode_for_join(hair.snapshot(quantum_for_bound(1e-4f))).keyframe);
    for (int i = 0; i < 5; ++i) peer.send(*next());
    peer.send(Notice{false, "done"});
    peer.read_to_end();
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  std::vector<uint64_t> ticks;
  (*session)->set_snapshot_listener([&](const auto& snapshot) { ticks.push_back(snapshot->tick); });
  while ((*session)->take_notices().empty()) ASSERT_TRUE((*session)->pump(kLong));
  EXPECT_EQ(ticks, (std::vector<uint64_t>{6, 7, 8, 9, 10, 11}));
  EXPECT_EQ((*session)->replay().stats().rejected_frames, 5u);
  EXPECT_EQ((*session)->replay().stats().keyframe_requests, 1u);
}

TEST(ClientSession, AListThatNobodyAskedForEndsNothing) {
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    peer.send(SessionList{});
    peer.send(Notice{false, "done"});
    peer.read_to_end();
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  while ((*session)->take_notices().empty()) ASSERT_TRUE((*session)->pump(kLong));
}

TEST(ViewerThread, DecodesAndAcknowledgesEveryFrameWhileNobodyLooks) {
  constexpr uint32_t kFrames = 50;
  std::atomic<uint32_t> acknowledged{0};
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    HairMotion hair({.strand_count = kStrands, .vertex_count = kVertices});
    auto encoder = make_strand_encoder("delta");
    // Each waits for the acknowledgement of the one before: nothing but decoding can bring the next.
    for (uint32_t i = 1; i <= kFrames; ++i) {
      hair.step();
      peer.send(*(*encoder)->encode(hair.snapshot(quantum_for_bound(1e-4f))));
      const auto ack = peer.read_until<FrameAck>();
      if (!ack || ack->sequence != i) break;
      acknowledged = i;
    }
    peer.send(Notice{false, "done"});
    peer.read_until<ModeRequest>();
    peer.send(ModeChange{StreamMode::Strands, "as before", 0, 0});
    peer.read_to_end();
  });
  auto live = LiveConnection::open(config_for(server.port()));
  ASSERT_TRUE(live) << live.error().to_string();
  ViewerThread viewer(std::move(*live));
  ASSERT_TRUE(eventually([&] { return acknowledged == kFrames; }));
  std::vector<Notice> notices;
  ASSERT_TRUE(eventually([&] { return !(notices = viewer.take_notices()).empty(); }));
  EXPECT_EQ(notices[0].text, "done");
  const auto state = viewer.look();
  EXPECT_EQ(state->decoded_frames, kFrames);
  ASSERT_NE(state->timeline.newest(), nullptr);
  EXPECT_EQ(state->timeline.newest()->tick, kFrames);
  EXPECT_EQ(state->timeline.snapshots().size(), 1u) << "what nobody looked at does not pile up";
  viewer.request_mode(StreamMode::Auto);
  EXPECT_TRUE(eventually([&] { return viewer.look()->mode.reason == "as before"; }));
  EXPECT_THAT(to_lines(*viewer.stop_and_report()), HasSubstr("decoded_frames=50\n"));
}

TEST(ViewerThread, SaysWhatIsWrongAndTriedBeforeTheFirstConnection) {
  uint16_t port = 0;
  {
    const FakeServer gone([](FakePeer&) {});
    port = gone.port();
  }
  std::atomic<int> told{0};
  ViewerThread viewer(LiveConnection::begin(config_for(port)), [&](const auto&) { ++told; });
  ASSERT_TRUE(eventually([&] { return !viewer.look()->trouble.empty(); }));
  const auto state = viewer.look();
  EXPECT_THAT(state->trouble, HasSubstr("cannot connect"));
  EXPECT_THAT(state->help, HasSubstr("start strandcast-server there"));
  EXPECT_NE(state->doing, "");
  EXPECT_EQ(state->session_number, 0u);
  EXPECT_FALSE(state->is_connected);
  EXPECT_FALSE(state->final_error) << "a server that is started later is found";
  EXPECT_GT(told, 0);
  EXPECT_EQ(viewer.send(Ping{}).error().code, ErrorCode::Unavailable);
  viewer.request_mode(StreamMode::Frames);
  EXPECT_FALSE(viewer.stop_and_report());
}

TEST(ViewerThread, SaysWhatAConnectionIsAt) {
  const FakeServer server([](FakePeer& peer) {
    peer.upgrade();
    peer.read_to_end();  // no Welcome
  });
  ViewerThread viewer(LiveConnection::begin(config_for(server.port())));
  EXPECT_TRUE(eventually([&] { return viewer.look()->doing == to_string(ConnectStep::AwaitWelcome); }));
  EXPECT_EQ(viewer.look()->trouble, "") << "nothing has failed yet";
}

TEST(ViewerThread, AWishFromBeforeTheFirstConnectionIsInItsHello) {
  std::promise<StreamMode> asked;
  const FakeServer server([&](FakePeer& peer) {
    if (const auto hello = peer.welcome(make_welcome(kStrands, kVertices))) asked.set_value(hello->mode);
    peer.read_to_end();
  });
  ClientConfig config = config_for(server.port());
  config.hello.mode = StreamMode::Auto;
  auto live = LiveConnection::begin(config);
  live->modes()->want(StreamMode::Frames);
  ViewerThread viewer(std::move(live));
  EXPECT_EQ(asked.get_future().get(), StreamMode::Frames);
  ASSERT_TRUE(eventually([&] { return viewer.look()->is_connected; }));
  EXPECT_EQ(viewer.look()->session_number, 1u);
  EXPECT_EQ(viewer.look()->trouble, "");
  EXPECT_EQ(viewer.look()->doing, "");
  EXPECT_TRUE(viewer.stop_and_report());
}

TEST(ViewerThread, SendsEveryWishForAModeAtOnce) {
  std::promise<std::vector<StreamMode>> asked;
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    std::vector<StreamMode> modes;
    while (modes.size() < 3)
      if (const auto request = peer.read_until<ModeRequest>())
        modes.push_back(request->mode);
      else
        break;
    asked.set_value(modes);
    peer.send(ModeChange{StreamMode::Strands, "nothing else is to be had", 0, 0});
    peer.read_to_end();
  });
  auto live = LiveConnection::open(config_for(server.port()));
  ASSERT_TRUE(live) << live.error().to_string();
  ViewerThread viewer(std::move(*live));
  const std::vector<StreamMode> wishes = {StreamMode::Strands, StreamMode::Auto, StreamMode::Frames};
  for (const StreamMode mode : wishes) viewer.request_mode(mode);
  EXPECT_EQ(viewer.wanted_mode(), StreamMode::Frames);
  std::future<std::vector<StreamMode>> heard = asked.get_future();
  ASSERT_EQ(heard.wait_for(kLong), std::future_status::ready) << "a key press does not wait for a clock";
  EXPECT_EQ(heard.get(), wishes);
  ASSERT_TRUE(eventually([&] {
    const ModeView now = viewer.look()->mode;
    return now.wanted == StreamMode::Frames && now.is_answered;
  }));
  const ModeView mode = viewer.look()->mode;
  EXPECT_EQ(mode.wanted, StreamMode::Frames);
  EXPECT_EQ(mode.given, StreamMode::Strands);
  EXPECT_EQ(mode.wish(), "frames, not to be had");
}

}  // namespace
}  // namespace strandcast::client_session_test
