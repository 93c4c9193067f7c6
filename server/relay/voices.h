// Voices: viewers of a relay that say something, or get pictures, each by a session of its own at the server
// above, with its own role and token: that server judges. Any thread; nothing waits for the network.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "server/net/net_server.h"
#include "server/relay/upstream_link.h"

namespace strandcast {

/// At once: of the sessions that a server has for one address the relay's streams need some, too.
inline constexpr size_t kMaxVoices = 40;
/// After a refusal the next try for the same viewer comes no sooner.
inline constexpr int64_t kSpeakAgainNs = 2'000'000'000;

class Voices {
 public:
  explicit Voices(UpstreamConfig config) : config_(std::move(config)) {}
  /// stop(), if it was not called.
  ~Voices() { stop(); }
  Voices(const Voices&) = delete;
  Voices& operator=(const Voices&) = delete;

  /// `net` outlives stop().
  void start(NetServer& net);
  /// Not on the network thread.
  void stop();

  /// What is answered goes to this viewer alone.
  void say(SessionId session, const Hello& viewer, const ClientMessage& message);
  /// Pictures for this viewer, in the class that has its number; `head`: the number of the one it has joined.
  void open_pictures(SessionId session, const Hello& viewer, size_t head);
  void request_picture(SessionId session);
  void leave(SessionId session);
  size_t count() const;

 private:
  struct Voice {
    std::unique_ptr<UpstreamLink> link;  // null: it was refused, or lost
    int64_t ended_ns = 0;
  };
  UpstreamLink* find_or_open(SessionId session, const Hello& hello, size_t head);
  void on_event(SessionId session, size_t head, ClientEvent event);
  bool on_lost(SessionId session, const Error& error, bool has_pictures);
  void end(Voice& voice);
  size_t count_open() const;
  void tell(SessionId session, const Error& error, bool has_pictures);
  void run();

  const UpstreamConfig config_;
  NetServer* net_ = nullptr;
  mutable std::mutex mutex_;  // guards all below; never held while a link ends
  std::condition_variable changed_;
  bool is_stopping_ = false;
  std::map<SessionId, Voice> voices_;
  std::vector<std::unique_ptr<UpstreamLink>> ended_;  // to be waited for
  std::thread thread_;
};

}  // namespace strandcast
