#include "tests/vopr/links.h"

#include <fmt/format.h>
#include <spdlog/sinks/null_sink.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/app/feed.h"
#include "client/app/live_connection.h"
#include "common/base/units.h"
#include "server/app/server.h"
#include "server/net/strand_class.h"
#include "tests/vopr/net.h"
#include "tests/vopr/world.h"

namespace strandcast::vopr {
namespace links {
namespace {

using std::chrono::milliseconds;

constexpr NodeId kServer = 1, kFeeder = 2, kViewer = 3, kMeasurer = 4;
constexpr uint16_t kPort = 7878;
constexpr const char* kToken = "everybodys-0123456789";
constexpr int64_t kJitterNs = 10 * kMs;
constexpr int64_t kStallNs = 100 * kMs;

// The rules.
constexpr int64_t kFoundNs = 10 * kS;   // after joining, the class is found
constexpr int64_t kSteadyNs = 30 * kS;  // and changes once at most in this time
constexpr size_t kMostChanges = 1;
constexpr double kFittingShare = 0.7;             // of the rate
constexpr int64_t kFirstPictureNs = 1'500 * kMs;  // and kRoundTrips
constexpr int kRoundTrips = 3;
// Until a frame is exact, as far as a viewer decodes by steps: the asset, few strands, then the keyframe of
// all.
constexpr double kBytesUntilExact = 300'000.0;
constexpr int kRoundTripsUntilExact = 6;

constexpr size_t kMostClasses = 16;
constexpr size_t kToldChanges = 4;
// The classes are measured over four turns of the head and back (2 pi / 3 s each).
constexpr int64_t kWarmUpNs = 4 * kS;
constexpr int64_t kMeasuredNs = 8'378 * kMs;

/// Written by the process of a link, read by the one that waits for it.
struct Seen {
  double bytes_per_s[kMostClasses] = {};  // of each class, over a link without limits
  size_t class_count = 0;
  int64_t first_picture_ns = 0;
  size_t first_bytes = 0;  // until then
  int64_t exact_ns = 0;    // until the first frame without corrections; 0: none came
  size_t exact_bytes = 0;
  size_t found_class = 0;
  size_t changes = 0;
  int64_t changed_ns[kToldChanges] = {};
  size_t states = 0;
  int64_t oldest_ns = 0;  // from publishing to decoding
  bool has_joined = false;
};

struct TestedLink {
  bool has_steps = false;  // decodes by steps of the solver
  double mbit_per_s = 0.0;
  int64_t round_trip_ns = 0;
  double stalled_share = 0.0;
};

ClientConfig connecting(bool has_steps) {
  ClientConfig config;
  config.address.host = fmt::format("10.0.0.{}", kServer);
  config.address.port = kPort;
  config.hello.token = kToken;
  config.hello.mode = StreamMode::Strands;
  if (has_steps) config.hello.step_ns = 1.0;
  return config;
}

/// A server whose head is turned to and fro.
class Stage {
 public:
  Stage() {
    world::set_node(kServer);
    ServerConfig config;
    config.scene = built_in_scene();
    config.net.address = fmt::format("10.0.0.{}", kServer);
    config.net.port = kPort;
    config.net.tokens = {{kToken, Grant::Admin}};
    config.sim_device = "lanes";
    config.renderer = "tiles";
    config.on_publish = [this](const auto& state) { published_ns_[state->tick % kTicks] = world::time_ns(); };
    auto started = Server::start(config);
    if (!started) world::fail("the server does not start: " + started.error().to_string());
    server_ = std::move(started).value();
    feeder_ = std::thread([this] { run_feeder(); });
    world::set_node(kFate);
  }
  int64_t published_ns(uint64_t tick) const { return published_ns_[tick % kTicks]; }
  size_t class_count() const {
    return make_strand_classes({.step_rate_hz = 60.0, .strand_count = 2'000}).size();
  }

 private:
  void run_feeder() {
    world::set_node(kFeeder);
    ClientConfig config = connecting(false);
    config.hello.role = Role::Source;
    config.hello.gets_no_stream = true;
    std::vector<std::unique_ptr<SteadyClient>> heads;
    heads.push_back(std::make_unique<SteadyClient>(config));
    FeedPlan plan;
    plan.rate_hz = 60.0;
    plan.is_live = true;
    plan.motion = [](double t_s) {
      Pose pose;
      pose.rotation = glm::angleAxis(0.5 * std::sin(3.0 * t_s), glm::dvec3(0.0, 1.0, 0.0));
      return pose;
    };
    (void)feed(heads, plan, is_over_, {});
  }

  static constexpr size_t kTicks = 4096;
  int64_t published_ns_[kTicks] = {};
  std::unique_ptr<Server> server_;
  std::atomic<bool> is_over_{false};
  std::thread feeder_;
};

/// What each class takes, as a relay gets it.
void measure(const TestedLink& link, Seen& seen) {
  Stage& stage = *new Stage;  // its process ends with it
  seen.class_count = std::min(stage.class_count(), kMostClasses);
  std::vector<std::unique_ptr<LiveConnection>> relays;
  for (size_t i = 0; i < seen.class_count; ++i) {
    ClientConfig config = connecting(link.has_steps);
    config.hello.relay_id = fmt::format("{:016x}", i);
    config.hello.strand_class = static_cast<uint32_t>(i);
    config.hello.codec_wish = link.has_steps ? "step" : "tangent";
    relays.push_back(LiveConnection::begin(config));
  }
  const auto run_until = [&](int64_t end_ns) {
    while (world::time_ns() < end_ns)
      for (const auto& relay : relays) relay->pump(milliseconds(1));
  };
  world::set_node(kMeasurer);
  run_until(world::time_ns() + kWarmUpNs);
  const auto bytes_of = [](LiveConnection& relay) { return totals_of(relay.session()).received_bytes; };
  std::vector<uint64_t> before;
  for (const auto& relay : relays) before.push_back(relay->has_session() ? bytes_of(*relay) : 0);
  run_until(world::time_ns() + kMeasuredNs);
  for (size_t i = 0; i < seen.class_count; ++i)
    if (relays[i]->has_session())
      seen.bytes_per_s[i] =
          static_cast<double>(bytes_of(*relays[i]) - before[i]) * kNsPerS / static_cast<double>(kMeasuredNs);
}

/// Stands still for kStallNs at random, so that it makes this share of all time.
void stall_now_and_then(double share) {
  if (share <= 0.0) return;
  const auto period_ns = static_cast<int64_t>(static_cast<double>(kStallNs) / share);
  world::at(world::time_ns() + world::random().between(period_ns / 2, period_ns * 3 / 2), [share] {
    Network::get().stall(kServer, kViewer, world::time_ns() + kStallNs);
    stall_now_and_then(share);
  });
}

void watch(const TestedLink& link, Seen& seen) {
  LinkQuality quality;
  quality.bytes_per_s = link.mbit_per_s / kMbitPerByte;
  quality.delay_ns = link.round_trip_ns / 2;
  quality.jitter_ns = std::min(kJitterNs, link.round_trip_ns / 2);
  Network::get().set_link(kServer, kViewer, quality);
  Stage& stage = *new Stage;  // its process ends with it
  world::sleep_until(world::time_ns() + 3 * kS);
  stall_now_and_then(link.stalled_share);
  world::set_node(kViewer);
  const int64_t begin_ns = world::time_ns();
  const auto live = LiveConnection::begin(connecting(link.has_steps));
  size_t present = 0;
  const auto take = [&](const std::shared_ptr<const Snapshot>& state) {
    const int64_t since_ns = world::time_ns() - begin_ns;
    if (!std::exchange(seen.has_joined, true)) {
      seen.first_picture_ns = since_ns;
      seen.first_bytes = totals_of(live->session()).received_bytes;
    }
    if (seen.exact_ns == 0 && live->session().replay().stats().exact_frames > 0) {
      seen.exact_ns = since_ns;
      seen.exact_bytes = totals_of(live->session()).received_bytes;
    }
    const size_t now = strand_stream_of(live->session().replay().stream_id()).strand_class;
    if (since_ns < kFoundNs) seen.found_class = now;
    if (since_ns >= kFoundNs && now != present) {
      if (seen.changes < kToldChanges) seen.changed_ns[seen.changes] = since_ns;
      ++seen.changes;
    }
    present = now;
    if (since_ns < kFoundNs) return;
    ++seen.states;
    seen.oldest_ns = std::max(seen.oldest_ns, world::time_ns() - stage.published_ns(state->tick));
  };
  while (world::time_ns() < begin_ns + kFoundNs + kSteadyNs)
    if (live->pump(milliseconds(20))) live->session().set_snapshot_listener(take);
}

/// In a process of its own, since a world begins once in a process.
template <class Work>
Seen in_child(const TestedLink& link, Work work) {
  auto* const seen =
      new (mmap(nullptr, sizeof(Seen), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Seen;
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    world::begin(1);
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("links", std::make_shared<spdlog::sinks::null_sink_st>()));
    work(link, *seen);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  const Seen copy = *seen;
  munmap(seen, sizeof(Seen));
  return copy;
}

/// Empty where all rules hold.
std::string broken_rules(const TestedLink& link, const Seen& seen, size_t fitting) {
  if (!seen.has_joined) return "no picture";
  std::string broken;
  if (seen.first_picture_ns > kFirstPictureNs + kRoundTrips * link.round_trip_ns) broken += " late";
  const double load_ns = kBytesUntilExact * kMbitPerByte / link.mbit_per_s * kNsPerS;
  const auto exact_until_ns =
      kRoundTripsUntilExact * link.round_trip_ns + static_cast<int64_t>(load_ns) + kStallNs;
  if (link.has_steps && (seen.exact_ns == 0 || seen.exact_ns > exact_until_ns)) broken += " inexact";
  if (seen.found_class > fitting) broken += " coarse";
  if (seen.changes > kMostChanges) broken += " restless";
  return broken;
}

std::string change_times(const Seen& seen) {
  std::string text;
  for (size_t i = 0; i < std::min(seen.changes, kToldChanges); ++i)
    text += fmt::format("{} {:.1f}", i == 0 ? ", changes after s:" : "",
                        static_cast<double>(seen.changed_ns[i]) / kS);
  return text;
}

int walk(const std::vector<TestedLink>& links) {
  int broken_links = 0;
  for (const bool has_steps : {false, true}) {
    const Seen costs = in_child({.has_steps = has_steps}, measure);
    fmt::print("{}, Mbit/s of each class:", has_steps ? "step" : "tangent");
    for (size_t i = 0; i < costs.class_count; ++i) fmt::print(" {:.2f}", costs.bytes_per_s[i] * kMbitPerByte);
    fmt::print(
        "\n  Mbit/s  ms  stalled  fitting  found  changes  first ms  first kB  exact ms  exact kB  oldest ms "
        " Hz\n");
    for (TestedLink link : links) {
      link.has_steps = has_steps;
      const Seen seen = in_child(link, watch);
      size_t fitting = 0;
      while (fitting + 1 < costs.class_count &&
             costs.bytes_per_s[fitting] > kFittingShare * link.mbit_per_s / kMbitPerByte)
        ++fitting;
      const std::string broken = broken_rules(link, seen, fitting);
      broken_links += broken.empty() ? 0 : 1;
      fmt::print("  {:6} {:3} {:6.0f} %  {:7}  {:5}  {:7}  {:8}  {:8}  {:8}  {:8}  {:9}  {:.1f}{}\n",
                 link.mbit_per_s, link.round_trip_ns / kMs, link.stalled_share * 100.0, fitting,
                 seen.found_class, seen.changes, seen.first_picture_ns / kMs, seen.first_bytes / 1000,
                 seen.exact_ns / kMs, seen.exact_bytes / 1000, seen.oldest_ns / kMs,
                 static_cast<double>(seen.states) * kNsPerS / kSteadyNs,
                 broken.empty() ? "" : "  BROKEN:" + broken + change_times(seen));
      std::fflush(stdout);
    }
  }
  fmt::print("{} links break a rule\n", broken_links);
  return broken_links;
}

}  // namespace
}  // namespace links

int walk_links(LinkGrid grid) {
  std::vector<links::TestedLink> all;
  const bool is_whole = grid == LinkGrid::Whole;
  for (const double mbit_per_s : is_whole ? std::vector{1.0, 2.0, 5.0, 20.0} : std::vector{1.0})
    for (const int64_t round_trip_ms :
         is_whole ? std::vector<int64_t>{20, 80, 200} : std::vector<int64_t>{80})
      for (const double stalled_share : is_whole ? std::vector{0.0, 0.01, 0.03} : std::vector{0.03})
        all.push_back(
            {.mbit_per_s = mbit_per_s, .round_trip_ns = round_trip_ms * kMs, .stalled_share = stalled_share});
  return links::walk(all);
}

}  // namespace strandcast::vopr
