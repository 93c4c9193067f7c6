// Feeds a running server with head motion and wind as a network source: one sample per message, sent when its
// time has come. Motion and wind are functions of time here; files are loaded by the caller. A simulation
// that is slower than real time, or paused, is fed as slowly, so that the hair feels what the file says: slow
// motion, not a head that is too fast for it.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/app/steady_client.h"
#include "common/base/result.h"
#include "common/base/timecode.h"
#include "common/math/pose.h"
#include "common/motion/mocap_packet.h"

namespace strandcast {

struct FeedPlan {
  std::function<Pose(double t_s)> motion;  // empty = none
  std::vector<std::string> joint_names;    // of the body, sent with the motion; at most kMaxMotionJoints
  std::function<std::vector<glm::dvec3>(double t_s)> joints;    // of each, head space; empty = none
  std::function<glm::vec3(double t_s)> wind;                    // world, m/s; empty = none
  double rate_hz = 120.0;                                       // samples per second of each
  double speed = 1.0;                                           // motion time per real time
  double duration_s = 0.0;                                      // real time; 0 = until stopped
  double motion_s = 0.0;                                        // motion time; 0 = without end
  std::function<std::optional<Timecode>(double t_s)> timecode;  // of the motion; empty = none
  bool is_live = false;                                         // in real time whatever the simulation does
  std::string taken = "no file of motion is named";             // what one is taken for
  std::vector<std::string> unlikely = {};                       // why no head moves so, a sentence each
};

/// A simulation that is slower than real time by less than this is not followed.
inline constexpr double kSteadyPace = 0.97;

/// How fast to play after what the server says: `present` is moved half of the way to its pace, at once to 0
/// when it pauses. 1 = in real time.
double follow_pace(double present, const ServerStatus& status);

inline constexpr double kMinFeedRateHz = 1.0;
inline constexpr double kMaxFeedRateHz = 400.0;
inline constexpr double kMaxDatagramRateHz = 1000.0;  // of packets of motion capture

struct FeedProgress {
  double elapsed_s = 0.0;  // real time
  double motion_s = 0.0;   // motion time
  double pace = 1.0;       // of the slowest simulation, as it is followed
  uint64_t motion_samples = 0;
  uint64_t wind_samples = 0;
  uint64_t skipped_samples = 0;    // their time had passed: this process was held up
  uint64_t unsent_samples = 0;     // the server was away, or did not read fast enough
  uint64_t rejected_samples = 0;   // as the server reports it, of all sources
  uint64_t refused_samples = 0;    // of this feed, as far as it is known
  std::string refusal;             // why the first of them
  double worst_lateness_ms = 0.0;  // of a sample behind its time
  std::string last_notice;         // from the server
  bool is_heard = true;     // motion that is sent arrives where hair is simulated, as far as it is told
  uint64_t reconnects = 0;  // of all heads
  double outage_s = 0.0;    // without a connection, of the worst head
  double gone_s = 0.0;      // since when a head has been without an answer at the end; 0: none is
};

/// Returns the sentence on a server that went away: for how long, whether it came back, and what was not
/// sent; empty where it stayed.
std::string gone_sentence(const FeedProgress& done);

/// Returns why a feed of which more than a tenth was refused has failed; empty for others.
std::string refusal_sentence(const FeedProgress& done);

/// Returns the sentence on a feed that the simulation held up; empty where it went on in real time, but for
/// its first moments.
std::string slow_motion_sentence(const FeedProgress& done, double speed);

/// Sends one moment of a plan where there is no server to talk to: its time, pose, wind and timecode are set.
using SendMoment = std::function<bool(MocapMoment moment)>;

/// Called about once a second.
using FeedListener = std::function<void(const FeedProgress&)>;

/// A simulation that goes on for so long without the motion that is sent has not heard it.
inline constexpr std::chrono::milliseconds kUnheardTime{2000};

/// Connects to the head that `config` names, else to each that the server has. Waits for the server, `limit`
/// at most.
Result<std::vector<std::unique_ptr<SteadyClient>>> connect_heads(ClientConfig config,
                                                                 const std::atomic<bool>& stop,
                                                                 std::chrono::milliseconds limit);

/// Feeds one head or several, each by a connection of its own, with the same samples. Runs until the plan's
/// duration is over or `stop` is set. A connection that is lost comes back; meanwhile the motion waits,
/// unless it is live. The error is one that trying again does not mend.
Result<FeedProgress> feed(std::span<const std::unique_ptr<SteadyClient>> heads, const FeedPlan& plan,
                          const std::atomic<bool>& stop, const FeedListener& listener);

/// Feeds in real time to a receiver that does not answer.
FeedProgress feed_moments(const SendMoment& send, const FeedPlan& plan, const std::atomic<bool>& stop,
                          const FeedListener& listener);

}  // namespace strandcast
