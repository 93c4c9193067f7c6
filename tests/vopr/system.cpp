#include "tests/vopr/system.h"

#include <fmt/format.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "client/app/feed.h"
#include "client/app/live_connection.h"
#include "client/app/steady_client.h"
#include "server/app/server.h"
#include "server/relay/relay.h"
#include "server/relay/uplinks.h"
#include "tests/vopr/book.h"
#include "tests/vopr/disk.h"
#include "tests/vopr/net.h"
#include "tests/vopr/world.h"

namespace strandcast::vopr {
namespace {

using std::chrono::milliseconds;

constexpr NodeId kServer = 1;
constexpr NodeId kFirstRelay = 2;
constexpr NodeId kFirstViewer = 10;
constexpr NodeId kFeeder = 30;
constexpr NodeId kController = 31;
constexpr NodeId kFirstAttacker = 40;
constexpr uint16_t kPort = 7878;
constexpr size_t kRelays = 2, kViewers = 8, kAttackers = 2;
constexpr const char* kViewersToken = "viewers-0123456789";
constexpr const char* kControllersToken = "controllers-0123456789";
constexpr const char* kSourcesToken = "sources-0123456789";

std::string address_of(NodeId node) {
  return fmt::format("10.0.0.{}", node);
}

/// Every line of the product's log.
class LogSink : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  LogSink(Book& book, bool is_shown) : book_(book), is_shown_(is_shown) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string line = fmt::format("{:>2} {}", world::node(),
                                         std::string_view(message.payload.data(), message.payload.size()));
    if (is_shown_) fmt::print("{:12.6f} {}\n", static_cast<double>(world::time_ns()) * 1e-9 - 1000.0, line);
    book_.on_line(line);
  }
  void flush_() override {}

 private:
  Book& book_;
  const bool is_shown_;
};

/// What a seed chooses.
struct Cast {
  std::string codec;
  NodeId upstream_of_second_relay = kServer;
  std::vector<NodeId> stage_of_viewer;  // where each connects
  bool is_recorded = false;

  explicit Cast(Random& random) {
    const std::vector<std::string> codecs = {"delta", "step", "tangent"};
    codec = codecs[random.below(3)];
    upstream_of_second_relay = random.one_in(2) ? kFirstRelay : kServer;
    for (size_t i = 0; i < kViewers; ++i) stage_of_viewer.push_back(kServer + random.below(1 + kRelays));
    is_recorded = random.one_in(4);
  }
  std::vector<NodeId> way_from(NodeId node, NodeId stage) const {
    if (stage == kServer) return {node, kServer};
    std::vector<NodeId> way = {node, stage};
    if (stage == kFirstRelay + 1 && upstream_of_second_relay != kServer) way.push_back(kFirstRelay);
    way.push_back(kServer);
    return way;
  }
};

NetConfig listening_at(NodeId node) {
  NetConfig net;
  net.address = address_of(node);
  net.port = kPort;
  net.tokens = {
      {kViewersToken, Grant::Viewer}, {kControllersToken, Grant::Controller}, {kSourcesToken, Grant::Source}};
  return net;
}

ClientConfig connecting_to(NodeId node, Role role, const char* token, const std::string& name) {
  ClientConfig config;
  config.address.host = address_of(node);
  config.address.port = kPort;
  config.hello.role = role;
  config.hello.token = token;
  config.hello.name = name;
  return config;
}

/// A server or a relay that is killed and started again.
template <class Program>
class Host {
 public:
  Host(NodeId node, std::function<Result<std::unique_ptr<Program>>()> start)
      : node_(node), start_(std::move(start)), thread_([this] { run(); }) {}
  void kill_for(int64_t down_ns) { down_ns_ = down_ns; }
  void finish() {
    is_over_ = true;
    thread_.join();
  }
  Program* program() { return program_.get(); }

 private:
  void run() {
    world::set_node(node_);
    while (!is_over_) {
      auto started = start_();
      if (!started) world::fail("does not start: " + started.error().to_string());
      program_ = std::move(started).value();
      world::note(fmt::format("{:>2} has started", node_));
      while (!is_over_ && down_ns_ == 0) std::this_thread::sleep_for(milliseconds(50));
      if (is_over_) break;
      world::note(fmt::format("{:>2} is killed", node_));
      Network::get().pull_plug(node_);
      Disk::of(node_).die();
      const int64_t up_ns = world::time_ns() + down_ns_.exchange(0);
      program_->stop();
      program_.reset();
      Disk::of(node_).revive();
      world::sleep_until(up_ns);
    }
    if (program_ != nullptr) program_->stop();
    program_.reset();
  }

  const NodeId node_;
  const std::function<Result<std::unique_ptr<Program>>()> start_;
  std::unique_ptr<Program> program_;
  std::atomic<int64_t> down_ns_{0};
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

/// Plants that are still to be had; each is taken once.
class Plants {
 public:
  explicit Plants(Plant plant) : plant_(plant) {}
  bool take(Plant plant) {
    if (plant_ != plant) return false;
    plant_ = Plant::None;
    world::note("the fault is planted");
    return true;
  }

 private:
  Plant plant_;
};

class Viewer {
 public:
  Viewer(NodeId node, NodeId stage, Party& party, Book& book, Plants& plants, bool is_exact)
      : node_(node),
        stage_(stage),
        party_(party),
        book_(book),
        plants_(plants),
        is_exact_(is_exact),
        thread_([this] { run(); }) {}
  void finish() {
    is_over_ = true;
    thread_.join();
  }

 private:
  void run() {
    world::set_node(node_);
    ClientConfig config = connecting_to(stage_, Role::Viewer, kViewersToken, party_.name);
    config.hello.mode = StreamMode::Strands;
    if (node_ % 2 == 0) config.hello.step_ns = 1.0;  // it can afford what the codec `step` asks of viewers
    const auto live = LiveConnection::begin(config);
    constexpr uint64_t kPlantAt = 20;
    while (!is_over_) {
      if (live->pump(milliseconds(100))) watch(*live);
      if (const auto& error = live->final_error())
        world::fail(fmt::format("{} gives up for good: {}", party_.name, error->to_string()));
      const bool is_away = states_ > kPlantAt && !live->is_connected();
      if (is_away && plants_.take(Plant::StaysAway)) break;
      if (!live->is_connected() && !live->trouble().empty() && plants_.take(Plant::FirstIsFinal)) break;
      if (states_ > kPlantAt && plants_.take(Plant::TokenInLog))
        spdlog::info("[net] token " + config.hello.token);
    }
    check_totals(*live);
  }

  /// What it reports covers all of its connections.
  void check_totals(LiveConnection& live) {
    if (connections_ == 0) return;
    uint64_t decoded = live.session().decoded_frames();
    if (connections_ < 2 || !plants_.take(Plant::ReportForgets)) decoded += live.earlier().decoded_frames;
    if (decoded < states_ || live.reconnects() + 1 != connections_)
      world::fail(fmt::format("{} reports {} frames and {} reconnects of {} states and {} connections",
                              party_.name, decoded, live.reconnects(), states_, connections_));
  }

  void watch(LiveConnection& live) {
    ViewerSession& session = live.session();
    ++connections_;
    world::note(fmt::format("{:>2} {} is in", node_, party_.name));
    session.set_snapshot_listener([this, &session](const std::shared_ptr<const Snapshot>& state) {
      constexpr uint64_t kPlantAt = 20;
      uint64_t hash = state_hash(*state);
      if (++states_ > kPlantAt && plants_.take(Plant::WrongHash)) ++hash;
      const StrandReplay& replay = session.replay();
      book_.on_decoded(party_,
                       {session.welcome().session_id, replay.stream_id(), replay.sequence(), state->tick},
                       hash, is_exact_);
    });
  }

  const NodeId node_, stage_;
  Party& party_;
  Book& book_;
  Plants& plants_;
  const bool is_exact_;
  uint64_t states_ = 0, connections_ = 0;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

/// Sets one value after another, and waits for each answer.
class Controller {
 public:
  Controller(Party& party, Party& feeder, Book& book, Plants& plants)
      : party_(party), feeder_(feeder), book_(book), plants_(plants), thread_([this] { run(); }) {}
  void finish() {
    is_over_ = true;
    thread_.join();
  }

 private:
  void run() {
    world::set_node(kController);
    ClientConfig config = connecting_to(kServer, Role::Controller, kControllersToken, party_.name);
    config.hello.gets_no_stream = true;
    SteadyClient client(config);
    while (!is_over_) {
      const Status pumped = client.pump(milliseconds(100), [this](ClientEvent& event) {
        if (const auto* notice = std::get_if<Notice>(&event)) hear(*notice);
        const auto* status = std::get_if<ServerStatus>(&event);
        if (status != nullptr && !status->is_motion_stale) book_.on_well(feeder_);
      });
      if (!pumped)
        world::fail(fmt::format("{} gives up for good: {}", party_.name, pumped.error().to_string()));
      if (client.client() != last_client_) change_.clear();  // nobody knows what has become of it
      last_client_ = client.client();
      if (client.client() != nullptr) speak(*client.client());
    }
  }

  void speak(ViewerClient& client) {
    const int64_t time_ns = world::time_ns();
    if (!change_.empty()) {
      if (time_ns < party_.due_ns || time_ns - sent_ns_ <= kHeardNs) return;
      world::fail(fmt::format("'{}' has had no answer for {:.3f} s", change_,
                              static_cast<double>(time_ns - sent_ns_) * 1e-9));
    }
    if (time_ns < next_ns_) return;
    constexpr int kPlantAt = 4;
    if (number_ == kPlantAt) is_flooding_ = plants_.take(Plant::OneQueue);
    for (int i = 0; is_flooding_ && i < 200; ++i) (void)client.send(SetParameter{"gravity_mps2.x=0.1"});
    change_ = fmt::format("follicle_limit_deg={:.3f}", 20.0 + 0.001 * ++number_);
    book_.on_asked(change_);
    sent_ns_ = time_ns;
    if (number_ <= kPlantAt || !plants_.take(Plant::Deaf)) (void)client.send(SetParameter{change_});
    if (number_ > kPlantAt && plants_.take(Plant::DoneTwice)) (void)client.send(SetParameter{change_});
  }

  void hear(const Notice& notice) {
    if (change_.empty() || notice.text.find(change_) == std::string::npos) return;
    if (notice.is_error) world::fail(fmt::format("'{}' was refused: {}", change_, notice.text));
    book_.on_answered(change_);
    change_.clear();
    next_ns_ = world::time_ns() + 500 * kMs;
  }

  Party& party_;
  Party& feeder_;
  Book& book_;
  Plants& plants_;
  bool is_flooding_ = false;
  ViewerClient* last_client_ = nullptr;
  std::string change_;
  int number_ = 0;
  int64_t sent_ns_ = 0, next_ns_ = 0;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

/// Head motion and wind.
class Feeder {
 public:
  Feeder(NodeId stage, Plants& plants) : stage_(stage), plants_(plants), thread_([this] { run(); }) {}
  void finish() {
    is_over_ = true;
    thread_.join();
  }

 private:
  void run() {
    world::set_node(kFeeder);
    std::vector<std::unique_ptr<SteadyClient>> heads;
    ClientConfig config = connecting_to(stage_, Role::Source, kSourcesToken, "feeder");
    config.hello.gets_no_stream = true;
    heads.push_back(std::make_unique<SteadyClient>(config));
    FeedPlan plan;
    plan.rate_hz = 10.0;
    plan.is_live = true;
    plan.motion = [](double t_s) {
      Pose pose;
      pose.position_m = glm::dvec3(0.05 * std::sin(t_s), 0.0, 0.0);
      return pose;
    };
    plan.wind = [](double t_s) { return glm::vec3(static_cast<float>(std::cos(t_s)), 0.0f, 0.5f); };
    const auto watched = [&](const FeedProgress& progress) {
      if (progress.reconnects > 0 && plants_.take(Plant::FeederEnds)) is_over_ = true;
    };
    const auto fed = feed(heads, plan, is_over_, watched);
    if (!fed) world::fail("the feeder gives up for good: " + fed.error().to_string());
  }

  const NodeId stage_;
  Plants& plants_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

/// A controller who may speak, and does so as often as it can.
class Attacker {
 public:
  explicit Attacker(NodeId node) : node_(node), thread_([this] { run(); }) {}
  void finish() {
    is_over_ = true;
    thread_.join();
  }

 private:
  void run() {
    world::set_node(node_);
    ClientConfig config = connecting_to(kServer, Role::Controller, kControllersToken, "attacker");
    config.hello.gets_no_stream = true;
    SteadyClient client(config);
    int number = 0;
    int burst = 0;
    int64_t next_ns = 0;
    while (!is_over_) {
      (void)client.pump(milliseconds(100), [](ClientEvent&) {});
      if (client.client() == nullptr || world::time_ns() < next_ns) continue;
      // Bursts of more than it may say (ControlBudget): for some seconds, then again after a while.
      next_ns = world::time_ns() + (++burst % 4 == 0 ? 20 * kS : 1 * kS);
      for (int i = 0; i < 80; ++i)
        (void)client.client()->send(
            SetParameter{fmt::format("gravity_mps2.x={:.3f}", 0.001 * (++number % 100))});
    }
  }

  const NodeId node_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

class System {
 public:
  System(const RunPlan& plan, Book& book)
      : plan_(plan),
        book_(book),
        plants_(plan.plant),
        random_(plan.seed ^ 0x9e3779b97f4a7c15ull),
        cast_(random_) {}

  RunResult run();

 private:
  void set_links();
  void start();
  void finish();
  void do_harm();
  void plant_in_relays();
  void harm_link(NodeId a, NodeId b);
  void harm_machine(NodeId node);
  std::pair<NodeId, NodeId> some_link();

  const RunPlan plan_;
  Book& book_;
  Plants plants_;
  Random random_;
  const Cast cast_;
  std::unique_ptr<Host<Server>> server_;
  std::vector<std::unique_ptr<Host<Relay>>> relays_;
  std::vector<std::unique_ptr<Viewer>> viewers_;
  std::vector<std::vector<NodeId>> ways_;
  std::unique_ptr<Controller> controller_;
  std::unique_ptr<Feeder> feeder_;
  std::vector<std::unique_ptr<Attacker>> attackers_;
  uint64_t faults_ = 0;
  std::vector<std::filesystem::path> recordings_;
};

void System::set_links() {
  std::vector<NodeId> nodes = {kServer, kFeeder, kController};
  for (NodeId i = 0; i < kRelays; ++i) nodes.push_back(kFirstRelay + i);
  for (NodeId i = 0; i < kViewers; ++i) nodes.push_back(kFirstViewer + i);
  for (NodeId i = 0; i < kAttackers; ++i) nodes.push_back(kFirstAttacker + i);
  for (size_t a = 0; a < nodes.size(); ++a)
    for (size_t b = 0; b < a; ++b) {
      LinkQuality link;
      link.bytes_per_s = 1e5 * std::pow(10.0, random_.below(300) / 100.0);
      link.delay_ns = random_.between(50 * kUs, 60 * kMs);
      link.jitter_ns = random_.one_in(2) ? random_.between(0, 20 * kMs) : 0;
      Network::get().set_link(nodes[a], nodes[b], link);
    }
  for (const NodeId node : nodes)
    world::set_clock(node, random_.between(0, 5'000) * kS, random_.between(-200, 200));
}

void System::start() {
  server_ = std::make_unique<Host<Server>>(kServer, [this] {
    ServerConfig config;
    config.scene = scene_of_run(cast_.codec);
    config.net = listening_at(kServer);
    config.sim_device = "lanes";
    config.renderer = "tiles";
    config.on_publish = [this](const auto& state) {
      constexpr uint64_t kPlantAt = 30;
      book_.on_published(*state);
      if (state->tick > kPlantAt && plants_.take(Plant::LongCommand))
        world::sleep_until(world::time_ns() + 60 * kS);
    };
    if (cast_.is_recorded) {
      recordings_.push_back(plan_.folder / fmt::format("{}.mcap", recordings_.size()));
      config.record = RecordConfig{recordings_.back()};
    }
    return Server::start(config);
  });
  for (NodeId i = 0; i < kRelays; ++i) {
    const NodeId node = kFirstRelay + i;
    relays_.push_back(std::make_unique<Host<Relay>>(node, [this, node] {
      RelayConfig config;
      config.net = listening_at(node);
      const NodeId upstream = node == kFirstRelay ? kServer : cast_.upstream_of_second_relay;
      config.upstream.address.host = address_of(upstream);
      config.upstream.address.port = kPort;
      config.upstream.token = kViewersToken;
      return Relay::start(config);
    }));
  }
  for (NodeId i = 0; i < kViewers; ++i) {
    const NodeId node = kFirstViewer + i, stage = cast_.stage_of_viewer[i];
    ways_.push_back(cast_.way_from(node, stage));
    Party& party = book_.add(fmt::format("viewer-{}", node), ways_.back(), true);
    viewers_.push_back(std::make_unique<Viewer>(node, stage, party, book_, plants_, cast_.codec == "delta"));
  }
  ways_.push_back({kController, kServer});
  // That it is heard, the controller hears.
  std::vector<NodeId> way = cast_.way_from(kFeeder, cast_.stage_of_viewer[0]);
  way.push_back(kController);
  Party& feeder = book_.add("feeder", std::move(way), true);
  feeder.slow_ns = kSpeakAgainNs + kS;  // a relay's uplink, and a status later
  Party& controller = book_.add("controller", ways_.back(), false);
  controller_ = std::make_unique<Controller>(controller, feeder, book_, plants_);
  feeder_ = std::make_unique<Feeder>(cast_.stage_of_viewer[0], plants_);
  for (NodeId i = 0; i < kAttackers; ++i)
    attackers_.push_back(std::make_unique<Attacker>(kFirstAttacker + i));
  book_.disturb(kServer, world::time_ns(), 0);  // all begin at once
}

void System::finish() {
  for (const auto& one : attackers_) one->finish();
  feeder_->finish();
  controller_->finish();
  for (const auto& one : viewers_) one->finish();
  for (const auto& one : relays_) one->finish();
  server_->finish();
}

std::pair<NodeId, NodeId> System::some_link() {
  const std::vector<NodeId>& way = ways_[random_.below(static_cast<uint32_t>(ways_.size()))];
  const uint32_t at = random_.below(static_cast<uint32_t>(way.size()) - 1);
  return {way[at], way[at + 1]};
}

void System::harm_link(NodeId a, NodeId b) {
  const int64_t time_ns = world::time_ns();
  switch (random_.below(3)) {
    case 0: {
      const int64_t end_ns = time_ns + random_.between(100 * kMs, 4 * kS);
      world::note(
          fmt::format(" 0 {} - {} stalls for {:.3f} s", a, b, static_cast<double>(end_ns - time_ns) * 1e-9));
      Network::get().stall(a, b, end_ns);
      return book_.disturb(a, b, end_ns, 0);
    }
    case 1:
      world::note(fmt::format(" 0 {} - {} falls silent", a, b));
      Network::get().silence(a, b);
      return book_.disturb(a, b, time_ns, kDoubtNs);
    default:
      world::note(fmt::format(" 0 {} - {} breaks", a, b));
      Network::get().reset(a, b);
      return book_.disturb(a, b, time_ns, 0);
  }
}

void System::harm_machine(NodeId node) {
  const int64_t time_ns = world::time_ns();
  const int64_t takes_ns = random_.between(100 * kMs, 3 * kS);
  if (node <= kFirstRelay + kRelays - 1 && random_.one_in(2)) {
    if (node == kServer)
      server_->kill_for(takes_ns);
    else
      relays_[node - kFirstRelay]->kill_for(takes_ns);
    return book_.disturb(node, time_ns + takes_ns + 100 * kMs, 0);
  }
  if (random_.one_in(3)) {
    const int64_t by_ns = random_.between(-3'600 * kS, 3'600 * kS);
    world::note(fmt::format(" 0 the time of day of {} jumps by {} s", node, by_ns / kS));
    return world::jump(node, by_ns);
  }
  world::note(fmt::format(" 0 {} stands still for {:.3f} s", node, static_cast<double>(takes_ns) * 1e-9));
  world::stand_still(node);
  world::at(time_ns + takes_ns, [node] { world::go_on(node); });
  book_.disturb(node, time_ns + takes_ns, 0);
}

/// A relay of before gave up where it now tries again.
void System::plant_in_relays() {
  for (const auto& relay : relays_)
    if (relay->program() != nullptr && world::time_ns() > 1'006 * kS && !relay->program()->readiness() &&
        plants_.take(Plant::RelayEnds))
      relay->kill_for(3'600 * kS);
}

void System::do_harm() {
  ++faults_;
  if (cast_.is_recorded && random_.one_in(8)) return Disk::of(kServer).fill_after(random_.below(20'000));
  const auto [a, b] = some_link();
  if (random_.one_in(2)) return harm_link(a, b);
  harm_machine(random_.one_in(2) ? a : b);
}

RunResult System::run() {
  set_links();
  start();
  const int64_t begin_ns = world::time_ns();
  const int64_t end_ns = begin_ns + static_cast<int64_t>(plan_.simulated_s * 1e9);
  int64_t next_fault_ns = begin_ns + 2 * kS;
  while (world::time_ns() < std::max(end_ns, book_.latest_due_ns())) {
    world::sleep_until(world::time_ns() + 100 * kMs);
    book_.check(world::time_ns());
    if (plan_.plant == Plant::RelayEnds) plant_in_relays();
    const int64_t time_ns = world::time_ns();
    if (!plan_.has_faults || time_ns < next_fault_ns || time_ns >= end_ns) continue;
    do_harm();
    next_fault_ns = world::time_ns() + random_.between(200 * kMs, 12 * kS);
  }
  finish();
  RunResult result;
  if (cast_.is_recorded && plants_.take(Plant::LostBytes)) lose_a_part(recordings_.front());
  for (const auto& path : recordings_) result.recorded_states += check_recovery(path, random_);
  result.simulated_s = static_cast<double>(world::time_ns() - begin_ns) * 1e-9;
  result.digest = world::digest();
  result.compared_states = book_.compared();
  result.answered_changes = book_.answered();
  result.faults = faults_;
  result.switches = world::switch_count();
  if (const auto back_ms = book_.back_ms(); !back_ms.empty()) {
    result.back_median_ms = back_ms[back_ms.size() / 2];
    result.back_longest_ms = back_ms.back();
    const auto within = std::upper_bound(back_ms.begin(), back_ms.end(), kBackNs / kMs) - back_ms.begin();
    result.back_share_2s = static_cast<double>(within) / static_cast<double>(back_ms.size());
  }
  return result;
}

}  // namespace

SceneDesc scene_of_run(const std::string& codec) {
  SceneDesc scene = built_in_scene();
  ProceduralGroomDesc groom;
  groom.strand_count = 24;
  groom.vertex_count = 6;
  scene.groom = groom;
  scene.head.is_visible = false;
  scene.head.collider = kFieldCollider;  // which nothing meets; spheres are fitted for 0.2 s
  scene.head.field_resolution = kMinFieldResolution;
  scene.has_auto_collider = false;
  scene.step_rate_hz = 10.0;
  scene.stream.codec = codec;
  scene.stream.has_codec = true;
  scene.stream.bound_m = kCoarsestBoundM;  // classes are no coarser: all have the bits that were published
  return scene;
}

RunResult run_system(const RunPlan& plan) {
  world::begin(plan.seed);
  world::set_failure_title(fmt::format("seed {}: ", plan.seed));
  auto* const book =
      new Book({kViewersToken, kControllersToken, kSourcesToken});  // logged to until the process ends
  auto logger = std::make_shared<spdlog::logger>("vopr", std::make_shared<LogSink>(*book, plan.is_shown));
  logger->set_level(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
  return System(plan, *book).run();
}

}  // namespace strandcast::vopr
