// Nobody gives up for good: window, headless viewer, relay, feeder and strandcast-ctl against servers, and
// proxies before them, that hang, break off, answer nonsense or are started anew.
#include <gmock/gmock.h>

#include <array>
#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

#include "client/app/ctl_commands.h"
#include "client/app/latency_command.h"
#include "client/app/live_connection.h"
#include "client/app/live_states.h"
#include "client/app/parameter_command.h"
#include "client/app/steady_client.h"
#include "client/app/view_report.h"
#include "client/app/views.h"
#include "common/base/file.h"
#include "common/strands/strand_codec.h"
#include "common/wire/close_code.h"
#include "server/relay/relay.h"
#include "tests/support/client_config.h"
#include "tests/support/eventually.h"
#include "tests/support/fake_server.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::coming_back_test {
namespace {

using std::chrono::milliseconds;
using test::config_for;
using test::FakePeer;
using test::FakeServer;
using test::make_welcome;
using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr uint32_t kStrands = 20;
constexpr uint32_t kVertices = 8;

EncodedFramePtr keyframe(uint64_t tick) {
  Snapshot snapshot;
  snapshot.tick = tick;
  snapshot.sim_time_ns = static_cast<int64_t>(tick) * 10'000'000;
  snapshot.strand_count = kStrands;
  snapshot.vertex_count = kVertices;
  snapshot.quantum_m = 1e-4f;
  snapshot.lattice.resize(size_t{3} * kStrands * kVertices);
  return with_send_time(*(*make_strand_encoder("delta"))->encode(snapshot), 0, 1);
}

EncodedFramePtr asset_frame() {
  SceneAsset asset;
  asset.strand_count = kStrands;
  asset.vertex_count = kVertices;
  asset.rest_position_m.resize(size_t{kStrands} * kVertices);
  return make_encoded_frame({.opcode = Opcode::Asset, .sequence = 1}, encode_scene_asset(asset));
}

StreamList stream_list() {
  StreamList list;
  list.classes.emplace_back();
  list.codecs = {"delta"};
  return list;
}

/// What a server does, with relays too, until the client goes: asset, one keyframe, and a Pong for each Ping.
void serve(FakePeer& peer, uint64_t tick = 1) {
  if (!peer.welcome(make_welcome(kStrands, kVertices))) return;
  peer.send(stream_list());
  peer.send(*asset_frame());
  peer.send(*keyframe(tick));
  while (const auto ping = peer.read_until<Ping>())
    if (!peer.send(Pong{ping->client_time_ns, now_ns(), now_ns()})) return;
}

/// One that goes after its first state.
void serve_one_state(FakePeer& peer) {
  peer.welcome(make_welcome(kStrands, kVertices));
  peer.send(stream_list());
  peer.send(*asset_frame());
  peer.send(*keyframe(1));
  peer.read_until<Ping>();
}

/// Ways in which a server that hung, or a proxy before it, ends an attempt. None of them says that the next
/// one will end so, too.
const std::vector<std::pair<const char*, FakeServer::Script>>& broken_answers() {
  static const std::vector<std::pair<const char*, FakeServer::Script>> all = {
      {"reset", [](FakePeer& peer) { peer.reset(); }},
      {"end", [](FakePeer&) {}},
      {"half an answer", [](FakePeer& peer) { peer.send_raw("HTTP/1.1 101 Switching Prot"); }},
      {"garbage", [](FakePeer& peer) { peer.send_raw("220 mail.example\r\n\r\n"); }},
      {"502", [](FakePeer& peer) { peer.answer_http(502, "Bad Gateway"); }},
      {"503", [](FakePeer& peer) { peer.answer_http(503, "not yet"); }},
      {"no Welcome", [](FakePeer& peer) { peer.upgrade(); }},
      {"full",
       [](FakePeer& peer) {
         peer.upgrade();
         peer.close(static_cast<uint16_t>(CloseCode::Full), "");
       }},
      {"malformed",
       [](FakePeer& peer) {
         if (peer.welcome(make_welcome(kStrands, kVertices))) peer.send_text("what?");
       }},
  };
  return all;
}

/// Each connection runs the next script, and all after the last of them that one.
class Door {
 public:
  explicit Door(std::vector<FakeServer::Script> scripts)
      : scripts_(std::move(scripts)), server_([this](FakePeer& peer) {
          const size_t number = count_++;
          scripts_[std::min(number, scripts_.size() - 1)](peer);
        }) {}
  uint16_t port() const { return server_.port(); }
  size_t count() const { return count_; }

 private:
  const std::vector<FakeServer::Script> scripts_;
  std::atomic<size_t> count_{0};
  FakeServer server_;
};

/// One broken answer, then a server.
std::vector<FakeServer::Script> after(const FakeServer::Script& broken) {
  return {broken, [](FakePeer& peer) { serve(peer); }};
}

CtlTarget target_of(uint16_t port) {
  CtlTarget target;
  target.connect = fmt::format("127.0.0.1:{}", port);
  return target;
}

TEST(ComingBack, AViewerTriesAgainWhateverTheFirstAnswerWas) {
  for (const auto& [name, broken] : broken_answers()) {
    const Door door(after(broken));
    const auto live = LiveConnection::begin(config_for(door.port()));
    EXPECT_TRUE(eventually([&] {
      live->pump(milliseconds(2));
      return live->final_error() || (live->has_session() && live->session().has_picture());
    })) << name;
    EXPECT_FALSE(live->final_error()) << name << ": " << live->final_error()->to_string();
  }
}

TEST(ComingBack, ARelayTriesAgainWhateverTheFirstAnswerWas) {
  for (const auto& [name, broken] : broken_answers()) {
    const Door door(after(broken));
    RelayConfig config;
    config.net.port = 0;
    config.upstream.address = {"127.0.0.1", door.port()};
    const auto relay = Relay::start(config);
    ASSERT_TRUE(relay) << relay.error().to_string();
    EXPECT_TRUE(eventually([&] { return (*relay)->failure() || (*relay)->readiness().ok(); })) << name;
    EXPECT_FALSE((*relay)->failure()) << name << ": " << (*relay)->failure()->to_string();
  }
}

TEST(ComingBack, ACommandTriesAgain) {
  for (const auto& [name, broken] : broken_answers()) {
    if (std::string(name) == "malformed") continue;  // it was in then, and may have been heard
    std::atomic<bool> stop{false};
    const Door door({broken, [](FakePeer& peer) {
                       peer.welcome(make_welcome(kStrands, kVertices));
                       if (peer.read_until<ControlCommand>()) peer.send(Notice{false, "Paused."});
                       peer.read_to_end();
                     }});
    CtlTarget target = target_of(door.port());
    target.stop = &stop;
    testing::internal::CaptureStdout();
    const int code = run_command(target, ControlCommand{Command::Pause});
    EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("Paused.")) << name;
    EXPECT_EQ(code, kDoneExit) << name;
  }
}

TEST(ComingBack, AMonitorComesBack) {
  std::atomic<bool> stop{false};
  const Door door({[](FakePeer& peer) {
                     peer.welcome(make_welcome(kStrands, kVertices));
                     peer.reset();
                   },
                   [&](FakePeer& peer) {
                     peer.welcome(make_welcome(kStrands, kVertices));
                     peer.send(Notice{false, "here again"});
                     peer.read_until<Ping>();
                     stop = true;
                     peer.read_to_end();
                   }});
  testing::internal::CaptureStdout();
  const int code = run_monitor(target_of(door.port()), 60.0, stop);
  const std::string printed = testing::internal::GetCapturedStdout();
  EXPECT_THAT(printed, HasSubstr("not connected"));
  EXPECT_EQ(code, kDoneExit);
  EXPECT_EQ(door.count(), 2u);
}

TEST(ComingBack, AWatchOfParametersComesBack) {
  std::atomic<bool> stop{false};
  const auto list = [](const char* value) { return ParameterList{{{"hair.wind", value}}, 1}; };
  const Door door({[&](FakePeer& peer) {
                     peer.welcome(make_welcome(kStrands, kVertices));
                     if (peer.read_until<ParameterRequest>()) peer.send(list("1"));
                     peer.read_until<Ping>();
                     peer.reset();
                   },
                   [&](FakePeer& peer) {
                     peer.welcome(make_welcome(kStrands, kVertices));
                     if (peer.read_until<ParameterRequest>()) peer.send(list("2"));
                     peer.read_until<Ping>();
                     stop = true;
                     peer.read_to_end();
                   }});
  testing::internal::CaptureStdout();
  const int code = run_params(target_of(door.port()), {"hair.", true}, stop);
  const std::string printed = testing::internal::GetCapturedStdout();
  EXPECT_THAT(printed, ContainsRegex("hair.wind +1"));
  EXPECT_THAT(printed, ContainsRegex("hair.wind +2"));
  EXPECT_EQ(code, kDoneExit);
}

TEST(ComingBack, AnExportGoesOnAndSaysHowLongTheServerWasAway) {
  const std::atomic<bool> stop{false};
  const Door door({serve_one_state, [](FakePeer& peer) { serve(peer, 2); }});
  const auto states = LiveStates::open(config_for(door.port()), stop);
  ASSERT_TRUE(states) << states.error().to_string();
  for (const uint64_t tick : {1, 2}) {
    const auto state = (*states)->next();
    ASSERT_TRUE(state) << state.error().to_string();
    EXPECT_EQ((*state)->tick, tick);
  }
  EXPECT_THAT((*states)->remarks(), ElementsAre(HasSubstr("was away")));
}

TEST(ComingBack, ALatencyCountsConnections) {
  const std::atomic<bool> stop{false};
  const Door door({serve_one_state, [](FakePeer& peer) { serve(peer, 2); }});
  testing::internal::CaptureStdout();
  LatencyOptions options;
  options.seconds = 2.0;
  const int code = run_latency(target_of(door.port()), options, stop);
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("reconnects 1"));
  EXPECT_EQ(code, kDoneExit);
}

/// Of the answers that are final each ends a viewer at once.
TEST(ComingBack, FinalAnswersEndIt) {
  for (const CloseCode code : {CloseCode::Unauthorized, CloseCode::Kicked, CloseCode::Refused}) {
    const Door door({[code](FakePeer& peer) {
      peer.upgrade();
      peer.close(static_cast<uint16_t>(code), "");
    }});
    const auto live = LiveConnection::begin(config_for(door.port()));
    EXPECT_TRUE(eventually([&] { return live->pump(milliseconds(2)), live->final_error().has_value(); }));
    EXPECT_EQ(door.count(), 1u);
  }
  const Door other({[](FakePeer& peer) { peer.upgrade("strandcast.v9"); }});
  const auto live = LiveConnection::begin(config_for(other.port()));
  EXPECT_TRUE(eventually([&] { return live->pump(milliseconds(2)), live->final_error().has_value(); }));
}

// A proxy that was started anew does not know the session yet.
TEST(ComingBack, NotFoundIsFinalToWhoNeverWasInAlone) {
  const auto missing = [](FakePeer& peer) { peer.answer_http(404, "no session of this name"); };
  const auto welcome_and_go = [](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    peer.reset();
  };
  const Door restarted({welcome_and_go, missing, missing, [](FakePeer& peer) { serve(peer); }});
  const auto member = LiveConnection::begin(config_for(restarted.port()));
  EXPECT_TRUE(eventually([&] {
    member->pump(milliseconds(2));
    return member->final_error() || (member->has_session() && member->session().has_picture());
  }));
  EXPECT_FALSE(member->final_error());
  EXPECT_EQ(member->reconnects(), 1u);
  const Door wrong({missing});
  const auto newcomer = LiveConnection::begin(config_for(wrong.port()));
  EXPECT_TRUE(
      eventually([&] { return newcomer->pump(milliseconds(2)), newcomer->final_error().has_value(); }));
  EXPECT_EQ(wrong.count(), 1u);
}

/// Lets the client in, and says nothing any more.
void fall_silent(FakePeer& peer) {
  if (!peer.welcome(make_welcome(kStrands, kVertices))) return;
  peer.send(stream_list());
  peer.send(*asset_frame());
  peer.send(*keyframe(1));
  if (const auto ping = peer.read_until<Ping>()) peer.send(Pong{ping->client_time_ns, now_ns(), now_ns()});
  peer.wait_for_test_end();
}

// A laptop that slept: nothing comes any more, no end either, and after a while a new connection works.
TEST(ComingBack, ASilentLinkIsShownAndLeft) {
  std::vector<FakeServer::Script> scripts = {fall_silent};
  for (int i = 0; i < 4; ++i)  // at least 2.1 s of attempts
    scripts.emplace_back([](FakePeer& peer) { peer.answer_http(503, "not yet"); });
  scripts.emplace_back([](FakePeer& peer) { serve(peer, 2); });
  const Door door(scripts);
  const auto live = LiveConnection::begin(config_for(door.port()));
  ASSERT_TRUE(eventually([&] { return live->pump(milliseconds(2)), live->is_connected(); }));
  ASSERT_TRUE(eventually([&] { return live->pump(milliseconds(2)), !live->is_connected(); }));
  EXPECT_THAT(live->trouble(), HasSubstr("not connected")) << "while the connection is still open";
  ASSERT_TRUE(eventually([&] { return live->pump(milliseconds(2)), live->is_connected(); }));
  EXPECT_EQ(live->trouble(), "");
  EXPECT_EQ(live->reconnects(), 1u);
  EXPECT_GE(live->outage_s(), std::chrono::duration<double>(kSilentServer).count());
  EXPECT_EQ(door.count(), scripts.size());
}

// Long before the connection itself is given up; the motion's source and whoever looks on alike.
TEST(ComingBack, ANewConnectionTakesThePlaceOfASilentOne) {
  const Door door({fall_silent, [](FakePeer& peer) { serve(peer, 2); }});
  SteadyClient steady(config_for(door.port()));
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(steady.pump(milliseconds(2), [](ClientEvent&) {}));
    return steady.policy().reconnects() == 1;
  }));
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(took, kDoubtedServer);
  EXPECT_LT(took, config_for(door.port()).idle_timeout);
  EXPECT_TRUE(steady.is_connected());
  EXPECT_GE(steady.policy().outage_s(now_ns()), std::chrono::duration<double>(kDoubtedServer).count());

  const Door above({fall_silent, [](FakePeer& peer) { serve(peer, 2); }});
  RelayConfig config;
  config.net.port = 0;
  config.upstream.address = {"127.0.0.1", above.port()};
  const auto relay = Relay::start(config);
  ASSERT_TRUE(relay) << relay.error().to_string();
  EXPECT_TRUE(eventually([&] { return above.count() == 2 && (*relay)->readiness().ok(); }));
}

TEST(ComingBack, ASilentConnectionThatSpeaksFirstStays) {
  std::atomic<bool> has_spoken{false};
  const Door door({[&](FakePeer& peer) {
                     peer.welcome(make_welcome(kStrands, kVertices));
                     std::this_thread::sleep_for(kDoubtedServer + milliseconds(500));
                     peer.send(*asset_frame());
                     has_spoken = true;
                     while (const auto ping = peer.read_until<Ping>())
                       if (!peer.send(Pong{ping->client_time_ns, now_ns(), now_ns()})) return;
                   },
                   [](FakePeer& peer) {  // no Welcome meanwhile
                     peer.upgrade();
                     peer.read_to_end();
                   }});
  const auto live = LiveConnection::begin(config_for(door.port()));
  ASSERT_TRUE(eventually([&] { return live->pump(milliseconds(2)), has_spoken && door.count() == 2; }));
  const auto end = std::chrono::steady_clock::now() + milliseconds(300);
  while (std::chrono::steady_clock::now() < end) live->pump(milliseconds(2));
  EXPECT_TRUE(live->is_connected());
  EXPECT_EQ(live->reconnects(), 0u);
}

// What a misled proxy says first: no Welcome, but a frame of any kind.
TEST(ComingBack, AFrameInsteadOfAWelcomeIsNotFinal) {
  const Door door({[](FakePeer& peer) {
                     peer.upgrade();
                     constexpr std::array<std::byte, 5> kRandom = {
                         std::byte{0xe7}, std::byte{0x11}, std::byte{0x5a}, std::byte{0x03}, std::byte{0xff}};
                     peer.send_bytes(kRandom);
                     peer.read_to_end();
                   },
                   [](FakePeer& peer) { serve(peer, 2); }});
  SteadyClient steady(config_for(door.port()));
  EXPECT_TRUE(eventually([&] {
    const Status pumped = steady.pump(milliseconds(2), [](ClientEvent&) {});
    EXPECT_TRUE(pumped) << pumped.error().to_string();
    return !pumped || steady.is_connected();
  }));
  EXPECT_TRUE(steady.is_connected());
}

// A proxy whose server is away accepts, and says nothing.
TEST(ComingBack, AnAttemptThatHangsIsNotWaitedFor) {
  const Door door({[](FakePeer& peer) { peer.wait_for_test_end(); },
                   [](FakePeer& peer) {
                     peer.upgrade();
                     peer.wait_for_test_end();
                   },
                   [](FakePeer& peer) { serve(peer, 2); }});
  ClientConfig config = config_for(door.port());
  config.connect_timeout = config.welcome_timeout = std::chrono::seconds(20);
  const auto client = ViewerClient::connect(config);
  ASSERT_TRUE(client) << client.error().to_string();
  EXPECT_EQ(door.count(), 3u);
}

TEST(ComingBack, WhoWasInItOutlivesANameThatIsNotKnownYet) {
  const Door door({[](FakePeer& peer) { peer.answer_http(404, "no such session"); },
                   [](FakePeer& peer) { peer.answer_http(404, "no such session"); },
                   [](FakePeer& peer) { serve(peer, 2); }});
  EXPECT_FALSE(connect_patiently(config_for(door.port())));
  EXPECT_TRUE(connect_patiently(config_for(door.port()), kCommandPatience, Standing::Member));
}

std::string text_in(const ViewReport& report, const std::string& key) {
  for (const ReportEntry& entry : report)
    if (entry.key == key) return entry.text;
  return "no " + key;
}

// The report covers all connections: frames of both, and the time without one.
TEST(ComingBack, AHeadlessReportAddsUpOverConnections) {
  const auto some = [](FakePeer& peer, uint64_t first) {
    peer.welcome(make_welcome(kStrands, kVertices));
    peer.send(*asset_frame());
    for (uint64_t tick = first; tick < first + 5; ++tick) {
      peer.send(*keyframe(tick));
      if (!peer.read_until<FrameAck>()) return;
    }
    peer.read_until<FrameAck>();
  };
  std::atomic<bool> stop{false};
  std::vector<FakeServer::Script> scripts = {[&](FakePeer& peer) {
    some(peer, 1);
    peer.reset();
  }};
  for (const size_t broken : {0, 3, 4}) scripts.push_back(broken_answers()[broken].second);
  scripts.push_back([&](FakePeer& peer) {
    some(peer, 100);
    stop = true;
    peer.read_to_end();
  });
  const Door door(scripts);
  ViewOptions options;
  options.address = {"127.0.0.1", door.port()};
  options.mode = StreamMode::Strands;
  options.is_headless = true;
  options.after_frames = 1'000'000;
  const auto report = run_headless(options, stop);
  ASSERT_TRUE(report) << report.error().to_string();
  EXPECT_EQ(text_in(*report, "decoded_frames"), "10");
  EXPECT_EQ(text_in(*report, "reconnects"), "1");
  EXPECT_GT(std::stod(text_in(*report, "outage_s")), 1.0) << "there were four attempts";
  EXPECT_GT(std::stod(text_in(*report, "seconds")), std::stod(text_in(*report, "outage_s")));
}

TEST(ComingBack, AReportIsWrittenThoughTheEndIsFinal) {
  const Door door({[](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    peer.send(*asset_frame());
    peer.send(*keyframe(1));
    peer.read_until<FrameAck>();
    peer.close(static_cast<uint16_t>(CloseCode::Kicked), "for a test");
  }});
  const TemporaryFolder folder;
  ViewOptions options;
  options.address = {"127.0.0.1", door.port()};
  options.mode = StreamMode::Strands;
  options.is_headless = true;
  options.after_frames = 1'000'000;
  options.report = folder.path() / "report.txt";
  const std::atomic<bool> stop{false};
  EXPECT_FALSE(run_headless(options, stop));
  const auto text = load_text(options.report, 1u << 20);
  ASSERT_TRUE(text) << text.error().to_string();
  EXPECT_THAT(*text, HasSubstr("decoded_frames"));
  EXPECT_THAT(*text, HasSubstr("server_sim_ms=unknown")) << "no status came";
}

// ---- relays ----

TEST(ComingBack, ARelayWaitsForAListOfStreamsThatDoesNotCome) {
  const Door door({[](FakePeer& peer) {
                     peer.welcome(make_welcome(kStrands, kVertices));
                     while (const auto ping = peer.read_until<Ping>())
                       if (!peer.send(Pong{ping->client_time_ns, now_ns(), now_ns()})) return;
                   },
                   [](FakePeer& peer) { serve(peer); }});
  RelayConfig config;
  config.net.port = 0;
  config.upstream.address = {"127.0.0.1", door.port()};
  const auto relay = Relay::start(config);
  ASSERT_TRUE(relay) << relay.error().to_string();
  EXPECT_TRUE(eventually([&] { return (*relay)->failure() || door.count() > 1; }));
  EXPECT_TRUE(eventually([&] { return (*relay)->failure() || (*relay)->readiness().ok(); }));
  EXPECT_FALSE((*relay)->failure()) << (*relay)->failure()->to_string();
}

// The relay itself speaks on: its viewers are told, and count what they missed.
TEST(ComingBack, WhoIsBehindARelayKnowsThatTheServerIsAway) {
  std::atomic<bool> has_joined{false};
  std::vector<FakeServer::Script> scripts = {[&](FakePeer& peer) {
    if (!peer.welcome(make_welcome(kStrands, kVertices))) return;
    peer.send(stream_list());
    peer.send(*asset_frame());
    peer.send(*keyframe(1));
    while (const auto ping = peer.read_until<Ping>())
      if (has_joined || !peer.send(Pong{ping->client_time_ns, now_ns(), now_ns()})) break;
    peer.reset();
  }};
  for (int i = 0; i < 3; ++i) scripts.emplace_back([](FakePeer& peer) { peer.answer_http(503, "not yet"); });
  scripts.emplace_back([](FakePeer& peer) { serve(peer, 2); });
  const Door above(scripts);
  RelayConfig config;
  config.net.port = 0;
  config.upstream.address = {"127.0.0.1", above.port()};
  const auto relay = Relay::start(config);
  ASSERT_TRUE(relay) << relay.error().to_string();
  const auto live = LiveConnection::begin(config_for((*relay)->port()));
  SteadyClient steady(config_for((*relay)->port()));
  const auto pump = [&] {
    live->pump(milliseconds(2));
    (void)steady.pump(milliseconds(2), [](ClientEvent&) {});
  };
  ASSERT_TRUE(eventually([&] { return pump(), live->is_connected() && steady.is_connected(); }));
  has_joined = true;
  ASSERT_TRUE(eventually([&] { return pump(), !live->is_connected() && !steady.is_connected(); }));
  EXPECT_THAT(live->trouble(), HasSubstr("nothing has come to this relay from its server"));
  ASSERT_TRUE(eventually([&] { return pump(), live->is_connected() && steady.is_connected(); }));
  EXPECT_GT(live->outage_s(), 0.0);
  EXPECT_GT(steady.policy().outage_s(now_ns()), 0.0);
  EXPECT_EQ(live->reconnects(), 0u) << "the relay was always there";
}

TEST(ComingBack, AnUnknownOpcodeEndsNoRelay) {
  std::atomic<bool> has_gone{false};
  const Door door({[&](FakePeer& peer) {
    if (!peer.welcome(make_welcome(kStrands, kVertices))) return;
    const std::vector<std::byte> newer = {std::byte{0x77}, std::byte{1}, std::byte{2}};
    peer.send_bytes(newer);
    peer.send(stream_list());
    peer.send_bytes(newer);
    peer.send(*asset_frame());
    while (const auto ping = peer.read_until<Ping>())
      if (!peer.send(Pong{ping->client_time_ns, now_ns(), now_ns()})) return;
    has_gone = true;
  }});
  RelayConfig config;
  config.net.port = 0;
  config.upstream.address = {"127.0.0.1", door.port()};
  const auto relay = Relay::start(config);
  ASSERT_TRUE(relay) << relay.error().to_string();
  EXPECT_TRUE(eventually([&] { return (*relay)->failure() || has_gone || (*relay)->readiness().ok(); }));
  EXPECT_FALSE((*relay)->failure()) << (*relay)->failure()->to_string();
  EXPECT_EQ(door.count(), 1u) << "and no session of it";
}

// ---- feeders ----

FeedPlan still_head() {
  FeedPlan plan;
  plan.motion = [](double t_s) { return Pose{{t_s, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}; };
  plan.rate_hz = 100.0;
  return plan;
}

TEST(ComingBack, AFeederGoesOnWithTheMotionWhereItWas) {
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::vector<double> before_m, after_m;
  const auto hear = [&](FakePeer& peer, std::vector<double>& place_m) {
    peer.welcome(make_welcome(kStrands, kVertices));
    while (place_m.size() < 20) {
      const auto motion = peer.read_until<MotionSamples>();
      if (!motion) return;
      const std::lock_guard lock(mutex);
      place_m.push_back(motion->samples.front().world_from_head.position_m.x);
    }
  };
  const Door door({[&](FakePeer& peer) {
                     hear(peer, before_m);
                     peer.reset();
                   },
                   broken_answers()[4].second, broken_answers()[1].second,
                   [&](FakePeer& peer) {
                     hear(peer, after_m);
                     stop = true;
                     peer.read_to_end();
                   }});
  ClientConfig config = config_for(door.port());
  config.hello.role = Role::Source;
  std::vector<std::unique_ptr<SteadyClient>> heads;
  heads.push_back(std::make_unique<SteadyClient>(config));
  ASSERT_TRUE(heads.front()->await_welcome(stop));
  const auto done = feed(heads, still_head(), stop, {});
  ASSERT_TRUE(done) << done.error().to_string();
  EXPECT_EQ(done->reconnects, 1u);
  EXPECT_GT(done->outage_s, 0.0);
  EXPECT_GT(done->unsent_samples, 0u);
  ASSERT_EQ(after_m.size(), 20u);
  // What was on its way when the link broke is lost; what would have been sent meanwhile is not.
  EXPECT_LT(after_m.front() - before_m.back(), done->outage_s) << "the motion has waited";
}

// Nobody above hears it, as behind a relay all of whose uplinks are taken.
TEST(ComingBack, AFeedThatIsNotHeardFails) {
  for (const bool is_heard : {true, false}) {
    std::atomic<bool> stop{false};
    const FakeServer server([&](FakePeer& peer) {
      peer.welcome(make_welcome(kStrands, kVertices));
      ServerStatus status;
      status.realtime_factor = 1.0;
      status.is_motion_stale = !is_heard;
      peer.send(Notice{true, "Others speak already: try again later."});
      const int64_t begin_ns = now_ns();
      while (now_ns() - begin_ns < std::chrono::nanoseconds(kUnheardTime).count() + 300'000'000) {
        if (!peer.read_until<MotionSamples>()) return;
        ++status.tick;
        peer.send(status);
      }
      stop = true;
      peer.read_to_end();
    });
    FeedOptions options;
    options.wind = "none";
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = run_feed(target_of(server.port()), options, stop);
    const std::string errors = testing::internal::GetCapturedStderr();
    (void)testing::internal::GetCapturedStdout();
    EXPECT_EQ(code, is_heard ? kDoneExit : kRefusedExit) << errors;
    EXPECT_EQ(errors.find("was not heard") == std::string::npos, is_heard) << errors;
  }
}

// A feed that nobody has heard to its end has not done what it was asked for.
TEST(ComingBack, AFeedToAServerThatDiesSaysSoAndFails) {
  for (const bool comes_back : {true, false}) {
    std::atomic<bool> stop{false};
    std::vector<std::function<void(FakePeer&)>> peers = {[&](FakePeer& peer) {
      peer.welcome(make_welcome(kStrands, kVertices));
      for (int i = 0; i < 20 && peer.read_until<MotionSamples>(); ++i) continue;
      peer.reset();
    }};
    if (comes_back)
      peers.emplace_back([&](FakePeer& peer) {
        peer.welcome(make_welcome(kStrands, kVertices));
        for (int i = 0; i < 20 && peer.read_until<MotionSamples>(); ++i) continue;
        stop = true;
        peer.read_to_end();
      });
    else
      for (int i = 0; i < 20; ++i) peers.push_back(broken_answers()[1].second);
    const Door door(peers);
    FeedOptions options;
    options.wind = "none";
    options.seconds = comes_back ? 60.0 : 1.5;
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = run_feed(target_of(door.port()), options, stop);
    const std::string errors = testing::internal::GetCapturedStderr();
    const std::string said = testing::internal::GetCapturedStdout();
    EXPECT_EQ(code, comes_back ? kDoneExit : kRefusedExit) << errors << said;
    EXPECT_EQ(errors.find("the server was gone from ") == std::string::npos, comes_back) << errors;
    EXPECT_EQ(said.find("and came back: ") != std::string::npos, comes_back) << said;
    EXPECT_EQ(said.find("slow motion"), std::string::npos) << "the simulation was not slow: " << said;
  }
}

}  // namespace
}  // namespace strandcast::coming_back_test
