// Sub-commands of strandcast-ctl, called with parsed options. Each prints its result and returns the exit
// code: 0 done, 1 the server refused or a check failed, 2 bad input or no server.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "client/app/feed.h"
#include "common/client/viewer_client.h"
#include "common/motion/clip_path.h"
#include "common/motion/motion_file.h"
#include "common/wire/messages.h"

namespace strandcast {

inline constexpr int kDoneExit = 0;
inline constexpr int kRefusedExit = 1;
inline constexpr int kBadInputExit = 2;

/// Prints the program\'s name and the error to standard error; returns the exit code.
int ctl_failure(const Error& error, int exit_code = kBadInputExit);

/// Address of the server and credentials for joining it.
struct CtlTarget {
  std::string connect;
  std::string token;
  std::filesystem::path token_file;  // read when not empty
  bool is_tls = false;
  std::filesystem::path tls_authorities;    // means TLS when not empty
  const std::atomic<bool>* stop = nullptr;  // set: connecting and waiting for answers end
  std::string head = {};                    // which one of the server's; empty: the first
};

struct FeedOptions {
  std::string motion = "builtin";  // "builtin", "none", a BVH file, or an .abc of hair that moves as one
  std::string wind = "gusts";      // "gusts", "none" or a CSV file
  MotionFileOptions motion_file;   // how to read a BVH file
  bool is_looped = false;
  bool is_keeping_facing = false;  // else a file that looks aside is turned to look ahead
  double blend_s = kClipBlendS;  // in which a motion sets in; 0: at once, and a loop jumps from end to start
  bool is_live = false;          // does not wait for a slow simulation
  double speed = 1.0;
  double seconds = 0.0;  // 0 = the length of the motion, or without end when looped or built in
  double rate_hz = 120.0;
  std::string timecode = {};  // of the motion's beginning; empty: none is sent
  std::string ltc = {};       // WAV file, or - : timecode of its sound; empty: none
  std::string fps = {};  // that it counts (empty: 24), and of a BVH file that states none (empty: refused)
  glm::vec3 wind_mps{1.5f, 0.0f, 1.0f};  // mean of the gusts, world
  float gust_intensity = 0.6f;
  uint32_t seed = 1;
  bool is_checking = false;      // says what files are taken for, and feeds nothing
  std::string as = {};           // protocol of motion capture; empty: to a server as its source
  std::string to = "127.0.0.1";  // HOST or HOST:PORT that gets it
};

/// Whether motion is that of curves: they move the head whose hair they are.
bool is_of_curves(const std::string& motion);

struct HairOrigin;
using FindHair = std::function<Result<HairOrigin>()>;

/// Loads the files of a feed and prints notes about them to standard error. BadInput for motion of curves
/// where nobody finds the hair that they move.
Result<FeedPlan> make_feed_plan(const FeedOptions& options, const FindHair& find_hair = {});
/// Returns the settings for joining the server in this role, as a viewer of strands.
Result<ClientConfig> client_config_for(const CtlTarget& target, Role role);

int run_feed(const CtlTarget& target, const FeedOptions& options, const std::atomic<bool>& stop);
/// Prints a line per status; `seconds` 0 = until stopped.
int run_monitor(const CtlTarget& target, double seconds, const std::atomic<bool>& stop);
/// Sends one command or assignment and prints the server's answer.
int run_command(const CtlTarget& target, const ClientMessage& message);
/// Sends a command that is made from the server's Welcome, and prints the answer.
using MessageMaker = std::function<Result<ClientMessage>(const Welcome&)>;
int run_command(const CtlTarget& target, const MessageMaker& make);
/// Sends an admin's command; needs an admin's token.
int run_admin(const CtlTarget& target, const AdminCommand& command);
/// Writes the server's present scene to a scene file.
int run_save(const CtlTarget& target, const std::filesystem::path& path);
int run_check(const CtlTarget& target, uint64_t frames, double timeout_s);
int run_health(const CtlTarget& target);

}  // namespace strandcast
