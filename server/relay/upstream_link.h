// UpstreamLink: one session of a relay at the server that it stands in for, on a thread of its own. What is
// sent before the Welcome waits, within bounds; a link that is lost is opened again if its owner wants that.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/base/result.h"
#include "common/client/attempts.h"
#include "common/client/viewer_client.h"

namespace strandcast {

/// Where a relay gets what it passes on.
struct UpstreamConfig {
  Address address;
  std::filesystem::path tls_authorities;  // as in ClientConfig
  std::string token;                      // of the relay itself
  std::string head;                       // the only one that is passed on; empty = all that are there
};
ClientConfig client_config_for(const UpstreamConfig& config, const Hello& hello);
/// As it came, with the time that it was sent.
EncodedFramePtr frame_of(MediaEvent media);

/// Messages that wait for the Welcome; more are left out.
inline constexpr size_t kMaxWaitingMessages = 256;

class UpstreamLink {
 public:
  /// Called on the link's thread, without any lock.
  struct Hooks {
    std::function<Status(const Welcome&)> on_welcome;  // an error ends the session
    std::function<void(ClientEvent)> on_event;         // but the last
    /// The session is over, or none could be had; whether to try again.
    std::function<bool(const Error&)> on_lost;
    std::function<void(bool)> on_silence = {};  // nothing has come for kSilentServer, or something again
  };
  UpstreamLink(ClientConfig config, Hooks hooks);
  /// Waits for the thread, a fraction of a second.
  ~UpstreamLink();
  UpstreamLink(const UpstreamLink&) = delete;
  UpstreamLink& operator=(const UpstreamLink&) = delete;

  // From any thread.
  /// The thread ends soon; the destructor then waits for less.
  void begin_stop();
  void send(const ClientMessage& message);
  void request_keyframe();
  /// Ends the present session as if it were lost for this reason.
  void lose(Error error);
  /// Returns the clock offset of the current session.
  ClockOffset clock() const;
  /// Payload of all sessions.
  uint64_t received_bytes() const;

 private:
  void run();
  Error serve(ReconnectPolicy& policy);
  Status connect();
  Error hear(ViewerClient& client);

  ClientConfig config_;
  const Hooks hooks_;
  std::unique_ptr<ViewerClient> next_;  // of the thread; takes the place of one that fell silent
  std::atomic<bool> is_stopping_{false};
  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable stopped_;
  ViewerClient* client_ = nullptr;  // of the thread, while it has said Welcome
  std::deque<ClientMessage> waiting_;
  std::optional<Error> lost_for_;  // by lose()
  uint64_t earlier_bytes_ = 0;
  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace strandcast
