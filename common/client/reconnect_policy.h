// ReconnectPolicy: the one table of coming back, for the window, the headless viewer, relays, feeders and
// strandcast-ctl: what is final, how long to wait, when a silent server counts as away, and how long it was
// away. The page has the same numbers (client/web/page/reconnect.ts). Pure logic on given times, no I/O.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// Between two attempts, growing from the first to the longest.
inline constexpr std::chrono::milliseconds kFirstReconnectDelay{250};
inline constexpr std::chrono::milliseconds kLongestReconnectDelay{5000};
/// Longest delay of a relay and of the commands of strandcast-ctl, since others wait for them, and of all
/// others in their first attempts: most servers are away for seconds.
inline constexpr std::chrono::milliseconds kLongestUrgentDelay{500};
inline constexpr uint32_t kUrgentAttempts = 60;
inline constexpr double kReconnectJitter = 0.25;  // relative, +-
/// A connection that lived this long: start from the first delay.
inline constexpr std::chrono::milliseconds kStableConnection{2'000};
/// Nothing heard for so long, where a Pong and a status are due each second: a new connection is tried beside
/// this one, and takes its place unless it speaks first.
inline constexpr std::chrono::milliseconds kDoubtedServer{1500};
/// Nothing heard for so long: "not connected" is shown. The connection itself waits for idle_timeout.
inline constexpr std::chrono::milliseconds kSilentServer{3000};
/// A command of strandcast-ctl tries to connect for so long.
inline constexpr std::chrono::milliseconds kCommandPatience{5000};

/// Whether somebody has ever been let in there. To a newcomer a name that does not exist is a typing error;
/// who was in it knows that it did exist.
enum class Standing { Newcomer, Member };

/// Whether trying again cannot help: a wrong token (Unauthorized); a role that is too low, a ring of relays
/// or a version that cannot be spoken (Unsupported); and to a newcomer what does not exist (NotFound).
bool is_final(const Error& error, Standing standing);

/// Turns a server's farewell, close code and Goodbye sentence, into an error whose code says whether another
/// attempt makes sense (is_final). Close code 0: the connection broke without one.
Error error_from_close(uint16_t close_code, const std::string& reason);

/// Beginning of the sentence of an error that the server stated when it closed the connection.
inline constexpr std::string_view kClosedByServer = "the server closed the connection: ";

/// Whether a connection on which something came last at `heard_ns` is to be shown as none; by now_ns().
bool is_silent(int64_t heard_ns, int64_t time_ns);
/// Whether it may be dead.
bool is_doubted(int64_t heard_ns, int64_t time_ns);

/// What has come lately on a connection that is open; times by now_ns().
struct Heard {
  int64_t last_ns = 0;  // anything
  /// Since when the relay there has heard nothing of its own server; 0: it hears it, or the server itself is
  /// there.
  int64_t away_since_ns = 0;
};
/// Takes in how long a status says that its server has been away.
void hear(Heard& heard, double away_s, int64_t time_ns);
/// Since when it is to be shown as no connection; 0: it is one.
int64_t silent_since_ns(const Heard& heard, int64_t time_ns);
/// Returns a sentence for a person: for how long nothing has come from the server.
std::string silence_text(const std::string& server, const Heard& heard, int64_t time_ns);

class ReconnectPolicy {
 public:
  /// `seed` spreads the attempts of many viewers that lost the same server at the same moment.
  explicit ReconnectPolicy(uint32_t seed, std::chrono::milliseconds longest = kLongestReconnectDelay)
      : random_(seed), longest_(longest) {}

  /// The server has said Welcome.
  void on_welcome(int64_t time_ns);
  /// An attempt failed, or the connection ended whose last byte came at `heard_ns` (0: now). Delay before the
  /// next attempt, or nothing when the error is final.
  std::optional<std::chrono::milliseconds> on_lost(const Error& error, int64_t time_ns, int64_t heard_ns = 0);
  /// Looks at an open connection, again and again: its silences are outages.
  void on_heard(const Heard& heard, int64_t time_ns);
  /// An attempt beside a connection that there still is failed; as on_lost().
  std::optional<std::chrono::milliseconds> on_failed(const Error& error);

  Standing standing() const { return welcomes_ > 0 ? Standing::Member : Standing::Newcomer; }
  /// Since the last Welcome.
  uint32_t attempts() const { return attempts_; }
  /// Welcomes after the first.
  uint64_t reconnects() const { return welcomes_ > 0 ? welcomes_ - 1 : 0; }
  /// Time without a connection since the first Welcome, s, silences included.
  double outage_s(int64_t time_ns) const;
  /// Length so far of the outage that lasts, s; 0: none does.
  double running_outage_s(int64_t time_ns) const;
  /// Time since the first Welcome, s; 0 before it.
  double since_first_s(int64_t time_ns) const;

 private:
  uint32_t random_;
  const std::chrono::milliseconds longest_;
  uint32_t attempts_ = 0;
  uint32_t doublings_ = 0;
  uint64_t welcomes_ = 0;
  int64_t first_ns_ = 0;    // the first Welcome
  int64_t welcome_ns_ = 0;  // of the running connection; 0: there is none
  int64_t lost_ns_ = 0;     // begin of the running outage
  int64_t silent_ns_ = 0;   // begin of the running silence; 0: something comes
  int64_t outage_ns_ = 0;   // those that are over
};

}  // namespace strandcast
