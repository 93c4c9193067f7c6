// Senders as they are: clocks that stand still, bytes in the other order, heads that are lost and come back,
// packets that are damaged. What they send goes through source and hub, and is sampled at 60 Hz as steps of
// the simulation do. Time is virtual; packets are those of real protocols.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "common/base/units.h"
#include "server/input/input_hub.h"
#include "server/input/live/live_source.h"
#include "tests/support/live_packets.h"

namespace strandcast::live_senders_test {
namespace {

using test::PacketBytes;
using testing::HasSubstr;
constexpr int64_t kStart = 1'000 * kMsInNs;
constexpr int64_t kStepNs = 16'666'667;
constexpr double kStepS = static_cast<double>(kStepNs) * kSPerNs;
/// A step in which a head goes at its speed, and has the burst that it is allowed.
constexpr double kMostStepMps =
    kMaxLiveSpeedMps * (1.0 + static_cast<double>(kClampWindowNs) * kSPerNs / kStepS);
const std::string kSender = "127.0.0.1:50001";

/// A source, the hub that it moves, and the steps that are made of it.
class Stage {
 public:
  explicit Stage(const LiveDesc& live) : source(std::move(LiveSource::make(live, 0).value())) {}

  void send(const PacketBytes& bytes, int64_t time_ns) {
    run_until(time_ns);
    // A connection that said something wrong begins anew.
    if (!source->take(kSender, bytes, time_ns) && source->protocol().transport == LiveTransport::Tcp)
      source->begin_connection();
    pass_on(time_ns);
  }
  /// Makes the steps up to a time, and looks every 5 ms at what is due, as a receiver does.
  void run_until(int64_t time_ns) {
    for (; now_ns_ <= time_ns; now_ns_ += 5 * kMsInNs) {
      pass_on(now_ns_);
      for (; next_step_ns_ <= now_ns_; next_step_ns_ += kStepNs) steps.push_back(hub_->sample(next_step_ns_));
    }
  }
  uint64_t count(const std::string& text) const {
    return static_cast<uint64_t>(std::count_if(notes.begin(), notes.end(), [&](const std::string& note) {
      return note.find(text) != std::string::npos;
    }));
  }
  /// Of the head between steps, but for those through which hair is carried.
  double fastest_mps() const {
    return fastest([](const Pose& a, const Pose& b) { return glm::distance(a.position_m, b.position_m); });
  }
  double fastest_turn_rad_per_s() const {
    return fastest([](const Pose& a, const Pose& b) { return angle_between_rad(a.rotation, b.rotation); });
  }
  size_t unchanged() const {
    size_t count = 0;
    for (size_t i = 1; i < steps.size(); ++i)
      count += steps[i].world_from_head == steps[i - 1].world_from_head ? 1 : 0;
    return count;
  }
  const Pose& head() const { return steps.back().world_from_head; }

  std::unique_ptr<LiveSource> source;
  std::vector<InputFrame> steps;
  std::vector<std::string> notes;

 private:
  void pass_on(int64_t time_ns) {
    const LiveSource::Due due = source->advance(time_ns);
    for (const MotionSamples& samples : due.motion) hub_->push(1, samples, time_ns);
    if (due.has_ended) hub_->remove_source(1);
    for (LiveNote& note : source->take_notes()) notes.push_back(std::move(note.text));
  }
  template <class Distance>
  double fastest(Distance distance) const {
    double most = 0.0;
    for (size_t i = 1; i < steps.size(); ++i)
      if (!steps[i].has_teleported)
        most = std::max(most, distance(steps[i - 1].world_from_head, steps[i].world_from_head) / kStepS);
    return most;
  }

  std::unique_ptr<InputHub> hub_ = std::make_unique<InputHub>();
  int64_t now_ns_ = kStart;
  int64_t next_step_ns_ = kStart;
};

// ---- clocks

/// Five seconds of a performer at 90 Hz who sways by 0.3 m every two seconds, at most 0.94 m/s. The sender
/// tells the time that `told_s` makes of the seconds since it began.
template <class Told>
Stage swaying(Told told_s) {
  constexpr double kRateHz = 90.0;
  Stage stage({.protocol = "vmc"});
  for (int i = 0; i < 450; ++i) {
    const double t_s = i / kRateHz;
    const auto x_m = static_cast<float>(0.3 * std::sin(std::numbers::pi * t_s));
    stage.send(test::vmc_head({x_m, 1.6f, 0}, {0, 0, 0, 1}, static_cast<float>(told_s(t_s))),
               kStart + static_cast<int64_t>(t_s * kNsPerS));
  }
  return stage;
}

/// A step shows one packet or two more, of which each is 1/90 s of the way.
constexpr double kMostSwayMps = 0.94 * 2.0 * 60.0 / 90.0;

TEST(LiveSenders, TimesOfAVmcSenderThatAreTooCoarseAreLeftOut) {
  constexpr double kHourS = 3'600.0;
  struct Case {
    double begin_s;
    uint64_t notes;
  };
  // Steps of a float: 61 us after 15 min, 2 ms up to 9 hours, then 4 ms, 31 ms after 3.5 days, 128 s of the
  // time of day.
  for (const Case& one :
       {Case{900.0, 0}, {8.9 * kHourS, 0}, {9.2 * kHourS, 1}, {84.0 * kHourS, 1}, {1.7e9, 1}}) {
    const Stage stage = swaying([&](double t_s) { return one.begin_s + t_s; });
    EXPECT_EQ(stage.count("the sender's time is"), one.notes) << one.begin_s;
    EXPECT_EQ(stage.source->status(kStart).late, 0u) << one.begin_s;
    EXPECT_EQ(stage.unchanged(), 0u) << one.begin_s << ": of " << stage.steps.size();
    EXPECT_LE(stage.fastest_mps(), kMostSwayMps) << one.begin_s;
  }
}

TEST(LiveSenders, TimesThatStandStillWhileTheHeadMovesAreLeftOut) {
  const auto never = [](double) { return 0.0; };
  const auto whole_seconds = [](double t_s) { return std::floor(t_s); };
  const auto every_third = [](double t_s) { return std::floor(t_s * 30.0) / 30.0; };
  for (const std::function<double(double)>& told :
       {std::function<double(double)>(never), {whole_seconds}, {every_third}}) {
    const Stage stage = swaying(told);
    EXPECT_EQ(stage.count("stand still"), 1u);
    EXPECT_LE(stage.unchanged(), 10u) << "of " << stage.steps.size();
    EXPECT_LE(stage.fastest_mps(), kMostSwayMps);
  }
  // A head that stands still sends the same again, and its times are right.
  Stage still({.protocol = "vmc"});
  for (int i = 0; i < 200; ++i)
    for (int twice = 0; twice < 2; ++twice)
      still.send(test::vmc_head({0, 1.6f, 0}, {0, 0, 0, 1}, 0.01f * static_cast<float>(i)),
                 kStart + i * 10 * kMsInNs + twice * kMsInNs);
  EXPECT_EQ(still.count("stand still"), 0u);
}

TEST(LiveSenders, AClockThatIsSetIsFollowed) {
  for (const double by_s : {-3'600.0, -0.4, 0.4, 3'600.0}) {
    const Stage stage = swaying([&](double t_s) { return 5'000.0 + t_s + (t_s >= 2.5 ? by_s : 0.0); });
    EXPECT_LE(stage.fastest_mps(), kMaxLiveSpeedMps) << by_s;
    // 0.4 s back are a few late poses, until it is clear that they are not.
    EXPECT_LE(stage.source->status(kStart).late, by_s == -0.4 ? kRestartPoses - 1 : 0) << by_s;
    EXPECT_LE(stage.unchanged(), 15u) << by_s;
    EXPECT_NEAR(stage.head().position_m.x, 0.0, 0.05) << by_s;
  }
}

/// Poses of NatNet (numbered) and of VMC (times alone) at one rate, then at another.
template <class Packet>
Stage at_two_rates(const std::string& protocol, double first_hz, double second_hz, Packet packet) {
  Stage stage({.protocol = protocol});
  double t_s = 0.0;
  uint32_t number = 0;
  for (; t_s < 20.0; t_s += 1.0 / first_hz)
    stage.send(packet(t_s, ++number), kStart + static_cast<int64_t>(t_s * kNsPerS));
  for (; t_s < 25.0; t_s += 1.0 / second_hz)
    stage.send(packet(t_s, ++number), kStart + static_cast<int64_t>(t_s * kNsPerS));
  return stage;
}

TEST(LiveSenders, ARateThatChangesBecomesTheHabit) {
  const auto vmc = [](double t_s, uint32_t) {
    return test::vmc_head({static_cast<float>(0.02 * t_s), 1.6f, 0}, {0, 0, 0, 1}, static_cast<float>(t_s));
  };
  const auto natnet = [](double t_s, uint32_t number) {
    test::NatnetPacket packet;
    packet.frame = number;
    packet.time_s = t_s;
    packet.bodies = {{1, {static_cast<float>(0.02 * t_s), 1.6f, 0}, {0, 0, 0, 1}, true}};
    return test::natnet(packet);
  };
  for (const auto& [first_hz, second_hz] : {std::pair{60.0, 30.0}, {30.0, 120.0}, {120.0, 24.0}}) {
    for (const bool is_vmc : {true, false}) {
      const Stage stage = is_vmc ? at_two_rates("vmc", first_hz, second_hz, vmc)
                                 : at_two_rates("natnet", first_hz, second_hz, natnet);
      const LiveInputStatus status = stage.source->status(kStart);
      EXPECT_EQ(status.late, 0u) << first_hz;
      // Until the new rate is the habit, each of its poses looks as if some before it were missing.
      EXPECT_LE(status.lost, 16u * 4u) << first_hz << " to " << second_hz << (is_vmc ? " vmc" : " natnet");
      EXPECT_LE(stage.fastest_mps(), 0.2) << first_hz << " to " << second_hz;
    }
  }
}

// ---- numbers

/// A head that shakes by 60 degrees, as opentrack tells it.
std::array<double, 6> shaking(int i) {
  const double t_s = i / 100.0;
  return {3.0 * std::sin(2.0 * t_s),
          1.3,
          -7.0 + std::cos(t_s),
          60.0 * std::sin(5.0 * t_s),
          10.0 * std::sin(3.0 * t_s + 0.3),
          4.0 * std::cos(1.7 * t_s)};
}
PacketBytes opentrack_in(std::endian order, const std::array<double, 6>& values) {
  return test::PacketWriter(order).put(values).bytes();
}

TEST(LiveSenders, TheOrderOfBytesOfOpentrackIsFound) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    Stage stage({.protocol = "opentrack"}), right({.protocol = "opentrack"});
    for (int i = 0; i < 1'000; ++i) {
      stage.send(opentrack_in(order, shaking(i)), kStart + i * 10 * kMsInNs);
      right.send(test::opentrack(shaking(i)), kStart + i * 10 * kMsInNs);
    }
    EXPECT_EQ(stage.count("big-endian"), order == std::endian::big ? 1u : 0u);
    EXPECT_EQ(stage.source->status(kStart).impossible, 0u);
    ASSERT_EQ(stage.steps.size(), right.steps.size());
    for (size_t i = 6; i < stage.steps.size(); ++i)
      EXPECT_EQ(stage.steps[i].world_from_head, right.steps[i].world_from_head) << i;
    EXPECT_LE(stage.fastest_turn_rad_per_s(), kMaxLiveTurnRadPerS);
  }
}

// A filter that comes to rest has numbers of any exponent, down to those that have none.
TEST(LiveSenders, NumbersThatFadeAreNoOtherOrderOfBytes) {
  Stage stage({.protocol = "opentrack"});
  double yaw_deg = 40.0;
  for (int i = 0; i < 20'000; ++i, yaw_deg *= 0.96)
    stage.send(test::opentrack({0, 0, 0, yaw_deg, 0, 0}), kStart + i * 4 * kMsInNs);
  EXPECT_EQ(stage.count("endian"), 0u);
  EXPECT_NEAR(angle_between_rad(stage.head().rotation, {1, 0, 0, 0}), 0.0, 1e-9);
}

TEST(LiveSenders, AnglesThatNoHeadHasAreImpossibleAndSaid) {
  Stage stage({.protocol = "opentrack"});
  uint64_t impossible = 0;
  for (int i = 0; i < 300; ++i) {
    const bool is_wrong = i / 60 % 2 == 1;
    impossible += is_wrong ? 1 : 0;
    stage.send(test::opentrack({0, 0, 0, is_wrong ? 1e30 : 0.0, 0, 0}), kStart + i * kStepNs);
  }
  EXPECT_EQ(stage.source->status(kStart).impossible, impossible);
  EXPECT_EQ(stage.fastest_turn_rad_per_s(), 0.0);
  EXPECT_EQ(stage.count("no head's pose"), 1u);
  EXPECT_GE(stage.count("yaw 1000000000000000"), 1u) << "as it was sent";
  // Two turns are a head that was turned twice; more are none, of any angle.
  for (size_t at = 3; at < 6; ++at)
    for (const double angle_deg : {720.0, -720.0, 721.0, -721.0, 1e9}) {
      Stage one({.protocol = "opentrack"});
      std::array<double, 6> values{};
      values[at] = angle_deg;
      one.send(test::opentrack(values), kStart);
      EXPECT_EQ(one.source->status(kStart).impossible, std::abs(angle_deg) > 720.0 ? 1u : 0u) << angle_deg;
    }
}

// ---- heads that are lost

constexpr double kAwayDeg = 40.0;
constexpr double kAwayRad = kAwayDeg * std::numbers::pi / 180.0;

/// A head that looks so far aside, zeros for so long, and the head again.
Stage with_zeros(double rate_hz, double lost_s, double away_deg = kAwayDeg) {
  Stage stage({.protocol = "opentrack"});
  for (double t_s = 0.0; t_s < 3.0 + lost_s; t_s += 1.0 / rate_hz) {
    const bool is_lost = t_s >= 1.0 && t_s < 1.0 + lost_s;
    stage.send(is_lost ? test::opentrack({}) : test::opentrack({5, 2, 30, away_deg, 0, 0}),
               kStart + static_cast<int64_t>(t_s * kNsPerS));
  }
  return stage;
}

TEST(LiveSenders, ZerosOfATrackerThatHasLostTheHeadDoNotThrowIt) {
  for (const double rate_hz : {30.0, 60.0, 250.0}) {
    // A moment of zeros is not believed.
    const Stage moment = with_zeros(rate_hz, 0.09);
    for (size_t i = 10; i < moment.steps.size(); ++i)
      EXPECT_LT(angle_between_rad(moment.steps[i].world_from_head.rotation,
                                  moment.steps[10].world_from_head.rotation),
                1e-9)
          << rate_hz << " Hz, step " << i;
    // What stays is eased to, and from.
    const Stage longer = with_zeros(rate_hz, 2.0);
    double nearest_rad = kAwayRad;
    for (const InputFrame& step : longer.steps)
      nearest_rad = std::min(nearest_rad, angle_between_rad(step.world_from_head.rotation, {1, 0, 0, 0}));
    EXPECT_LT(nearest_rad, 1e-6) << "it was believed in the end";
    EXPECT_NEAR(angle_between_rad(longer.head().rotation, {1, 0, 0, 0}), kAwayRad, 1e-6);
    // The steepest of an ease is 1.5 of its mean. What comes more rarely than steps is held between them.
    const double ease_s = static_cast<double>(kEaseNs) * kSPerNs;
    const double steepest = 1.001 * 1.5 * (rate_hz < 60.0 ? 2.0 : 1.0) / ease_s;
    EXPECT_LE(longer.fastest_turn_rad_per_s(), steepest * kAwayRad) << rate_hz;
    EXPECT_LE(longer.fastest_mps(), steepest * glm::length(glm::dvec3(0.05, 0.02, 0.30))) << rate_hz;
    EXPECT_EQ(longer.count("carried"), 0u);
  }
}

// A head that was turned by less than a wrong turn has is thrown no more by zeros.
TEST(LiveSenders, ZerosAreNotBelievedOfAHeadThatIsTurnedByLittle) {
  for (const double away_deg : {5.0, 25.0}) {
    const Stage stage = with_zeros(60.0, 2.0, away_deg);
    const double away_rad = away_deg * std::numbers::pi / 180.0;
    const double steepest = 1.001 * 1.5 / (static_cast<double>(kEaseNs) * kSPerNs);
    EXPECT_LE(stage.fastest_turn_rad_per_s(), steepest * away_rad) << away_deg;
    EXPECT_LE(stage.fastest_mps(), steepest * glm::length(glm::dvec3(0.05, 0.02, 0.30))) << away_deg;
  }
}

/// The yaw of each step, degrees.
std::vector<double> yaw_deg(const Stage& stage) {
  std::vector<double> found;
  for (const InputFrame& step : stage.steps) {
    const glm::dvec3 ahead = step.world_from_head.rotation * glm::dvec3(0, 0, 1);
    found.push_back(std::atan2(ahead.x, ahead.z) * 180.0 / std::numbers::pi);
  }
  return found;
}

// The head goes from one turn to the other, and nowhere else.
TEST(LiveSenders, ATurnInOnePacketIsNotOvershot) {
  for (const double rate_hz : {30.0, 50.0, 100.0})
    for (const double to_deg : {24.0, 10.0, -8.0, -15.0, -20.0, -60.0}) {
      SCOPED_TRACE(fmt::format("{} Hz, to {}", rate_hz, to_deg));
      Stage stage({.protocol = "opentrack"});
      for (double t_s = 0.0; t_s < 3.0; t_s += 1.0 / rate_hz)
        stage.send(test::opentrack({0, 0, 0, t_s < 1.0 ? 25.0 : to_deg, 0, 0}),
                   kStart + static_cast<int64_t>(t_s * kNsPerS));
      const std::vector<double> yaw = yaw_deg(stage);
      const double sign = yaw[20] < 0.0 ? -1.0 : 1.0;
      for (size_t i = 10; i < yaw.size(); ++i) {
        EXPECT_LT(sign * yaw[i], 25.5) << i;
        EXPECT_GT(sign * yaw[i], to_deg - 0.5) << i;
      }
      EXPECT_NEAR(sign * yaw.back(), to_deg, 0.1);
    }
}

// Time that counts poses stands still where they do, and a clock that is set back by little is late for good.
TEST(LiveSenders, AClockThatFallsBehindIsFollowed) {
  for (const double behind_s : {0.05, 0.3, 0.8}) {
    SCOPED_TRACE(behind_s);
    Stage stage({.protocol = "vmc"});
    const auto place = [](double t_s) { return static_cast<float>(0.3 * std::sin(std::numbers::pi * t_s)); };
    for (int i = 0; i < 360; ++i) {
      const double told_s = i / 90.0, t_s = told_s + (i < 180 ? 0.0 : behind_s);
      stage.send(test::vmc_head({place(t_s), 1.6f, 0}, {0, 0, 0, 1}, static_cast<float>(told_s)),
                 kStart + static_cast<int64_t>(t_s * kNsPerS));
    }
    // A second after it fell behind, the head is again where its sender is.
    const double end_s = 359.0 / 90.0 + behind_s;
    EXPECT_NEAR(stage.head().position_m.x, -place(end_s), 0.03);
  }
}

TEST(LiveSenders, AHeadThatWasLostComesBackGentlyWhateverItsTurn) {
  for (const double lost_s : {0.3, 3.0}) {
    SCOPED_TRACE(lost_s);
    Stage stage({.protocol = "opentrack"});
    for (double t_s = 0.0; t_s < 4.0; t_s += 1.0 / 60.0)
      stage.send(test::opentrack({0, 0, 0, t_s < 1.0 ? 0.0 : 55.0, 0, 0}),
                 kStart + static_cast<int64_t>((t_s + (t_s < 1.0 ? 0.0 : lost_s)) * kNsPerS));
    EXPECT_LT(stage.fastest_turn_rad_per_s(), 10.0);
    EXPECT_NEAR(std::abs(yaw_deg(stage).back()), 55.0, 0.5);
  }
}

// As people turn their heads when they are in a hurry: 600 degrees a second, at the rates of trackers.
TEST(LiveSenders, AHeadThatTurnsAsFastAsPeopleDoIsBelieved) {
  for (const double rate_hz : {10.0, 30.0, 60.0, 250.0}) {
    Stage stage({.protocol = "opentrack"});
    for (double t_s = 0.0; t_s < 4.0; t_s += 1.0 / rate_hz)
      stage.send(test::opentrack({0, 0, 0, 60.0 * std::sin(10.0 * t_s), 0, 0}),
                 kStart + static_cast<int64_t>(t_s * kNsPerS));
    EXPECT_EQ(stage.source->status(kStart).gated, 0u) << rate_hz;
    // What comes more rarely than the window of the clamp is long goes its way at the speed of a head.
    if (rate_hz >= 30.0) {
      EXPECT_EQ(stage.source->status(kStart).clamped, 0u) << rate_hz;
    }
  }
}

/// A performer at x = 0 m, nothing for so long, and then at another place.
Stage back_elsewhere(const std::string& protocol, double lost_s, float x_m) {
  Stage stage({.protocol = protocol});
  const auto packet = [&](double t_s, float at_m) {
    test::NatnetPacket natnet;
    natnet.frame = static_cast<uint32_t>(t_s * 100.0 + 0.5);
    natnet.time_s = t_s;
    natnet.bodies = {{1, {at_m, 1.6f, 0}, {0, 0, 0, 1}, true}};
    return protocol == "vmc" ? test::vmc_head({-at_m, 1.6f, 0}, {0, 0, 0, 1}, static_cast<float>(t_s))
                             : test::natnet(natnet);
  };
  for (double t_s = 0.0; t_s < 1.0; t_s += 0.01)
    stage.send(packet(t_s, 0.0f), kStart + static_cast<int64_t>(t_s * kNsPerS));
  for (double t_s = 1.0 + lost_s; t_s < 2.5 + lost_s; t_s += 0.01)
    stage.send(packet(t_s, x_m), kStart + static_cast<int64_t>(t_s * kNsPerS));
  return stage;
}

TEST(LiveSenders, HairIsCarriedAlongWithAPerformerWhoComesBackElsewhere) {
  for (const std::string protocol : {"vmc", "natnet"})
    for (const double lost_s : {0.0, 0.3, 0.8, 1.2, 5.0}) {
      const Stage stage = back_elsewhere(protocol, lost_s, 2.0f);
      EXPECT_NEAR(stage.head().position_m.x, 2.0, 1e-6) << protocol << " " << lost_s;
      // One step goes all the way and is flagged; no other is faster than a head.
      EXPECT_LE(stage.fastest_mps(), kMaxLiveSpeedMps) << protocol << " " << lost_s;
      size_t jumps = 0;
      for (size_t i = 10; i < stage.steps.size(); ++i)
        if (glm::distance(stage.steps[i].world_from_head.position_m,
                          stage.steps[i - 1].world_from_head.position_m) > 1.9) {
          EXPECT_TRUE(stage.steps[i].has_teleported) << protocol << " " << lost_s;
          ++jumps;
        }
      EXPECT_EQ(jumps, 1u) << protocol << " " << lost_s;
      EXPECT_EQ(stage.count("2.00 m from where it was: hair is carried along"), 1u)
          << protocol << " " << lost_s;
      // Near by, the head goes there by itself.
      const Stage near = back_elsewhere(protocol, lost_s, 0.3f);
      EXPECT_EQ(near.count("carried"), 0u);
      EXPECT_LE(near.fastest_mps(), kMostStepMps);
      EXPECT_NEAR(near.head().position_m.x, 0.3, 0.01) << "eased gently, and nearly there after 1.5 s";
    }
}

// ---- subjects

/// A frame of NatNet every 10 ms.
struct NatnetStage : Stage {
  explicit NatnetStage(const LiveDesc& live) : Stage(live) {}
  void name(const std::vector<std::pair<uint32_t, std::string>>& bodies) {
    send(test::natnet_names("3.1", bodies, {}), now());
  }
  void show(const std::vector<test::NatnetPacketBody>& bodies, int count) {
    for (int i = 0; i < count; ++i) {
      test::NatnetPacket packet;
      packet.frame = ++frame_;
      packet.time_s = 0.01 * frame_;
      packet.bodies = bodies;
      send(test::natnet(packet), now());
    }
  }
  int64_t now() const { return kStart + int64_t{frame_} * 10 * kMsInNs; }

 private:
  uint32_t frame_ = 0;
};

TEST(LiveSenders, WithoutItsHeadAStageFollowsWhoElseIsSeen) {
  NatnetStage stage({.protocol = "natnet"});
  const test::NatnetPacketBody head = {1, {0, 1.7f, 0}, {0, 0, 0, 1}, true};
  const test::NatnetPacketBody waist = {2, {0, 0.7f, 0}, {0, 0, 0, 1}, true};
  stage.name({{1, "HEAD"}, {2, "Waist"}});
  stage.show({head, waist}, 100);
  EXPECT_NEAR(stage.head().position_m.y, 1.7, 1e-6);
  // A lost one is held for a second, as none is a head meanwhile.
  stage.show({waist}, 95);
  EXPECT_NEAR(stage.head().position_m.y, 1.7, 1e-6);
  stage.show({waist}, 50);
  EXPECT_NEAR(stage.head().position_m.y, 0.7, 1e-6);
  EXPECT_EQ(stage.count("Waist drives the head"), 1u);
  // It comes back, and is at once who it was.
  stage.show({head, waist}, 10);
  EXPECT_NEAR(stage.head().position_m.y, 1.7, 1e-6);
  EXPECT_LE(stage.fastest_mps(), kMaxLiveSpeedMps) << "hair is carried along each time";
}

TEST(LiveSenders, ASubjectThatIsRenamedGoesOn) {
  NatnetStage stage({.protocol = "natnet"});
  const std::vector<test::NatnetPacketBody> bodies = {{1, {0, 1.7f, 0}, {0, 0, 0, 1}, true},
                                                      {2, {3, 1.2f, 0}, {0, 0, 0, 1}, true}};
  stage.show(bodies, 50);  // by their numbers, until names come
  stage.name({{1, "Anna"}, {2, "Sword"}});
  stage.show(bodies, 50);
  EXPECT_EQ(stage.source->status(stage.now()).subjects, "Anna, Sword");
  stage.name({{1, "Performer"}, {2, "Sword"}});
  stage.show(bodies, 50);
  EXPECT_EQ(stage.source->status(stage.now()).subject, "Performer");
  EXPECT_EQ(stage.source->status(stage.now()).subjects, "Performer, Sword");
  EXPECT_EQ(stage.count("Anna is called Performer now"), 1u);
  EXPECT_EQ(stage.count("drives the head"), 1u) << "it is the same one";
  for (size_t i = 1; i < stage.steps.size(); ++i) {
    EXPECT_FALSE(stage.steps[i].is_motion_stale) << i;
    EXPECT_NEAR(stage.steps[i].world_from_head.position_m.y, 1.7, 1e-6) << i;
  }
  // Names that change places change who a name is.
  stage.name({{1, "Sword"}, {2, "Performer"}});
  stage.show(bodies, 50);
  EXPECT_EQ(stage.source->status(stage.now()).subject, "Performer");
  EXPECT_NEAR(stage.head().position_m.x, 3.0, 1e-6);
  // Who was asked for by name is waited for.
  NatnetStage waits({.protocol = "natnet", .subject = "Anna"});
  waits.name({{1, "Anna"}, {2, "Sword"}});
  waits.show(bodies, 50);
  waits.name({{1, "Performer"}, {2, "Sword"}});
  waits.show(bodies, 150);
  EXPECT_TRUE(waits.steps.back().is_motion_stale);
  EXPECT_EQ(waits.source->status(waits.now()).subject, "Anna");
}

TEST(LiveSenders, OfTwoOfOneNameTheFirstIsUsed) {
  NatnetStage stage({.protocol = "natnet"});
  stage.name({{1, "Head"}, {2, "Head"}});
  stage.show({{1, {0, 1.7f, 0}, {0, 0, 0, 1}, true}, {2, {0.4f, 1.7f, 0}, {0, 1, 0, 0}, true}}, 200);
  EXPECT_LT(stage.fastest_mps(), 1e-9);
  EXPECT_LT(stage.fastest_turn_rad_per_s(), 1e-9);
  EXPECT_EQ(stage.source->status(stage.now()).late, 0u);
  EXPECT_EQ(stage.count("two subjects are called Head"), 1u);
  // Trackers of VMC by one serial number likewise, which have no numbers.
  Stage vmc({.protocol = "vmc"});
  for (int i = 0; i < 200; ++i)
    vmc.send(test::osc_bundle({test::osc("/VMC/Ext/T", {0.01f * static_cast<float>(i)}),
                               test::vmc_pose("/VMC/Ext/Tra/Pos", "head", {0, 1.7f, 0}, {0, 0, 0, 1}),
                               test::vmc_pose("/VMC/Ext/Tra/Pos", "head", {0.4f, 1.7f, 0}, {0, 1, 0, 0})}),
             kStart + i * 10 * kMsInNs);
  EXPECT_LT(vmc.fastest_mps(), 1e-9);
  EXPECT_LT(vmc.fastest_turn_rad_per_s(), 1e-9);
  EXPECT_EQ(vmc.count("two subjects are called head"), 1u);
}

// Nothing says where a frame of VMC ends. A frame that lacks a bone is told when the next one begins, as of
// its own time; and a datagram of two frames tells the newer.
TEST(LiveSenders, AFrameOfVmcThatLacksABoneIsNoSecondSubject) {
  const auto swaying_body = [](const test::Quad& head_turn) {
    Stage stage({.protocol = "vmc"});
    for (int i = 0; i < 450; ++i) {
      const double t_s = i / 90.0;
      const auto frame_at = [&](double at_s) {
        const auto x_m = static_cast<float>(0.3 * std::sin(std::numbers::pi * at_s));
        return std::vector<PacketBytes>{test::vmc_bone("Hips", {x_m, 0.9f, 0}, {0, 0, 0, 1}),
                                        test::vmc_bone("Head", {0, 0.7f, 0}, head_turn)};
      };
      std::vector<PacketBytes> bundle = {test::osc("/VMC/Ext/T", {static_cast<float>(t_s)})};
      for (const double before_s : {0.5 / 90.0, 0.0})
        if (before_s == 0.0 || i % 7 == 0)
          for (PacketBytes& bone : frame_at(t_s - before_s)) bundle.push_back(std::move(bone));
      if (i % 3 > 0) bundle.push_back(test::vmc_bone("UpperChest", {0, 0, 0}, {0, 0, 0, 1}));
      stage.send(test::osc_bundle(bundle), kStart + static_cast<int64_t>(t_s * kNsPerS));
    }
    return stage;
  };
  const Stage whole = swaying_body({0, 0, 0, 1});
  EXPECT_EQ(whole.count("two subjects"), 0u);
  EXPECT_EQ(whole.source->status(kStart).late, 0u);
  EXPECT_LE(whole.fastest_mps(), 2.0 * kMostSwayMps);
  for (size_t i = 60; i < whole.steps.size(); ++i) EXPECT_FALSE(whole.steps[i].has_teleported) << i;
  const Stage zeroed = swaying_body({0, 0, 0, 0});
  EXPECT_EQ(zeroed.count("two subjects"), 0u);
  EXPECT_EQ(zeroed.count("no head's pose"), 1u);
}

// Whose packets come in by the port of another protocol hears which option takes them.
TEST(LiveSenders, OscForAnotherPortIsKnown) {
  Stage vmc({.protocol = "vmc"}), vrchat({.protocol = "vrchat"});
  for (int i = 0; i < 100; ++i) {
    vmc.send(test::vrchat({0, 1.6f, 0}, {0, 0, 0}), kStart + i * 10 * kMsInNs);
    vrchat.send(test::vmc_head({0, 1.6f, 0}, {0, 0, 0, 1}, 0.01f * static_cast<float>(i)),
                kStart + i * 10 * kMsInNs);
  }
  EXPECT_EQ(vmc.count("VRChat's OSC: --mocap vrchat:PORT takes them"), 1u);
  EXPECT_EQ(vrchat.count("as VMC: --mocap vmc:PORT takes it"), 1u);
  for (Stage* stage : {&vmc, &vrchat}) EXPECT_EQ(stage->notes.size(), 1u);
}

// ---- damage

/// A right packet of a protocol, numbered, of a head near (0, 1.6, 0).
PacketBytes right_packet(const std::string& protocol, uint32_t number) {
  const double t_s = 0.01 * number;
  test::NatnetPacket natnet;
  natnet.version = protocol == "natnet 2.7" ? "2.7" : "4.1";
  natnet.frame = number;
  natnet.time_s = t_s;
  natnet.bodies = {{1, {0, 1.6f, 0}, {0, 0, 0, 1}, true}};
  natnet.has_all_kinds = true;
  test::FreedPacket freed;
  freed.position_mm = {0, 0, 1'600};
  test::FacePacketFields face;
  face.frame = static_cast<int32_t>(number);
  if (protocol == "vmc") return test::vmc_head({0, 1.6f, 0}, {0, 0, 0, 1}, static_cast<float>(t_s));
  if (protocol == "opentrack") return test::opentrack({0, 160, 0, 0, 0, 0});
  if (protocol == "freed") return test::freed(freed);
  if (protocol == "vrchat") return test::vrchat({0, 1.6f, 0}, {0, 0, 0});
  if (protocol == "mvn") return test::mvn({.sample = number, .time_ms = 10 * number});
  if (protocol == "livelinkface") return test::live_link_face(face);
  if (protocol.starts_with("opentrackio"))
    return test::opentrackio(fmt::format(
        R"({{"timing":{{"sequenceNumber":{}}},"transforms":[{{"translation":{{"x":0,"y":0,"z":1.6}}}}]}})",
        number));
  if (protocol != "vrpn") return test::natnet(natnet);
  return test::vrpn_pose(t_s, 0, 3, 0, {0, 1.6, 0}, {0, 0, 0, 1});
}

/// Bits, bytes and whole numbers that are others, parts that are missing, twice there, or added.
PacketBytes mutated(PacketBytes bytes, std::mt19937& random) {
  const auto any_place = [&] { return static_cast<ptrdiff_t>(random() % std::max<size_t>(bytes.size(), 1)); };
  for (uint32_t change = 0; change <= random() % 4 && !bytes.empty(); ++change) {
    const ptrdiff_t at = any_place();
    const auto part =
        static_cast<ptrdiff_t>(std::min<size_t>(1 + random() % 16, bytes.size() - static_cast<size_t>(at)));
    switch (random() % 6) {
      case 0:
        bytes[static_cast<size_t>(at)] ^= static_cast<std::byte>(1u << random() % 8);
        break;
      case 1:
        bytes[static_cast<size_t>(at)] = static_cast<std::byte>(random());
        break;
      case 2:
        std::fill_n(bytes.begin() + at, part, static_cast<std::byte>(random() % 2 ? 0xFF : 0x7F));
        break;
      case 3:
        bytes.erase(bytes.begin() + at, bytes.begin() + at + part);
        break;
      case 4: {
        const PacketBytes twice(bytes.begin() + at, bytes.begin() + at + part);
        bytes.insert(bytes.begin() + at, twice.begin(), twice.end());
        break;
      }
      default:
        bytes.resize(bytes.size() + static_cast<size_t>(part), static_cast<std::byte>(random()));
    }
  }
  return bytes;
}

TEST(LiveSenders, AThousandDamagedPacketsCostNoStep) {
  for (const std::string name : {"vmc", "opentrack", "freed", "natnet", "natnet 2.7", "vrpn", "livelinkface",
                                 "vrchat", "mvn", "opentrackio", "opentrackio document"}) {
    SCOPED_TRACE(name);
    const std::string protocol = name.substr(0, name.find(' '));
    std::mt19937 random(45);
    Stage stage({.protocol = protocol, .host = protocol == "vrpn" ? "a.server" : ""});
    const auto begin = [&](int64_t time_ns) {
      if (protocol == "vrpn") stage.send(test::vrpn_begin("Head"), time_ns);
    };
    uint32_t number = 0;
    int64_t time_ns = kStart;
    begin(time_ns);
    // Two right ones for each that is not, every 10 ms.
    for (int i = 0; i < 1'000; ++i) {
      for (int right = 0; right < 2; ++right)
        stage.send(right_packet(name, ++number), time_ns += 10 * kMsInNs);
      const uint64_t malformed = stage.source->status(time_ns).malformed;
      PacketBytes wrong = right_packet(name, ++number);
      if (name == "opentrackio document") {  // with a right header
        const PacketBytes document = mutated(PacketBytes(wrong.begin() + 16, wrong.end()), random);
        wrong =
            test::opentrackio(std::string(reinterpret_cast<const char*>(document.data()), document.size()));
      } else {
        wrong = mutated(wrong, random);
      }
      stage.send(wrong, time_ns += 10 * kMsInNs);
      // A stream that said something wrong, or waits for bytes that do not come, begins anew.
      if (protocol == "vrpn") {
        if (stage.source->status(time_ns).malformed == malformed) stage.source->begin_connection();
        begin(time_ns);
      }
    }
    for (int i = 0; i < 300; ++i) stage.send(right_packet(name, ++number), time_ns += 10 * kMsInNs);
    const LiveInputStatus status = stage.source->status(time_ns);
    EXPECT_GT(status.malformed + status.impossible + status.gated + status.late, 100u) << "they were damaged";
    // Each step has a head, and none is thrown or lost.
    EXPECT_EQ(stage.steps.size(), static_cast<size_t>((time_ns - kStart) / kStepNs + 1));
    for (size_t i = 1; i < stage.steps.size(); ++i) {
      ASSERT_TRUE(is_finite(stage.steps[i].world_from_head)) << i;
      EXPECT_TRUE(i < 60 || !stage.steps[i].is_motion_stale) << i;
    }
    EXPECT_LE(stage.fastest_mps(), kMostStepMps);
    const double height_m = protocol == "livelinkface" ? 0.0 : 1.6;
    EXPECT_LT(glm::distance(stage.head().position_m, glm::dvec3(0, height_m, 0)), 1e-6);
    EXPECT_LT(angle_between_rad(stage.head().rotation, {1, 0, 0, 0}), 1e-6);
  }
}

}  // namespace
}  // namespace strandcast::live_senders_test
