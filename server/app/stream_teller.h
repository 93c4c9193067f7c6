// StreamTeller: tells relays which streams of strands there are, when they join and when there are others.
// Any thread.
#pragma once

#include <functional>
#include <mutex>
#include <set>

#include "server/net/net_server.h"

namespace strandcast {

class StreamTeller {
 public:
  /// Before anybody joins; `net` outlives the sessions.
  void connect(NetServer& net) { net_ = &net; }
  StreamList list() const;
  /// All relays hear of it where it is another one then; before any frame that is published later.
  void change(const std::function<void(StreamList&)>& edit);
  /// From now on a relay, which is sent the list behind its Welcome.
  void add(SessionId session);
  void remove(SessionId session);

 private:
  NetServer* net_ = nullptr;
  mutable std::mutex mutex_;
  StreamList list_;
  std::set<SessionId> relays_;
};

}  // namespace strandcast
