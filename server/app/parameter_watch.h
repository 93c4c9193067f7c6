// ParameterWatch: sessions that want to hear when a parameter changes, and what they know. Any thread.
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
  /// From now on this session hears of those whose path begins so; it knows these.
  void add(SessionId session, const std::string& prefix, const std::vector<ParameterInfo>& parameters);
  void remove(SessionId session);
  /// What is other, for each session that has not heard of it; at most kMaxListedParameters in a list.
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
