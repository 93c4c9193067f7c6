// LiveConnection: a viewer session that comes back by itself when the server was away. Connecting happens
// beside the caller's thread, so a window stays alive meanwhile. One thread otherwise.
#pragma once

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>

#include "client/app/viewer_session.h"
#include "common/client/reconnect_policy.h"

namespace strandcast {

class LiveConnection {
 public:
  /// The first connection must succeed: its error is the caller's.
  static Result<std::unique_ptr<LiveConnection>> open(const ClientConfig& config);
  /// Without a session yet: pump() connects.
  static std::unique_ptr<LiveConnection> begin(const ClientConfig& config);
  /// Gives up an attempt that is under way.
  ~LiveConnection();
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
  bool is_connected() const { return is_connected_; }
  /// Why there is no connection; empty while connected and before the first attempt failed.
  std::string trouble() const;
  /// What can be done about it, for a person; empty when there is nothing but waiting.
  std::string help() const;
  /// What is being done about it; empty while connected and when trying again cannot help.
  std::string doing() const;
  /// The reason, when trying again cannot help.
  const std::optional<Error>& final_error() const { return final_error_; }

 private:
  using Attempt = std::future<Result<std::unique_ptr<ViewerSession>>>;
  using Clock = std::chrono::steady_clock;

  LiveConnection(const ClientConfig& config, std::unique_ptr<ViewerSession> session);
  void lose(const Error& error);
  void start_attempt();

  std::atomic<bool> is_leaving_{false};
  std::atomic<ConnectStep> step_{ConnectStep::FindHost};  // of the attempt that runs, or ran last
  ClientConfig config_;
  const std::shared_ptr<ModeControl> modes_;
  std::shared_ptr<FrameTrace> trace_;  // null: none
  std::unique_ptr<ViewerSession> session_;
  ReconnectPolicy policy_;
  bool is_connected_;
  uint64_t attempts_ = 0;  // since there was a connection
  std::optional<Error> last_error_;
  std::optional<Error> final_error_;
  Clock::time_point next_attempt_;
  Attempt attempt_;  // last: its end waits for what is under way, which reads the others
};

}  // namespace strandcast
