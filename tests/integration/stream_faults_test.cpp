// A whole server behind bad links and beside viewers that stall, vanish and come back: what must hold is that
// it lets go of them, that the others get every frame they can decode, and that nothing grows. Counts decide,
// never times.
#include <dirent.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "client/app/live_connection.h"
#include "common/chaos/chaos_relay.h"
#include "common/strands/strand_prefix.h"
#include "server/net/strand_class.h"
#include "tests/support/server_fixture.h"
#include "tests/tools/load/load_viewers.h"

namespace strandcast::stream_faults_test {
namespace {

using chaos::ChaosRelay;
using chaos::Direction;
using chaos::LinkPlan;
using chaos::RelayConfig;
using load::LoadViewers;

/// Simulation statistics are as old as this many steps.
constexpr uint64_t kStatsSteps = 8;

size_t open_descriptors() {
  size_t count = 0;
  DIR* folder = opendir("/proc/self/fd");
  while (folder != nullptr && readdir(folder) != nullptr) ++count;
  if (folder != nullptr) closedir(folder);
  return count;
}

class StreamFaults : public test::ServerFixture {
 protected:
  [[nodiscard]] bool start(NetLimits limits = {}, SceneDesc scene = test::bald_scene()) {
    ServerConfig config;
    config.scene = std::move(scene);
    config.net.limits = limits;
    if (!ServerFixture::start(std::move(config))) return false;
    viewers_ = std::make_unique<LoadViewers>(load::LoadConfig{"127.0.0.1", server_->port(), {}});
    return true;
  }
  std::unique_ptr<ChaosRelay> relay(const LinkPlan& up, const LinkPlan& down) {
    RelayConfig config;
    config.to_port = server_->port();
    config.up = up;
    config.down = down;
    auto started = ChaosRelay::start(config);
    EXPECT_TRUE(started.ok());
    return std::move(*started);
  }
  /// Runs the viewers until the condition holds; false after a generous time.
  template <class Condition>
  static bool run_until(LoadViewers& viewers, Condition condition) {
    return eventually([&] {
      viewers.run_for(10);
      return condition();
    });
  }
  /// A viewer that watches from now on, on a good link.
  void watch() {
    ASSERT_TRUE(viewers_->join({}).ok());
    ASSERT_TRUE(run_until(*viewers_, [&] { return viewers_->watching_count() == viewers_->open_count(); }));
  }
  /// The good viewer has received every frame since it joined and gets more.
  void expect_undisturbed() {
    const uint64_t frames = viewers_->measures().frames;
    EXPECT_TRUE(run_until(*viewers_, [&] { return viewers_->measures().frames > frames + 10; }));
    EXPECT_EQ(viewers_->measures().chain_errors, 0u);
    EXPECT_EQ(viewers_->measures().ended, 0u);
  }
  uint64_t sessions() const { return server_->counters().net.open_sessions; }
  /// Bytes per second of strands at full quality.
  double full_bytes_per_s() {
    EXPECT_TRUE(run_until(*viewers_, [&] { return server_->counters().encode.encodes >= 60; }));
    const StrandEncodeCounters encode = server_->counters().encode;
    return static_cast<double>(encode.delta_bytes) / static_cast<double>(encode.encodes) * 60.0;
  }

  std::unique_ptr<LoadViewers> viewers_;
};

TEST_F(StreamFaults, ResetsAtEveryPlaceLeaveNothingBehind) {
  if (!start()) return;
  watch();
  const size_t descriptors = open_descriptors();
  // In bytes: the HTTP answer, the Welcome, the asset, the first keyframe, the stream; and upwards request,
  // Hello, acks.
  for (const uint64_t down : {1, 150, 400, 3'000, 12'000, 30'000, 0})
    for (const uint64_t up : {uint64_t{1}, uint64_t{100}, uint64_t{240}, uint64_t{300}, uint64_t{0}}) {
      if (down == 0 && up == 0) continue;
      LinkPlan up_plan, down_plan;
      up_plan.reset_after_bytes = up;
      down_plan.reset_after_bytes = down;
      const auto link = relay(up_plan, down_plan);
      LoadViewers victim({"127.0.0.1", link->port(), {}});
      ASSERT_TRUE(victim.join({}).ok());
      EXPECT_TRUE(run_until(victim, [&] { return victim.open_count() == 0; }))
          << up << " up, " << down << " down";
      EXPECT_EQ(victim.measures().chain_errors, 0u);
    }
  EXPECT_TRUE(run_until(*viewers_, [&] { return sessions() == 1; }));
  EXPECT_LE(open_descriptors(), descriptors + 1) << "readdir itself has one";
  expect_undisturbed();
}

TEST_F(StreamFaults, StalledViewersAreDroppedAndCounted) {
  NetLimits limits;
  limits.stalled_ms = 1'500;
  if (!start(limits)) return;
  watch();
  LoadViewers stalled({"127.0.0.1", server_->port(), {}});
  ASSERT_TRUE(stalled.join({StreamMode::Strands, true, false}).ok());
  ASSERT_TRUE(
      stalled.join({StreamMode::Strands, false, false}).ok());  // and one that promised no acknowledgements
  ASSERT_TRUE(run_until(stalled, [&] { return stalled.measures().joined == 2; }));
  // A session leaves after it was counted.
  EXPECT_TRUE(run_until(*viewers_, [&] { return server_->counters().net.stalled == 2 && sessions() == 1; }));
  expect_undisturbed();
}

TEST_F(StreamFaults, SlowLinkGetsACheaperClassThatOthersDoNotNotice) {
  // Large enough that the stream, not the asset, is what the link has to carry.
  if (!start({}, test::bald_scene(600, 16))) return;
  watch();
  const double full = full_bytes_per_s();
  for (const double share : {0.25}) {
    LinkPlan slow;
    slow.bytes_per_s = static_cast<uint64_t>(share * full);
    slow.queue_bytes = 1u << 20;  // the link itself would let the queue grow without end
    const auto link = relay({}, slow);
    LoadViewers victim({"127.0.0.1", link->port(), {}});
    ASSERT_TRUE(victim.join({}).ok());
    const auto run_both = [&](int64_t duration_ms) {
      for (int64_t ms = 0; ms < duration_ms; ms += 10) {
        victim.run_for(5);
        viewers_->run_for(5);
      }
    };
    ASSERT_TRUE(eventually([&] {
      run_both(10);
      return victim.measures().quality_changes > 0 && victim.watching_count() > 0;
    })) << share;
    run_both(1'500);
    const uint64_t before = victim.measures().frames;
    run_both(2'000);
    EXPECT_EQ(victim.measures().chain_errors, 0u);
    EXPECT_EQ(victim.measures().ended, 0u);
    EXPECT_GE(victim.measures().frames - before, 15u)
        << "10 Hz for two seconds, less what a busy machine loses";
    // Two seconds of the link's rate, and the asset, is far beyond what flow control lets wait.
    EXPECT_LE(link->counters().most_queued_bytes, static_cast<uint64_t>(2.0 * share * full) + 500'000)
        << share;
    const ServerCounters counters = server_->counters();
    EXPECT_GT(counters.net.class_changes, 0u);
    // Whatever the class, one encode serves all in it, and the first class is encoded as before.
    EXPECT_LE(counters.encode.encodes, counters.sim.published + kStatsSteps);
    for (const auto& [stream_id, of_stream] : counters.strand_streams)
      EXPECT_LE(of_stream.encodes, counters.sim.published + kStatsSteps) << stream_id;
  }
  expect_undisturbed();
}

// The first thing that a slow link costs is strands: announced, and completed in the picture.
TEST_F(StreamFaults, SlowLinkGetsFewerStrandsFirst) {
  constexpr uint32_t kStrands = 1'000;
  if (!start({}, test::bald_scene(kStrands, 12))) return;
  watch();
  LinkPlan slow;
  slow.bytes_per_s = static_cast<uint64_t>(0.45 * full_bytes_per_s());
  slow.queue_bytes = 1u << 20;
  const auto link = relay({}, slow);
  ClientConfig config;
  config.address.port = link->port();
  auto opened = ViewerSession::open(config);
  ASSERT_TRUE(opened) << opened.error().to_string();
  ViewerSession& viewer = **opened;
  uint64_t thinned = 0, wrong = 0;
  uint32_t strand_count = 0;
  viewer.set_snapshot_listener([&](const auto& snapshot) {
    // Every state has passed its hash. Whatever was sent, what is drawn has all strands.
    strand_count = snapshot->strand_count;
    thinned += strand_count < kStrands ? 1 : 0;
    const auto strands = viewer.replay().strands_at(now_ns());
    wrong += !strands || strands->position_m.size() != viewer.asset()->rest_position_m.size() ? 1 : 0;
  });
  const auto pump = [&] {
    EXPECT_TRUE(viewer.pump(std::chrono::milliseconds(5)));
    viewers_->run_for(5);
  };
  const auto sees = [&](auto condition) {
    return eventually([&] {
      pump();
      return condition();
    });
  };
  ASSERT_TRUE(sees([&] { return thinned >= 20; }));
  EXPECT_LT(viewer.quality().strand_share, 1.0f) << "announced";
  EXPECT_EQ(strand_count, prefix_count(kStrands, viewer.quality().strand_share));
  EXPECT_THAT(viewer.quality().reason, testing::HasSubstr("of the strands"));
  EXPECT_TRUE(viewer.quality().rate_divisor == 1 || viewer.quality().strand_share == 0.125f)
      << "the rate falls only when there are as few strands as can be";
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(viewer.replay().stats().rejected_frames, 0u) << viewer.replay().stats().last_error;
  expect_undisturbed();

  // Who insists on all of them gets fewer states instead.
  config.keeps_all_strands = true;
  auto insisting = ViewerSession::open(config);
  ASSERT_TRUE(insisting) << insisting.error().to_string();
  uint64_t whole = 0, thin = 0;
  (*insisting)->set_snapshot_listener([&](const auto& snapshot) {
    ++(snapshot->strand_count < kStrands ? thin : whole);
  });
  EXPECT_TRUE(sees([&] {
    EXPECT_TRUE((*insisting)->pump(std::chrono::milliseconds(5)));
    return whole >= 60;
  }));
  EXPECT_EQ(thin, 0u);
}

// The keyframe of all strands would keep whoever joins over a thin link waiting.
TEST_F(StreamFaults, AThinLinkShowsAFewStrandsFirst) {
  constexpr uint32_t kStrands = 1'000;
  if (!start({}, test::bald_scene(kStrands, 12))) return;
  for (const uint64_t bytes_per_s : {uint64_t{50'000}, uint64_t{0}}) {
    LinkPlan plan;
    plan.bytes_per_s = bytes_per_s;
    const auto link = relay({}, plan);
    ClientConfig config;
    config.address.port = link->port();
    config.hello.step_ns = 1.0;
    auto viewer = ViewerSession::open(config);
    ASSERT_TRUE(viewer) << viewer.error().to_string();
    std::vector<std::pair<size_t, bool>> seen;  // codec, and whether all strands came
    (*viewer)->set_snapshot_listener([&](const auto& snapshot) {
      seen.emplace_back(strand_stream_of((*viewer)->replay().stream_id()).codec,
                        snapshot->strand_count == kStrands);
    });
    const std::pair<size_t, bool> whole{0, true}, few{1, false};
    EXPECT_TRUE(eventually([&] {
      EXPECT_TRUE((*viewer)->pump(std::chrono::milliseconds(5)));
      return std::count(seen.begin(), seen.end(), whole) >= 10 &&
             (*viewer)->replay().stats().exact_frames >= 5;
    })) << bytes_per_s;
    EXPECT_GE(server_->counters().encode.exact, 5u) << "as the server counts them";
    EXPECT_EQ(seen.front(), bytes_per_s > 0 ? few : whole);
    EXPECT_EQ(seen.back(), whole) << "and then it stays";
    EXPECT_EQ((*viewer)->replay().stats().rejected_frames, 0u) << (*viewer)->replay().stats().last_error;
  }
}

TEST_F(StreamFaults, OneEncodeServesEveryViewer) {
  if (!start()) return;
  for (int i = 0; i < 24; ++i) ASSERT_TRUE(viewers_->join({}).ok());
  ASSERT_TRUE(run_until(*viewers_, [&] { return viewers_->watching_count() == 24; }));
  const ServerCounters before = server_->counters();
  viewers_->run_for(1'000);
  const ServerCounters after = server_->counters();
  EXPECT_LE(after.encode.encodes - before.encode.encodes,
            after.sim.published - before.sim.published + kStatsSteps);
  EXPECT_GE(after.net.frames_sent - before.net.frames_sent,
            24 * (after.encode.encodes - before.encode.encodes) / 2)
      << "each encode reached the viewers";
  EXPECT_EQ(viewers_->measures().chain_errors, 0u);
}

TEST_F(StreamFaults, DelayAloneCostsNoFrames) {
  if (!start()) return;
  for (const int64_t round_trip_ms : {20, 300}) {
    LinkPlan plan;
    plan.delay_us = round_trip_ms * 500;
    plan.jitter_us = 10'000;
    const auto link = relay(plan, plan);
    LoadViewers far({"127.0.0.1", link->port(), {}});
    ASSERT_TRUE(far.join({}).ok());
    ASSERT_TRUE(run_until(far, [&] { return far.measures().frames > 30; }));
    const uint64_t encodes = server_->counters().encode.encodes;
    const uint64_t frames = far.measures().frames;
    far.run_for(1'500);
    const auto made = static_cast<double>(server_->counters().encode.encodes - encodes);
    EXPECT_GE(static_cast<double>(far.measures().frames - frames), 0.9 * made - 2.0) << round_trip_ms;
    EXPECT_EQ(far.measures().chain_errors, 0u);
  }
}

TEST_F(StreamFaults, FreezesAreCaughtUpFromTheNewestState) {
  if (!start()) return;
  watch();
  LinkPlan freezing;
  freezing.freeze_every_us = 1'000'000;
  freezing.freeze_us = 200'000;
  const auto link = relay(freezing, freezing);
  LoadViewers victim({"127.0.0.1", link->port(), {}});
  ASSERT_TRUE(victim.join({}).ok());
  ASSERT_TRUE(run_until(victim, [&] { return victim.measures().frames > 10; }));
  const uint64_t encodes = server_->counters().encode.encodes;
  const uint64_t frames = victim.measures().frames;
  victim.run_for(3'000);
  const uint64_t made = server_->counters().encode.encodes - encodes;
  EXPECT_GT(made, 0u);
  EXPECT_GE(3 * (victim.measures().frames - frames), made) << "a fifth of the time lay in freezes";
  EXPECT_EQ(victim.measures().chain_errors, 0u);
  EXPECT_EQ(victim.measures().ended, 0u);
  expect_undisturbed();
}

TEST_F(StreamFaults, HalfOpenPeersAreNoticedOnBothSides) {
  NetLimits limits;
  limits.idle_ms = 1'500;
  limits.stalled_ms = 1'500;
  if (!start(limits)) return;
  const auto link = relay({}, {});
  ClientConfig config;
  config.address.port = link->port();
  config.idle_timeout = std::chrono::milliseconds(1'000);
  auto session = ViewerSession::open(config);
  ASSERT_TRUE(session.ok()) << session.error().to_string();
  ASSERT_TRUE(eventually(
      [&] { return (*session)->pump(std::chrono::milliseconds(10)) && (*session)->has_picture(); }));
  link->set_silent(true);
  Status end;
  EXPECT_TRUE(eventually([&] { return !(end = (*session)->pump(std::chrono::milliseconds(10))); }));
  EXPECT_EQ(end.error().code, ErrorCode::Timeout) << end.error().to_string();
  EXPECT_TRUE(eventually([&] { return sessions() == 0; }));
}

TEST_F(StreamFaults, CorruptedBytesEndConnectionsAndNothingElse) {
  if (!start()) return;
  watch();
  LinkPlan wrong;
  wrong.corrupt_per_byte = 1e-4;
  wrong.writes = chaos::Writes::Split;
  const auto link = relay(wrong, wrong);
  ClientConfig config;
  config.address.port = link->port();
  config.connect_timeout = config.welcome_timeout = std::chrono::milliseconds(1'000);
  uint64_t decoded = 0;
  int ends = 0;
  for (int attempt = 0; attempt < 12; ++attempt) {
    auto session = ViewerSession::open(config);
    if (!session) {
      ++ends;
      continue;
    }
    // Every state that is taken has passed its hash.
    for (int i = 0; i < 40; ++i) {
      viewers_->run_for(1);  // who watches says so meanwhile
      if (!(*session)->pump(std::chrono::milliseconds(10))) {
        ++ends;
        break;
      }
    }
    decoded += (*session)->decoded_frames();
  }
  EXPECT_GT(link->counters().corrupted_bytes[1], 0u);
  EXPECT_GT(ends + static_cast<int>(decoded), 0);
  EXPECT_TRUE(run_until(*viewers_, [&] { return sessions() == 1; }));
  expect_undisturbed();
}

TEST_F(StreamFaults, ViewersThatComeAndGoLeaveNoDescriptors) {
  if (!start()) return;
  watch();
  const size_t descriptors = open_descriptors();
  LoadViewers crowd({"127.0.0.1", server_->port(), {}});
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(crowd.join({}).ok());
    crowd.run_for(10);
    if (crowd.open_count() > 8) crowd.leave(crowd.oldest(), i % 2 == 0);
  }
  while (crowd.open_count() > 0) crowd.leave(crowd.oldest(), false);
  EXPECT_EQ(crowd.measures().chain_errors, 0u);
  EXPECT_TRUE(run_until(*viewers_, [&] { return sessions() == 1 && open_descriptors() <= descriptors; }));
  expect_undisturbed();
}

TEST_F(StreamFaults, AViewerComesBackAfterResetsAndStopsWhenItMust) {
  if (!start()) return;
  const auto link = relay({}, {});
  ClientConfig config;
  config.address.port = link->port();
  auto live = LiveConnection::open(config);
  ASSERT_TRUE(live.ok()) << live.error().to_string();
  link->reset_all();
  ASSERT_TRUE(eventually([&] { return (*live)->pump(std::chrono::milliseconds(5)); })) << "a new session";
  EXPECT_FALSE((*live)->final_error());
  // Another server stands there now, and it wants a token: no loop, the reason stays.
  ServerConfig strict;
  strict.scene = test::bald_scene();
  strict.net.port = 0;
  strict.net.tokens = {{"0123456789abcdef", Grant::AllButAdmin}};
  auto other = Server::start(strict);
  ASSERT_TRUE(other.ok());
  link->set_to_port((*other)->port());
  link->reset_all();
  ASSERT_TRUE(eventually([&] {
    (*live)->pump(std::chrono::milliseconds(5));
    return (*live)->final_error().has_value();
  }));
  EXPECT_EQ((*live)->final_error()->code, ErrorCode::Unauthorized);
  EXPECT_THAT((*live)->trouble(), testing::HasSubstr("token"));
  const uint64_t connections = link->counters().connections;
  for (int i = 0; i < 100; ++i) (*live)->pump(std::chrono::milliseconds(5));
  EXPECT_EQ(link->counters().connections, connections) << "it must not try again";
}

}  // namespace
}  // namespace strandcast::stream_faults_test
