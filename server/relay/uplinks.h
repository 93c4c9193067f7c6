// Uplinks: viewers of a relay that say something, or get pictures, each by a session of its own at the server
// above, with its own role and token: that server judges. What only asks for parameters goes by one session
// for all. Any thread; nothing waits for the network.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/net/net_server.h"
#include "server/relay/upstream_link.h"

namespace strandcast {

/// At once: of the sessions that a server has for one address the relay's streams need some, too.
inline constexpr size_t kMaxUplinks = 40;
/// Largest number of uplinks of sessions that only watch; the others are kept for controllers, sources and
/// admins.
inline constexpr size_t kMaxWatchersUplinks = 24;
/// Largest number of uplinks of one address: for sessions that only watch, and again for all others.
inline constexpr size_t kMaxUplinksPerAddress = 12;
/// One by which nothing was said for so long ends, unless it brings pictures or what is watched. Longer than
/// the steps of a command take (kLongestStepsNs).
inline constexpr int64_t kIdleUplinkNs = 90'000'000'000;
/// Questions of one viewer that wait for their answer; more are refused.
inline constexpr size_t kMaxQuestionsOfOne = 4;
/// Shortest time from a refusal to the next attempt for the same viewer.
inline constexpr int64_t kSpeakAgainNs = 2'000'000'000;

/// Session at a relay that says something.
struct Speaker {
  SessionId session = 0;
  const Hello& hello;
  std::string address;  // what counts as one
};

class Uplinks {
 public:
  explicit Uplinks(UpstreamConfig config, int64_t idle_ns = kIdleUplinkNs)
      : config_(std::move(config)), idle_ns_(idle_ns) {}
  /// stop(), if it was not called.
  ~Uplinks() { stop(); }
  Uplinks(const Uplinks&) = delete;
  Uplinks& operator=(const Uplinks&) = delete;

  /// `net` outlives stop().
  void start(NetServer& net);
  /// Not on the network thread.
  void stop();

  /// What is answered goes to this viewer alone.
  void say(const Speaker& speaker, const ClientMessage& message);
  /// Pictures for this viewer, in the class that has its number; `head`: the number of the one it has joined.
  void open_pictures(const Speaker& speaker, size_t head);
  void request_picture(SessionId session);
  void leave(SessionId session);
  size_t count() const;

 private:
  struct Uplink {
    std::unique_ptr<UpstreamLink> link;  // null: it was refused, or lost, or idle
    int64_t ended_ns = 0;                // 0: it may be opened at once
    std::string address;
    bool is_watcher = false;  // its role is that of a viewer
    bool is_kept = false;     // it brings something by itself
    int64_t said_ns = 0;
  };
  /// For all who ask about one head.
  struct Enquiry {
    std::unique_ptr<UpstreamLink> link;  // null: none was needed, or it was lost
    std::deque<SessionId> asked_by;      // those whose answers are to come, in order
  };
  UpstreamLink* find_or_open(const Speaker& speaker, const Hello& hello, size_t head);
  std::optional<Error> why_full(const Speaker& speaker) const;
  void ask(const Speaker& speaker, const ParameterRequest& request);
  UpstreamLink& open_enquiry(const std::string& head, Enquiry& enquiry);
  void on_answer(const std::string& head, ClientEvent event);
  bool on_enquiry_lost(const std::string& head, const Error& error);
  void end_idle(int64_t time_ns);
  template <class IsOne>
  size_t count_open(IsOne is_one) const;
  void on_event(SessionId session, size_t head, ClientEvent event);
  bool on_lost(SessionId session, const Error& error, bool has_pictures);
  void end(Uplink& uplink);
  void tell(SessionId session, const Error& error, bool has_pictures);
  void run();

  const UpstreamConfig config_;
  const int64_t idle_ns_;
  NetServer* net_ = nullptr;
  mutable std::mutex mutex_;  // guards all below; never held while a link ends
  std::condition_variable changed_;
  bool is_stopping_ = false;
  std::map<SessionId, Uplink> uplinks_;
  std::map<std::string, Enquiry> enquiries_;          // by head
  std::vector<std::unique_ptr<UpstreamLink>> ended_;  // to be waited for
  std::thread thread_;
};

}  // namespace strandcast
