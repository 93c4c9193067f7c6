// ParameterWatch: sessions that subscribe to changes of parameters, and the values that they know. Any
// thread.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/net/net_config.h"
#include "server/source/scene_parameters.h"

namespace strandcast {

class ParameterWatch {
 public:
  /// Subscribes a session to the parameters whose path begins with `prefix`; it already knows `parameters`.
  void add(SessionId session, const std::string& prefix, const std::vector<ParameterInfo>& parameters);
  void remove(SessionId session);
  /// Returns for each session the values that changed since it was last told; at most kMaxListedParameters in
  /// a list.
  std::vector<std::pair<SessionId, ParameterList>> news(const std::vector<ParameterInfo>& parameters);
  bool is_empty() const;

 private:
  struct Watcher {
    std::string prefix;
    std::map<std::string, std::string> value_of;  // by path
  };
  mutable std::mutex mutex_;
  std::map<SessionId, Watcher> watchers_;
};

}  // namespace strandcast
