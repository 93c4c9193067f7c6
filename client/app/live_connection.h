// LiveConnection: a viewer session that comes back by itself when the server was away. Connecting happens
// beside the caller's thread, so a window stays alive meanwhile. One thread otherwise.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "client/app/viewer_session.h"
#include "common/client/attempts.h"

namespace strandcast {

class LiveConnection {
 public:
  /// The first connection must succeed: its error is the caller's.
  static Result<std::unique_ptr<LiveConnection>> open(const ClientConfig& config);
  /// Returns a connection without a session; pump() connects it.
  static std::unique_ptr<LiveConnection> begin(const ClientConfig& config);
  LiveConnection(const LiveConnection&) = delete;
  LiveConnection& operator=(const LiveConnection&) = delete;

  /// Handles what arrived; starts and finishes attempts to reconnect. True when the session is a new one.
  bool pump(std::chrono::milliseconds timeout);
  /// What is wanted, given and shown, through all sessions. A wish that was not sent goes out with the next
  /// pump().
  const std::shared_ptr<ModeControl>& modes() const { return modes_; }

  /// Frames of all sessions go into it with their times.
  void set_trace(std::shared_ptr<FrameTrace> trace);

  bool has_session() const { return session_ != nullptr; }
  /// The running session, or the last one: its snapshots stay readable while the server is away. There must
  /// have been one.
  ViewerSession& session() { return *session_; }
  /// What the sessions before that one counted.
  const SessionTotals& earlier() const { return earlier_; }
  /// Returns whether there is a session on which the server said something within kSilentServer, behind a
  /// relay too.
  bool is_connected() const { return is_open_ && !is_silent(); }
  /// How often the server was found again.
  uint64_t reconnects() const { return attempts_.policy().reconnects(); }
  /// Time without a connection since the first Welcome, and since that Welcome, s.
  double outage_s() const { return attempts_.policy().outage_s(now_ns()); }
  double since_first_s() const { return attempts_.policy().since_first_s(now_ns()); }
  /// Why there is no connection; empty while connected and before the first attempt failed.
  std::string trouble() const;
  /// What can be done about it, for a person; empty when there is nothing but waiting.
  std::string help() const;
  /// What is being done about it; empty while connected and when trying again cannot help.
  std::string doing() const;
  /// Returns why trying again cannot help; nullopt while it can.
  const std::optional<Error>& final_error() const { return attempts_.final_error(); }

 private:
  explicit LiveConnection(const ClientConfig& config);
  void take(std::unique_ptr<ViewerSession> session);
  bool is_silent() const { return is_open_ && silent_since_ns(session_->heard(), now_ns()) != 0; }

  const std::shared_ptr<ModeControl> modes_;
  std::shared_ptr<FrameTrace> trace_;  // null: none
  std::unique_ptr<ViewerSession> session_;
  SessionTotals earlier_;
  bool is_open_ = false;
  Attempts<ViewerSession> attempts_;
};

}  // namespace strandcast
