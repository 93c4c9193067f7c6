// StreamAnnouncer: tells relays the list of strand streams when they join and when it changes. Any thread.
#pragma once

#include <functional>
#include <mutex>
#include <set>

#include "server/net/net_server.h"

namespace strandcast {

class StreamAnnouncer {
 public:
  /// Sets the network before any session joins; `net` must outlive the sessions.
  void connect(NetServer& net) { net_ = &net; }
  StreamList list() const;
  /// Edits the list. If it has changed, all relays are told before any frame that is published later.
  void change(const std::function<void(StreamList&)>& edit);
  /// Adds a relay, which is sent the list after its Welcome.
  void add(SessionId session);
  void remove(SessionId session);

 private:
  NetServer* net_ = nullptr;
  mutable std::mutex mutex_;
  StreamList list_;
  std::set<SessionId> relays_;
};

}  // namespace strandcast
