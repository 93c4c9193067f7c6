// What a hostile server can make a viewer do: keep without bound, go on when it should stop, wait for what
// never comes. Counts decide: what came of so much that was sent.
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>

#include "client/app/ctl_commands.h"
#include "client/app/stream_check.h"
#include "client/app/views.h"
#include "common/pictures/image_codec.h"
#include "common/pictures/video_codec.h"
#include "tests/support/client_config.h"
#include "tests/support/eventually.h"
#include "tests/support/fake_server.h"
#include "tests/support/sample_asset.h"
#include "tests/support/sanitizers.h"
#include "tests/support/temporary_folder.h"
#include "tests/tools/load/load_viewers.h"

namespace strandcast::client_hostile_test {
namespace {

using std::chrono::milliseconds;
using test::config_for;
using test::FakePeer;
using test::FakeServer;
using test::make_welcome;
using testing::HasSubstr;

constexpr milliseconds kLong{20'000};  // never reached by code that works

ViewOptions headless_options(uint16_t port) {
  ViewOptions options;
  options.address = {"127.0.0.1", port};
  options.mode = StreamMode::Strands;
  options.is_headless = true;
  options.after_frames = 1'000'000;
  return options;
}

uint64_t count_in(const ViewReport& report, const std::string& key) {
  for (const ReportEntry& entry : report)
    if (entry.key == key) return std::stoull(entry.text);
  ADD_FAILURE() << "no " << key;
  return 0;
}

// ---- keeping ----

std::vector<std::byte> jpeg_of(uint32_t width, uint32_t height, uint8_t grey) {
  const auto jpeg =
      encode_jpeg(Image{width, height, std::vector<uint8_t>(size_t{4} * width * height, grey)}, 50);
  EXPECT_TRUE(jpeg);
  return jpeg ? *jpeg : std::vector<std::byte>();
}

TEST(HostileServer, NoticesThatNobodyTakesGiveWayToNewerOnes) {
  constexpr uint32_t kBatch = 50;
  constexpr uint32_t kBatches = 6;
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(20, 8));
    for (uint32_t i = 0; i < kBatch * kBatches; ++i) {
      peer.send(Notice{false, std::to_string(i)});
      // The next come when the client has taken these out of its mailbox.
      if (i % kBatch == kBatch - 1) peer.read_until<CameraChange>();
    }
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  for (uint32_t batch = 1; batch <= kBatches; ++batch) {
    while ((*session)->client().counters().received_messages < batch * kBatch)
      ASSERT_TRUE((*session)->pump(milliseconds(1)));
    for (uint32_t i = 0; i < kBatch; ++i) ASSERT_TRUE((*session)->pump(milliseconds(0)));
    ASSERT_TRUE((*session)->client().send(CameraChange{CameraDesc{}}));
  }
  // A message is counted before it lies in the mailbox: the last ones are there when the connection has
  // ended.
  while ((*session)->pump(milliseconds(1))) {
  }
  const std::vector<Notice> notices = (*session)->take_notices();
  ASSERT_FALSE(notices.empty());
  EXPECT_EQ(notices.back().text, std::to_string(kBatch * kBatches - 1));
  EXPECT_EQ(notices.size(), kMaxWaitingNotices);
}

/// Bytes in use on the heap of this process.
uint64_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// The payload of a picture that stands alone.
struct WholePicture {
  Opcode opcode = Opcode::JpegFrame;
  std::vector<std::byte> payload;
};

std::vector<std::byte> vp8_of(uint32_t width, uint32_t height) {
  const auto encoder = make_video_encoder(PictureCodec::Vp8, {width, height, 30.0, 1e6});
  const Image grey{width, height, std::vector<uint8_t>(size_t{4} * width * height, 99)};
  return *(*encoder)->encode(grey, VideoFrame::Keyframe, VideoRate::Target);
}

/// One of everything that a viewer keeps the newest of, in sizes that change.
void send_round(FakePeer& peer, uint32_t round, const std::string& codec,
                const std::vector<WholePicture>& pictures) {
  const std::string text(kMaxTextChars, 'x');
  for (uint32_t i = 0; i < kMaxWaitingNotices; ++i) peer.send(Notice{i % 2 == 0, text});
  peer.send(ServerStatus{.tick = round});
  peer.send(StreamQuality{static_cast<uint16_t>(round), 1 + round % 60, 1.0f, 1e-4f, text});
  peer.send(FrameQuality{static_cast<uint16_t>(round), 64, 64, 30.0, 50, PictureCodec::Jpeg, text});
  peer.send(ModeChange{round % 2 == 0 ? StreamMode::Strands : StreamMode::Frames, text, 64, 64});
  SessionList list;
  list.sessions.resize(kMaxListedSessions, SessionInfo{.name = "somebody", .address = "192.0.2.1"});
  peer.send(list);
  for (uint32_t i = 0; i < pictures.size(); ++i)
    peer.send(*make_encoded_frame({.opcode = pictures[i].opcode,
                                   .stream_id = static_cast<uint16_t>(kPictureStreamBit | (round % 100)),
                                   .sequence = 1 + round * 10 + i},
                                  pictures[i].payload));
  Snapshot snapshot;
  snapshot.tick = round;
  snapshot.sim_time_ns = int64_t{16'000'000} * round;
  snapshot.strand_count = 1 + round % 200;  // the first ones
  snapshot.vertex_count = 8;
  snapshot.quantum_m = *lattice_step_m(codec, 1e-4f);
  snapshot.lattice.resize(size_t{3} * snapshot.strand_count * snapshot.vertex_count);
  const auto keyframe = (*make_strand_encoder(codec))->encode(snapshot);
  peer.send(*with_send_time(*keyframe, static_cast<uint16_t>(round), round));
}

class HostileStream : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Codecs, HostileStream, testing::Values("delta", "tangent"));

TEST_P(HostileStream, WhatAViewerKeepsDoesNotGrow) {
  if (test::kHasSanitizer) GTEST_SKIP() << "a sanitizer's allocator does not tell what is in use";
  constexpr uint32_t kFirstRounds = 30;
  constexpr uint32_t kRounds = 230;
  constexpr uint64_t kSlackBytes = 1u << 20;  // 200 rounds of notices alone are three times that
  const std::vector<WholePicture> pictures = {{Opcode::JpegFrame, jpeg_of(640, 480, 10)},
                                              {Opcode::Vp8Frame, vp8_of(320, 240)},
                                              {Opcode::JpegFrame, jpeg_of(16, 16, 90)},
                                              {Opcode::Vp8Frame, vp8_of(64, 48)}};
  const FakeServer server([&](FakePeer& peer) {
    Welcome welcome = make_welcome(200, 8);
    welcome.codec = GetParam();
    peer.welcome(welcome);
    for (uint32_t round = 1; round <= kRounds; ++round) {
      send_round(peer, round, GetParam(), pictures);
      if (!peer.read_until<CameraChange>()) return;
    }
    peer.read_to_end();
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  uint64_t first_bytes = 0;
  for (uint32_t round = 1; round <= kRounds; ++round) {
    while ((*session)->status().tick != round || (*session)->replay().stats().received_frames < round)
      ASSERT_TRUE((*session)->pump(milliseconds(5)));
    if (round == kFirstRounds) first_bytes = heap_bytes();
    ASSERT_TRUE((*session)->client().send(CameraChange{CameraDesc{}}));
  }
  EXPECT_GT((*session)->replay().stats().decoded_frames, kRounds / 2);
  EXPECT_GT((*session)->image_count(), kRounds / 2);
  EXPECT_LT(heap_bytes(), first_bytes + kSlackBytes);
}

// ---- stopping ----

// Large enough that a decoder needs a fortieth of a second for a state, on any machine a hundredth at least.
constexpr uint32_t kHugeStrands = 15'000;
constexpr uint32_t kHugeVertices = 64;
constexpr uint32_t kQueuedFrames = 200;

/// Asset and keyframe of such a stream, of almost no bytes.
struct HugeStream {
  EncodedFramePtr asset;
  EncodedFramePtr keyframe;
};

const HugeStream& huge_stream() {
  static const HugeStream stream = [] {
    SceneAsset asset;
    asset.strand_count = kHugeStrands;
    asset.vertex_count = kHugeVertices;
    asset.rest_position_m.resize(size_t{kHugeStrands} * kHugeVertices);
    Snapshot snapshot;
    snapshot.tick = 1;
    snapshot.strand_count = kHugeStrands;
    snapshot.vertex_count = kHugeVertices;
    snapshot.quantum_m = 1e-4f;
    snapshot.lattice.resize(size_t{3} * kHugeStrands * kHugeVertices);
    return HugeStream{make_encoded_frame({.opcode = Opcode::Asset, .sequence = 1}, encode_scene_asset(asset)),
                      (*make_strand_encoder("delta"))->encode(snapshot)};
  }();
  return stream;
}

void send_huge_stream(FakePeer& peer) {
  const HugeStream& stream = huge_stream();
  if (!peer.welcome(make_welcome(kHugeStrands, kHugeVertices))) return;
  peer.send(*stream.asset);
  // One by itself: it keeps the viewer busy while all the others arrive.
  peer.send(*stream.keyframe);
  peer.read_until<FrameAck>();
  for (uint32_t i = 1; i < kQueuedFrames; ++i) peer.send(*stream.keyframe);
}

TEST(HostileServer, AStopComesBeforeTheFramesThatWait) {
  (void)huge_stream();
  std::atomic<bool> stop{false};
  const FakeServer server([&](FakePeer& peer) {
    send_huge_stream(peer);
    for (int i = 0; i < 3; ++i) peer.read_until<FrameAck>();
    stop = true;
    peer.read_to_end();
  });
  const auto report = run_headless(headless_options(server.port()), stop);
  ASSERT_TRUE(report) << report.error().to_string();
  EXPECT_LT(count_in(*report, "decoded_frames"), kQueuedFrames / 2);
}

TEST(HostileServer, TheTimeLimitComesBeforeTheFramesThatWait) {
  (void)huge_stream();
  const FakeServer server([&](FakePeer& peer) {
    send_huge_stream(peer);
    peer.read_to_end();
  });
  ViewOptions options = headless_options(server.port());
  options.seconds = 0.5;
  const std::atomic<bool> stop{false};
  const auto report = run_headless(options, stop);
  if (report) {
    EXPECT_LT(count_in(*report, "decoded_frames"), kQueuedFrames / 2);
  } else {
    EXPECT_EQ(report.error().code, ErrorCode::Timeout) << "too slow for the first one";
  }
}

TEST(HostileServer, TheTimeLimitEndsAClipThatDoesNotFill) {
  const FakeServer server([&](FakePeer& peer) {
    Welcome welcome = make_welcome(20, 8);
    welcome.mode = StreamMode::Frames;
    peer.welcome(welcome);
    for (uint32_t i = 1; i <= 3; ++i)
      peer.send(*make_encoded_frame({.opcode = Opcode::JpegFrame, .sequence = i},
                                    jpeg_of(32, 16, static_cast<uint8_t>(40 * i))));
    peer.read_to_end();
  });
  const TemporaryFolder folder;
  ViewOptions options = headless_options(server.port());
  options.mode = StreamMode::Frames;
  options.clip = folder.path() / "clip.webp";
  options.clip_s = 60.0;
  options.seconds = 0.3;
  const std::atomic<bool> stop{false};
  const auto report = run_headless(options, stop);
  ASSERT_TRUE(report) << report.error().to_string();
  EXPECT_GT(std::filesystem::file_size(options.clip), 20u) << "what came until then";
}

TEST(HostileServer, TheTimeLimitEndsTheWaitForSomethingToShow) {
  const std::atomic<bool> stop{false};
  const auto error_of = [&](const FakeServer::Script& script) {
    const FakeServer server(script);
    ViewOptions options = headless_options(server.port());
    options.seconds = 0.25;
    const auto report = run_headless(options, stop);
    return report ? make_error(ErrorCode::Internal, "a report") : report.error();
  };
  for (const FakeServer::Script& script :
       std::vector<FakeServer::Script>{[](FakePeer& peer) { peer.wait_for_test_end(); },
                                       [](FakePeer& peer) {
                                         peer.upgrade();
                                         peer.wait_for_test_end();
                                       },
                                       [](FakePeer& peer) {
                                         peer.welcome(make_welcome(20, 8));
                                         peer.wait_for_test_end();
                                       }}) {
    const Error error = error_of(script);
    EXPECT_EQ(error.code, ErrorCode::Timeout) << error.to_string();
    EXPECT_THAT(error.message, HasSubstr("0.25 s"));
  }
}

TEST(HostileServer, AStopEndsTheWaitForAWelcome) {
  std::atomic<bool> stop{false};
  const FakeServer server([&](FakePeer& peer) {
    peer.upgrade();
    stop = true;
    peer.wait_for_test_end();
  });
  const auto report = run_headless(headless_options(server.port()), stop);
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message, HasSubstr("stopped"));
}

TEST(HostileServer, AStopEndsTheWaitForAnAnswer) {
  const auto printed_by = [](const std::function<int(const CtlTarget&)>& program) {
    std::atomic<bool> stop{false};
    const FakeServer server([&](FakePeer& peer) {
      peer.welcome(make_welcome(20, 8));
      peer.read();
      stop = true;
      peer.wait_for_test_end();
    });
    CtlTarget target;
    target.connect = fmt::format("127.0.0.1:{}", server.port());
    target.stop = &stop;
    testing::internal::CaptureStderr();
    EXPECT_NE(program(target), kDoneExit);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(
      printed_by([](const CtlTarget& target) { return run_command(target, ControlCommand{Command::Pause}); }),
      HasSubstr("stopped"));
  EXPECT_THAT(printed_by([](const CtlTarget& target) { return run_check(target, 10, 60.0); }),
              HasSubstr("stopped"));
}

TEST(HostileServer, GoodbyesWithoutEndKeepNobody) {
  constexpr int kGoodbyes = 500;
  std::atomic<int> sent{0};
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(20, 8));
    while (sent < kGoodbyes && peer.send(Goodbye{"Soon."})) {
      ++sent;
      std::this_thread::sleep_for(milliseconds(10));  // more often than the client's patience ends
    }
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  Status pumped;
  while (pumped) pumped = (*session)->pump(kLong);
  EXPECT_THAT(pumped.error().message, HasSubstr("Soon."));
  EXPECT_LT(sent, kGoodbyes) << "the client waited for the last one";
}

// ---- comparing ----

/// A server may move one viewer to a slower stream, which codes the same ticks by itself.
TEST(HostileServer, CheckComparesStatesOfTheSameStreamOnly) {
  std::atomic<uint16_t> connections{0};
  const FakeServer server([&](FakePeer& peer) {
    const auto stream_id = static_cast<uint16_t>(connections++ == 0 ? 1 : 0);
    peer.welcome(make_welcome(20, 8));
    const auto encoder = make_strand_encoder("delta");
    Snapshot snapshot;
    snapshot.strand_count = 20;
    snapshot.vertex_count = 8;
    snapshot.quantum_m = 1e-4f;
    snapshot.lattice.assign(size_t{3} * 20 * 8, stream_id);
    for (snapshot.tick = 1; snapshot.tick <= 20; ++snapshot.tick)
      peer.send(*with_send_time(*(*encoder)->encode(snapshot), stream_id, 1));
    peer.read_to_end();
  });
  const auto check = check_stream(config_for(server.port()), 10, 60.0);
  ASSERT_TRUE(check) << check.error().to_string();
  EXPECT_EQ(check->differing_ticks, 0u);
  EXPECT_EQ(check->compared_ticks, 0u);
  EXPECT_FALSE(check->is_good());
  EXPECT_THAT(check->to_string(), HasSubstr("different streams"));
}

// As after a Welcome that names one.
TEST(HostileServer, ACodecThatNobodyKnowsEndsTheSession) {
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(20, 8));
    peer.send(StreamQuality{256, 1, 1.0f, 1e-4f, "because", "so\u009b31m"});
    peer.read_to_end();
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  Status pumped;
  ASSERT_TRUE(eventually([&] {
    if (pumped) pumped = (*session)->pump(std::chrono::milliseconds(5));
    return !pumped;
  }));
  EXPECT_EQ(pumped.error().code, ErrorCode::NotFound);
  EXPECT_THAT(pumped.error().to_string(), HasSubstr("'so?31m'"));
  EXPECT_EQ((*session)->welcome().codec, "delta") << "as before";
}

// ---- text ----

TEST(HostileServer, NothingOfItsWelcomeSteersATerminal) {
  const FakeServer server([&](FakePeer& peer) {
    Welcome welcome = make_welcome(20, 8);
    welcome.scene_name = "hair\u202egpj.exe";
    welcome.mode_reason = "because\u009b31m";
    welcome.codec_reason = "so\u009b31m";
    peer.welcome(welcome);
    peer.read_to_end();
  });
  auto session = ViewerSession::open(config_for(server.port()));
  ASSERT_TRUE(session) << session.error().to_string();
  const std::string lines = to_lines(make_report(**session));
  EXPECT_THAT(lines, HasSubstr("scene=hair?gpj.exe"));
  EXPECT_THAT(lines, HasSubstr("mode_reason=because?31m"));
  EXPECT_THAT(lines, HasSubstr("codec_reason=so?31m"));
}

TEST(HostileServer, NothingOfItsHealthSteersATerminal) {
  const FakeServer server(
      [](FakePeer& peer) { peer.answer_http(200, "fine\x1b[2J\nindeed\n" + std::string(100'000, '\n')); });
  CtlTarget target;
  target.connect = fmt::format("127.0.0.1:{}", server.port());
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_health(target), kDoneExit);
  const std::string printed = testing::internal::GetCapturedStdout();
  EXPECT_THAT(printed, testing::StartsWith("fine [2J\nindeed\n"));
  EXPECT_LT(printed.size(), 1000u);
}

TEST(HostileServer, MonitorPrintsSoManyLinesASecondAndNoMore) {
  constexpr uint32_t kNotices = 20'000;
  std::atomic<bool> stop{false};
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(20, 8));
    for (uint32_t i = 0; i < kNotices; ++i)
      if (!peer.send(Notice{false, "look at me"})) return;
    stop = true;
    peer.read_to_end();
  });
  CtlTarget target;
  target.connect = fmt::format("127.0.0.1:{}", server.port());
  testing::internal::CaptureStdout();
  run_monitor(target, 60.0, stop);
  const std::string printed = testing::internal::GetCapturedStdout();
  const auto lines = static_cast<uint64_t>(std::count(printed.begin(), printed.end(), '\n'));
  EXPECT_GE(lines, 1u);
  // Twenty in any second, and the run takes far fewer than ten.
  EXPECT_LE(lines, 220u);
}

// ---- the load tool ----

TEST(HostileServer, PongsThatNobodyReadsEndAViewerOfTheLoadTool) {
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(20, 8));
    const std::string ping = "\x89\x7d" + std::string(125, 'p');
    std::string many;
    for (int i = 0; i < 1000; ++i) many += ping;
    for (int i = 0; i < 400 && peer.send_raw(many); ++i) {
    }
    peer.wait_for_test_end();
  });
  load::LoadViewers viewers({"127.0.0.1", server.port(), {}});
  ASSERT_TRUE(viewers.join({}));
  for (int i = 0; i < 200 && viewers.measures().ended == 0; ++i) viewers.run_for(20);
  EXPECT_EQ(viewers.measures().ended, 1u);
}

}  // namespace
}  // namespace strandcast::client_hostile_test
