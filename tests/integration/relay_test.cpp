// Relays: viewers behind one or two of them get what viewers of the server get, and cost it nothing; what
// they say is judged by the server; and nothing hangs when the server is not what it should be.
#include "server/relay/relay.h"

#include <gmock/gmock.h>

#include <map>
#include <mutex>
#include <thread>

#include "client/app/live_connection.h"
#include "server/net/strand_class.h"
#include "tests/support/fake_server.h"
#include "tests/support/metrics_text.h"
#include "tests/support/raw_client.h"
#include "tests/support/server_fixture.h"

namespace strandcast::relay_test {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;

constexpr const char* kViewersToken = "viewers-0123456789";
constexpr const char* kControllersToken = "controllers-0123456789";

using HashOfTick = std::map<uint64_t, uint64_t>;

class Relays : public test::ServerFixture {
 protected:
  [[nodiscard]] bool begin(SceneDesc scene = test::bald_scene(), uint16_t port = 0) {
    ServerConfig config;
    config.scene = std::move(scene);
    // What is decoded is what was published, bit for bit, unless the test is about another codec; in every
    // class: of so few strands all are in each, and this bound is not made coarser.
    if (!config.scene.stream.has_codec) config.scene.stream.codec = "delta";
    config.scene.stream.has_codec = true;
    config.scene.stream.bound_m = kCoarsestBoundM;
    config.sim_device = "lanes";
    config.net.tokens = tokens_;
    if (is_like_all_others_) {
      config.net.loopback_trust = LoopbackTrust::LikeAllOthers;
      config.net.limits.connections_per_s = 1e6;
      config.net.limits.wrong_token_block_ms = 3'600'000;
    }
    config.net.port = port;
    config.on_publish = [this](const auto& state) {
      const std::lock_guard lock(mutex_);
      published_[state->tick] = state_hash(*state);
    };
    if (port == 0) return start(std::move(config));
    auto server = Server::start(config);
    EXPECT_TRUE(server) << server.error().to_string();
    if (server) server_ = std::move(server).value();
    return server_ != nullptr;
  }
  /// Once it has its server, unless that is not there.
  std::unique_ptr<Relay> relay_of(uint16_t upstream, const std::string& token = {}, bool waits = true,
                                  const std::string& head = {}) {
    RelayConfig config;
    config.upstream.head = head;
    config.net.port = 0;
    config.upstream.address = {"127.0.0.1", upstream};
    config.upstream.token = token;
    auto relay = Relay::start(config);
    if (!relay) {
      ADD_FAILURE() << relay.error().to_string();
      return nullptr;
    }
    if (waits) {
      EXPECT_TRUE(eventually([&] { return (*relay)->readiness().ok(); }));
    }
    return std::move(relay).value();
  }
  /// A viewer whose states are kept.
  struct Leaf {
    std::unique_ptr<ViewerSession> session;
    HashOfTick seen;
  };
  std::unique_ptr<Leaf> leaf_of(const ClientConfig& config) {
    auto leaf = std::make_unique<Leaf>();
    leaf->session = open(config);
    if (leaf->session == nullptr) return nullptr;
    leaf->session->set_snapshot_listener(
        [seen = &leaf->seen](const auto& state) { (*seen)[state->tick] = state_hash(*state); });
    return leaf;
  }
  std::unique_ptr<Leaf> leaf_of(uint16_t port) { return leaf_of(at_port(port)); }
  ClientConfig at_port(uint16_t port, Role role = Role::Viewer) const {
    return client_config(StreamMode::Strands, role, port);
  }
  ClientConfig of_head(const std::string& head, uint16_t port, Role role = Role::Viewer) const {
    ClientConfig config = at_port(port, role);
    config.hello.head = head;
    return config;
  }
  /// To say something, not to watch; null after a failure.
  std::unique_ptr<ViewerClient> speaker_at(const Relay& relay, Role role = Role::Viewer,
                                           const std::string& token = {}) const {
    ClientConfig config = at_port(relay.port(), role);
    config.hello.gets_no_stream = true;
    config.hello.token = token;
    auto client = ViewerClient::connect(config);
    EXPECT_TRUE(client) << client.error().to_string();
    return client ? std::move(client).value() : nullptr;
  }
  HashOfTick published() {
    const std::lock_guard lock(mutex_);
    return published_;
  }

  std::vector<AccessToken> tokens_;
  bool is_like_all_others_ = false;  // the server does not trust loopback

 private:
  std::mutex mutex_;
  HashOfTick published_;
};

/// States of `seen` that were published with another hash, or not at all.
size_t count_wrong(const HashOfTick& seen, const HashOfTick& published) {
  size_t wrong = 0;
  for (const auto& [tick, hash] : seen) {
    const auto found = published.find(tick);
    wrong += found == published.end() || found->second != hash ? 1 : 0;
  }
  return wrong;
}

/// States that both have, with one hash or with two.
size_t count_equal(const HashOfTick& a, const HashOfTick& b) {
  return static_cast<size_t>(std::count_if(a.begin(), a.end(), [&](const auto& state) {
    const auto found = b.find(state.first);
    return found != b.end() && found->second == state.second;
  }));
}
size_t count_other(const HashOfTick& a, const HashOfTick& b) {
  return static_cast<size_t>(std::count_if(a.begin(), a.end(), [&](const auto& state) {
    const auto found = b.find(state.first);
    return found != b.end() && found->second != state.second;
  }));
}

TEST_F(Relays, LeavesBehindOneAndTwoHaveTheBitsOfTheServer) {
  if (!begin()) return;
  const auto near = relay_of(server_->port());
  ASSERT_NE(near, nullptr);
  const auto far = relay_of(near->port());
  ASSERT_NE(far, nullptr);
  const auto direct = leaf_of(server_->port());
  const auto one = leaf_of(near->port());
  const auto two = leaf_of(far->port());
  ASSERT_TRUE(direct && one && two);
  EXPECT_THAT(direct->session->welcome().relays, SizeIs(0));
  EXPECT_THAT(one->session->welcome().relays, SizeIs(1));
  EXPECT_THAT(two->session->welcome().relays, SizeIs(2));
  EXPECT_EQ(two->session->welcome().session_id, direct->session->welcome().session_id);
  constexpr size_t kStates = 60;
  ASSERT_TRUE(pump_until({direct->session.get(), one->session.get(), two->session.get()}, [&] {
    return direct->seen.size() >= kStates && one->seen.size() >= kStates && two->seen.size() >= kStates &&
           two->session->has_status() && far->counters().keyframes >= 2;
  })) << "a chain is begun anew now and then, for those who join";
  const HashOfTick all = published();
  EXPECT_EQ(count_wrong(direct->seen, all), 0u);
  EXPECT_EQ(count_wrong(one->seen, all), 0u);
  EXPECT_EQ(count_wrong(two->seen, all), 0u);
}

TEST_F(Relays, AStreamIsGotOnceForAllWhoNeedIt) {
  SceneDesc scene = test::bald_scene();
  scene.stream.codec = "step";
  scene.stream.has_codec = true;
  scene.stream.strand_rate_hz = 15.0;  // one class only, however slow this machine is
  if (!begin(scene)) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  EXPECT_EQ(relay->counters().streams, 1u);
  ClientConfig predicting = at_port(relay->port());
  predicting.hello.step_ns = 1.0;
  ClientConfig direct = at_port(server_->port());
  direct.hello.step_ns = 1.0;
  const auto reference = leaf_of(direct);
  const auto able = leaf_of(predicting);
  const auto one = leaf_of(relay->port());
  const auto other = leaf_of(relay->port());
  ASSERT_TRUE(reference && able && one && other);
  EXPECT_EQ(able->session->welcome().codec, "step");
  EXPECT_EQ(one->session->welcome().codec, "tangent") << "it cannot predict";
  ASSERT_TRUE(pump_until(
      {reference->session.get(), able->session.get(), one->session.get(), other->session.get()}, [&] {
        return std::min({reference->seen.size(), able->seen.size(), one->seen.size(), other->seen.size()}) >
               60;
      }));
  EXPECT_EQ(relay->counters().streams, 2u);
  EXPECT_GT(count_equal(able->seen, reference->seen), 5u);
  EXPECT_EQ(count_other(able->seen, reference->seen), 0u) << "the bits of the server's own viewer";
  EXPECT_GT(count_equal(one->seen, other->seen), 5u);
  EXPECT_EQ(count_other(one->seen, other->seen), 0u);
}

TEST_F(Relays, WhoJoinsCostsTheServerNothing) {
  SceneDesc scene = test::bald_scene();
  scene.stream.strand_rate_hz = 15.0;  // one class only, however slow this machine is
  if (!begin(scene)) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  const auto first = leaf_of(relay->port());
  ASSERT_NE(first, nullptr);
  ASSERT_TRUE(pump_until({first->session.get()}, [&] { return first->seen.size() > 5; }));
  const uint64_t sessions_before = server_->counters().net.joined_sessions;
  // Where nobody joins no keyframe is asked for, however old the newest gets.
  const uint64_t asked_alone = relay->counters().keyframes_asked;
  const size_t two_seconds_later = first->seen.size() + 35;
  ASSERT_TRUE(pump_until({first->session.get()}, [&] { return first->seen.size() > two_seconds_later; }));
  EXPECT_EQ(relay->counters().keyframes_asked, asked_alone);
  std::vector<std::unique_ptr<Leaf>> crowd;
  std::vector<ViewerSession*> sessions = {first->session.get()};
  const int64_t begin_ns = now_ns();
  const uint64_t asked_before = relay->counters().keyframes_asked;
  for (int i = 0; i < 20; ++i) {
    crowd.push_back(leaf_of(relay->port()));
    ASSERT_NE(crowd.back(), nullptr);
    sessions.push_back(crowd.back()->session.get());
  }
  ASSERT_TRUE(pump_until(sessions, [&] {
    return std::all_of(crowd.begin(), crowd.end(), [](const auto& leaf) { return leaf->seen.size() > 5; });
  }));
  const double took_s = static_cast<double>(now_ns() - begin_ns) * 1e-9;
  EXPECT_EQ(server_->counters().net.joined_sessions, sessions_before) << "no session of theirs at the server";
  // One in a second is asked for, whoever joins.
  EXPECT_LE(static_cast<double>(relay->counters().keyframes_asked - asked_before), took_s + 1.0);
  const HashOfTick all = published();
  for (const auto& leaf : crowd) EXPECT_EQ(count_wrong(leaf->seen, all), 0u);
}

TEST_F(Relays, TheServerJudgesWhatIsSaid) {
  tokens_ = {{kViewersToken, Grant::Viewer}, {kControllersToken, Grant::Controller}};
  if (!begin()) return;
  const auto relay = relay_of(server_->port(), kViewersToken);
  ASSERT_NE(relay, nullptr);
  const auto ask = [&](Role role, const std::string& token, const ClientMessage& message) {
    ClientConfig config = at_port(relay->port(), role);
    config.hello.token = token;
    config.hello.gets_no_stream = true;
    const auto client = ViewerClient::connect(config);
    EXPECT_TRUE(client) << client.error().to_string();
    Notice notice{true, "no notice came"};
    if (!client || !(*client)->send(message)) return notice;
    EXPECT_TRUE(eventually([&] {
      while (const auto event = (*client)->next(milliseconds(5)))
        if (const auto* found = std::get_if<Notice>(&*event)) return notice = *found, true;
      return false;
    }));
    return notice;
  };
  const SetParameter change{"look.hair_color=red"};
  EXPECT_FALSE(ask(Role::Controller, kControllersToken, change).is_error);
  EXPECT_EQ(server_->hub().look().look.hair_color, "red");
  // The relay lets anybody in; the server does not.
  const Notice wrong = ask(Role::Controller, "wrong-0123456789abc", SetParameter{"look.hair_color=blond"});
  EXPECT_TRUE(wrong.is_error);
  const Notice lesser = ask(Role::Controller, kViewersToken, SetParameter{"look.hair_color=blond"});
  EXPECT_THAT(lesser.text, HasSubstr("controller")) << "a viewer's token controls nothing";
  EXPECT_EQ(server_->hub().look().look.hair_color, "red");
  // And who joins later is told the newest look.
  const auto leaf = leaf_of(relay->port());
  ASSERT_NE(leaf, nullptr);
  ASSERT_TRUE(
      pump_until({leaf->session.get()}, [&] { return leaf->session->look().look.hair_color == "red"; }));
}

TEST_F(Relays, WhoOnlyAsksTakesNoSessionOfTheServers) {
  if (!begin()) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  const uint64_t sessions_before = server_->counters().net.joined_sessions;
  constexpr size_t kAsking = 50;
  std::vector<std::unique_ptr<ViewerClient>> clients;
  for (size_t i = 0; i < kAsking; ++i) {
    clients.push_back(speaker_at(*relay));
    ASSERT_NE(clients.back(), nullptr);
    ASSERT_TRUE(clients.back()->send(ParameterRequest{i % 2 == 0 ? "solver" : "look.hair_color"}));
  }
  // Each gets the answer to its own question.
  for (size_t i = 0; i < kAsking; ++i) {
    std::optional<ParameterList> list;
    ASSERT_TRUE(eventually([&] {
      for (ClientEvent& event : clients[i]->poll())
        if (auto* found = std::get_if<ParameterList>(&event)) list = std::move(*found);
      return list.has_value();
    })) << i;
    ASSERT_FALSE(list->parameters.empty());
    EXPECT_TRUE(list->parameters.front().path.starts_with(i % 2 == 0 ? "solver" : "look.hair_color"));
  }
  EXPECT_EQ(server_->counters().net.joined_sessions, sessions_before + 1);
}

// Who only watches leaves uplinks to those who steer and feed, also where all come from one address.
TEST_F(Relays, ManyWatchersSilenceNobodyWhoSteers) {
  if (!begin()) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  std::vector<std::unique_ptr<ViewerClient>> clients;
  for (size_t i = 0; i < kMaxUplinks; ++i) {
    clients.push_back(speaker_at(*relay));
    ASSERT_NE(clients.back(), nullptr);
    ASSERT_TRUE(clients.back()->send(ParameterRequest{"solver", 0, true}));
  }
  size_t answered = 0, refused = 0;
  ASSERT_TRUE(eventually([&] {
    for (const auto& client : clients)
      for (const ClientEvent& event : client->poll()) {
        answered += std::holds_alternative<ParameterList>(event) ? 1 : 0;
        const auto* notice = std::get_if<Notice>(&event);
        refused += notice != nullptr && notice->is_error ? 1 : 0;
      }
    return answered + refused == kMaxUplinks;
  }));
  EXPECT_EQ(answered, kMaxUplinksPerAddress);
  const auto controller = speaker_at(*relay, Role::Controller);
  ASSERT_NE(controller, nullptr);
  ASSERT_TRUE(controller->send(ControlCommand{Command::Pause}));
  EXPECT_TRUE(eventually([&] { return server_->counters().sim.is_paused; }));
  ASSERT_TRUE(controller->send(ControlCommand{Command::Resume}));
  const auto source = speaker_at(*relay, Role::Source);
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(eventually([&] {
    (void)source->send(MotionSamples{{{now_ns(), Pose{}}}});
    return !server_->counters().sim.is_motion_stale;
  }));
  EXPECT_TRUE(relay->readiness().ok()) << "the stream goes on";
}

TEST_F(Relays, AnUplinkThatSaysNothingIsClosedAndOpenedAgain) {
  if (!begin()) return;
  RelayConfig config;
  config.net.port = 0;
  config.upstream.address = {"127.0.0.1", server_->port()};
  config.idle_uplink_ns = 1;
  auto relay = Relay::start(config);
  ASSERT_TRUE(relay) << relay.error().to_string();
  ASSERT_TRUE(eventually([&] { return (*relay)->readiness().ok(); }));
  const uint64_t sessions_before = server_->counters().net.joined_sessions;
  const auto controller = speaker_at(**relay, Role::Controller);
  ASSERT_NE(controller, nullptr);
  for (const char* color : {"red", "blond"}) {
    EXPECT_TRUE(eventually([&] {
      (void)controller->send(SetParameter{fmt::format("look.hair_color={}", color)});
      std::this_thread::sleep_for(milliseconds(100));
      return server_->hub().look().look.hair_color == color;
    }));
    EXPECT_TRUE(eventually([&] { return server_->counters().net.joined_sessions == sessions_before; }));
  }
}

// Viewers whose tokens the server above does not know lock nobody else at the relay's address out.
TEST_F(Relays, WrongTokensThatComeThroughLockNobodyOut) {
  tokens_ = {{kViewersToken, Grant::Viewer}, {kControllersToken, Grant::Controller}};
  is_like_all_others_ = true;
  if (!begin()) return;
  const auto relay = relay_of(server_->port(), kViewersToken);
  ASSERT_NE(relay, nullptr);
  std::vector<std::unique_ptr<ViewerClient>> strangers;
  for (size_t i = 0; i < 8; ++i) {
    strangers.push_back(speaker_at(*relay, Role::Controller, fmt::format("unknown-0123456789-{}", i)));
    ASSERT_NE(strangers.back(), nullptr);
    ASSERT_TRUE(strangers.back()->send(ControlCommand{Command::Pause}));
    bool is_refused = false;
    ASSERT_TRUE(eventually([&] {
      for (const ClientEvent& event : strangers.back()->poll())
        if (const auto* notice = std::get_if<Notice>(&event)) is_refused = is_refused || notice->is_error;
      return is_refused;
    }));
  }
  const auto controller = speaker_at(*relay, Role::Controller, kControllersToken);
  ASSERT_NE(controller, nullptr);
  ASSERT_TRUE(controller->send(ControlCommand{Command::Pause}));
  EXPECT_TRUE(eventually([&] { return server_->counters().sim.is_paused; }));
}

TEST_F(Relays, AServerThatWasStartedAnewIsFoundAgain) {
  if (!begin()) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  auto leaf = LiveConnection::open(at_port(relay->port()));
  ASSERT_TRUE(leaf) << leaf.error().to_string();
  const std::string before = (*leaf)->session().welcome().session_id;
  ASSERT_TRUE(eventually([&] {
    (*leaf)->pump(milliseconds(5));
    return (*leaf)->session().has_picture();
  }));
  const uint16_t port = server_->port();
  server_->stop();
  server_.reset();
  ASSERT_TRUE(eventually([&] { return !relay->readiness().ok(); }));
  // With other hair, which the viewer must be told.
  if (!begin(test::bald_scene(200, 10), port)) return;
  ASSERT_TRUE(eventually([&] {
    (*leaf)->pump(milliseconds(5));
    return (*leaf)->is_connected() && (*leaf)->session().welcome().session_id != before &&
           (*leaf)->session().has_picture();
  }));
  EXPECT_EQ((*leaf)->session().welcome().strand_count, 200u);
  EXPECT_EQ(relay->counters().reconnects, 1u);
}

constexpr uint32_t kAnnasStrands = 120;
constexpr uint32_t kBensStrands = 200;

/// A head beside others, whose states are sent as they are published.
SceneDesc head_called(const std::string& name, uint32_t strand_count) {
  SceneDesc scene = test::bald_scene(strand_count, 10);
  scene.name = name;
  scene.stream.codec = "delta";
  scene.stream.has_codec = true;
  scene.stream.bound_m = kCoarsestBoundM;
  return scene;
}
SceneDesc two_heads(const std::string& second = "ben") {
  SceneDesc scene = head_called("anna", kAnnasStrands);
  scene.heads = {head_called(second, kBensStrands)};
  return scene;
}

TEST_F(Relays, AllHeadsComeThrough) {
  if (!begin(two_heads())) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  const std::map<std::string, uint32_t> strands_of = {{"anna", kAnnasStrands}, {"ben", kBensStrands}};
  for (const auto& [head, strands] : strands_of) {
    const auto direct = leaf_of(of_head(head, server_->port()));
    const auto relayed = leaf_of(of_head(head, relay->port()));
    ASSERT_NE(direct, nullptr);
    ASSERT_NE(relayed, nullptr);
    const Welcome& welcome = relayed->session->welcome();
    EXPECT_EQ(welcome.scene_name, head);
    EXPECT_EQ(welcome.strand_count, strands);
    EXPECT_THAT(welcome.heads, testing::ElementsAre("anna", "ben"));
    ASSERT_TRUE(pump_until({direct->session.get(), relayed->session.get()},
                           [&] { return count_equal(direct->seen, relayed->seen) >= 30; }));
    EXPECT_EQ(count_other(direct->seen, relayed->seen), 0u) << head;
  }
  // What is said of one head is said to it, and its pictures come to whoever asked for them.
  ClientConfig config = of_head("ben", relay->port(), Role::Controller);
  config.hello.gets_no_stream = true;
  const auto controller = ViewerClient::connect(config);
  ASSERT_TRUE(controller) << controller.error().to_string();
  ASSERT_TRUE((*controller)->send(SetParameter{"look.hair_color=red"}));
  EXPECT_TRUE(eventually([&] { return server_->hub(1).look().look.hair_color == "red"; }));
  EXPECT_NE(server_->hub(0).look().look.hair_color, "red");
  ClientConfig of_pictures = of_head("ben", relay->port());
  of_pictures.hello.mode = StreamMode::Frames;
  const auto pictures = open(of_pictures);
  ASSERT_NE(pictures, nullptr);
  EXPECT_TRUE(pump_until({pictures.get()}, [&] { return pictures->image_count() > 2; }));
  const auto stranger = ViewerClient::connect(of_head("carl", relay->port()));
  ASSERT_FALSE(stranger);
  EXPECT_THAT(stranger.error().to_string(),
              AllOf(HasSubstr("no head called 'carl'"), HasSubstr("anna, ben")));
}

TEST_F(Relays, OneHeadAloneWhereOneWasNamed) {
  if (!begin(two_heads())) return;
  const auto relay = relay_of(server_->port(), {}, true, "ben");
  ASSERT_NE(relay, nullptr);
  const auto leaf = leaf_of(relay->port());
  ASSERT_NE(leaf, nullptr);
  EXPECT_EQ(leaf->session->welcome().strand_count, kBensStrands);
  EXPECT_THAT(leaf->session->welcome().heads, testing::IsEmpty());
  const auto stranger = ViewerClient::connect(of_head("anna", relay->port()));
  ASSERT_FALSE(stranger);
  EXPECT_THAT(stranger.error().to_string(), HasSubstr("this relay passes on 'ben'"));
}

TEST_F(Relays, HeadsThatComeAndGoAreFollowed) {
  if (!begin(two_heads())) return;
  const uint16_t port = server_->port();
  const auto relay = relay_of(port);
  ASSERT_NE(relay, nullptr);
  auto of_ben = LiveConnection::open(of_head("ben", relay->port()));
  ASSERT_TRUE(of_ben) << of_ben.error().to_string();
  const auto start_anew = [&](SceneDesc scene) {
    server_->stop();
    server_.reset();
    ASSERT_TRUE(eventually([&] { return !relay->readiness().ok(); }));
    ASSERT_TRUE(begin(std::move(scene), port));
    ASSERT_TRUE(eventually([&] { return relay->readiness().ok(); }));
  };
  start_anew(head_called("anna", kAnnasStrands));
  // Who is there hears that the head is gone, and finds it when it comes again; nobody else is let in.
  ASSERT_TRUE(eventually([&] {
    (*of_ben)->pump(milliseconds(5));
    return (*of_ben)->trouble().find("no head called 'ben'") != std::string::npos;
  }));
  auto newcomer = LiveConnection::begin(of_head("ben", relay->port()));
  ASSERT_TRUE(
      eventually([&] { return newcomer->pump(milliseconds(5)), newcomer->final_error().has_value(); }));
  EXPECT_THAT(newcomer->final_error()->to_string(), HasSubstr("no head called 'ben'"));
  start_anew(two_heads("ben"));
  ASSERT_TRUE(eventually([&] { return (*of_ben)->pump(milliseconds(5)), (*of_ben)->is_connected(); }));
  start_anew(two_heads("carl"));
  const auto of_carl = leaf_of(of_head("carl", relay->port()));
  ASSERT_NE(of_carl, nullptr);
  EXPECT_TRUE(pump_until({of_carl->session.get()}, [&] { return of_carl->seen.size() > 10; }));
  EXPECT_EQ(of_carl->session->welcome().strand_count, kBensStrands);
}

TEST_F(Relays, ViewersOfOneThatComesLateWait) {
  test::FakeServer silent([](test::FakePeer& peer) { peer.wait_for_test_end(); });
  const auto relay = relay_of(silent.port(), {}, false);
  ASSERT_NE(relay, nullptr);
  const auto session = ViewerClient::connect(at_port(relay->port()));
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().code, ErrorCode::Unavailable) << "a viewer comes back by itself";
  EXPECT_THAT(session.error().to_string(), HasSubstr("has no connection to its server"));
  EXPECT_THAT(test::http_get(relay->port(), "/readyz"), AllOf(HasSubstr("503"), HasSubstr("its server")));
  EXPECT_FALSE(relay->failure());
}

TEST_F(Relays, ViewersMeasureTheClockOfTheServer) {
  // Frames are stamped with it, whoever passes them on.
  constexpr int64_t kAheadNs = 3'600'000'000'000;
  test::FakeServer ahead([](test::FakePeer& peer) {
    Welcome welcome = test::make_welcome(1, 2);
    if (!peer.welcome(welcome)) return;
    StreamList streams;
    streams.classes.emplace_back();
    streams.codecs = {"delta"};
    (void)peer.send(streams);
    FrameHeader asset;
    asset.opcode = Opcode::Asset;
    asset.sequence = 1;
    (void)peer.send(*make_encoded_frame(asset, {}));
    while (const auto ping = peer.read_until<Ping>())
      (void)peer.send(Pong{ping->client_time_ns, now_ns() + kAheadNs, now_ns() + kAheadNs});
  });
  const auto near = relay_of(ahead.port());
  ASSERT_NE(near, nullptr);
  const auto far = relay_of(near->port(), {}, false);
  ASSERT_NE(far, nullptr);
  for (const auto* relay : {&near, &far}) {
    std::unique_ptr<ViewerClient> client;
    ASSERT_TRUE(eventually([&] {
      auto connected = ViewerClient::connect(at_port((*relay)->port()));
      if (connected) client = std::move(connected).value();
      return client != nullptr;
    }));
    ASSERT_TRUE(eventually([&] { return client->clock().has_value(); }));
    const int64_t error_ns = std::abs(client->clock().offset_ns() - kAheadNs);
    EXPECT_LT(error_ns, kAheadNs / 100);
  }
}

TEST_F(Relays, ARingIsRefused) {
  // Whoever is asked says that this relay stands before it already.
  test::FakeServer ring([](test::FakePeer& peer) {
    if (!peer.upgrade()) return;
    const auto hello = peer.read_until<Hello>();
    if (!hello) return;
    Welcome welcome = test::make_welcome(1, 2);
    welcome.relays = {"0123456789abcdef", hello->relay_id};
    (void)peer.send(welcome);
    peer.wait_for_test_end();
  });
  const auto relay = relay_of(ring.port(), {}, false);
  ASSERT_NE(relay, nullptr);
  ASSERT_TRUE(eventually([&] { return relay->failure().has_value(); }));
  EXPECT_THAT(relay->failure()->to_string(), HasSubstr("stands behind itself"));
}

TEST_F(Relays, TooLongARowIsRefused) {
  test::FakeServer last([](test::FakePeer& peer) {
    Welcome welcome = test::make_welcome(1, 2);
    for (size_t i = 0; i < kMaxRelays; ++i) welcome.relays.push_back(fmt::format("{:016x}", i));
    (void)peer.welcome(welcome);
    peer.wait_for_test_end();
  });
  const auto relay = relay_of(last.port(), {}, false);
  ASSERT_NE(relay, nullptr);
  ASSERT_TRUE(eventually([&] { return relay->failure().has_value(); }));
  EXPECT_THAT(relay->failure()->to_string(), HasSubstr("one behind another"));
}

TEST_F(Relays, AWrongTokenEndsItWithASentenceAndAWrongAnswerIsTold) {
  tokens_ = {{kViewersToken, Grant::Viewer}};
  if (!begin()) return;
  const auto stranger = relay_of(server_->port(), "wrong-0123456789abc", false);
  ASSERT_NE(stranger, nullptr);
  ASSERT_TRUE(eventually([&] { return stranger->failure().has_value(); }));
  EXPECT_EQ(stranger->failure()->code, ErrorCode::Unauthorized);
  test::FakeServer garbage([](test::FakePeer& peer) { (void)peer.send_raw("220 mail.example\r\n"); });
  const auto lost = relay_of(garbage.port(), {}, false);
  ASSERT_NE(lost, nullptr);
  ASSERT_TRUE(eventually([&] {
    const Status ready = lost->readiness();
    return !ready && ready.error().to_string().find("handshake") != std::string::npos;
  }));
  EXPECT_FALSE(lost->failure()) << "somebody else may answer there the next time";
}

TEST_F(Relays, ASlowLeafChangesNothingForOthers) {
  if (!begin()) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  const auto leaf = leaf_of(relay->port());
  ASSERT_NE(leaf, nullptr);
  test::RawClient slow(relay->port(), 4096);
  ASSERT_TRUE(slow.handshake());
  Hello hello;
  hello.name = "slow";
  hello.acknowledges = true;
  slow.send(hello);  // and reads nothing
  ASSERT_TRUE(pump_until({leaf->session.get()}, [&] { return leaf->seen.size() >= 60; }));
  EXPECT_EQ(count_wrong(leaf->seen, published()), 0u);
  EXPECT_TRUE(relay->readiness().ok());
}

TEST_F(Relays, PicturesComeThroughToTheOneWhoAsked) {
  if (!begin(test::small_scene())) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  ClientConfig config = at_port(relay->port());
  config.hello.mode = StreamMode::Frames;
  const auto session = open(config);
  ASSERT_NE(session, nullptr);
  EXPECT_EQ(session->welcome().mode, StreamMode::Frames);
  ASSERT_TRUE(pump_until({session.get()}, [&] { return session->image_count() > 5; }));
  EXPECT_EQ(session->image()->width, 64u);
  EXPECT_EQ(session->picture_stats().rejected_frames, 0u);
}

TEST_F(Relays, ItSaysHowItGoes) {
  if (!begin()) return;
  const auto relay = relay_of(server_->port());
  ASSERT_NE(relay, nullptr);
  const std::string answer = test::http_get(relay->port(), "/metrics");
  std::vector<std::string> faults;
  const auto families = test::read_metrics(answer.substr(answer.find("\r\n\r\n") + 4), faults);
  test::check_metrics(families, faults);
  EXPECT_THAT(faults, testing::IsEmpty());
  ASSERT_TRUE(families.contains("strandcast_relay_upstream_connected"));
  EXPECT_EQ(families.at("strandcast_relay_upstream_connected").samples.front().second, 1.0);
  EXPECT_GT(families.at("strandcast_relay_received_bytes_total").samples.front().second, 0.0);
}

}  // namespace
}  // namespace strandcast::relay_test
