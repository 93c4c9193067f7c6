#include "server/app/parameter_watch.h"

namespace strandcast {

void ParameterWatch::add(SessionId session, const std::string& prefix,
                         const std::vector<ParameterInfo>& parameters) {
  Watcher watcher{prefix, {}};
  for (const ParameterInfo& info : parameters)
    if (begins_so(info.path, prefix)) watcher.value_of[info.path] = info.value;
  const std::lock_guard lock(mutex_);
  watchers_.insert_or_assign(session, std::move(watcher));
}

void ParameterWatch::remove(SessionId session) {
  const std::lock_guard lock(mutex_);
  watchers_.erase(session);
}

bool ParameterWatch::is_empty() const {
  const std::lock_guard lock(mutex_);
  return watchers_.empty();
}

std::vector<std::pair<SessionId, ParameterList>> ParameterWatch::news(
    const std::vector<ParameterInfo>& parameters) {
  std::vector<std::pair<SessionId, ParameterList>> all;
  const std::lock_guard lock(mutex_);
  for (auto& [session, watcher] : watchers_) {
    ParameterList list;
    list.is_change = true;
    for (const ParameterInfo& info : parameters) {
      if (!begins_so(info.path, watcher.prefix)) continue;
      const auto [known, is_new] = watcher.value_of.try_emplace(info.path, info.value);
      if (!is_new && known->second == info.value) continue;
      known->second = info.value;
      if (list.total++ < kMaxListedParameters) list.parameters.push_back(info);
    }
    if (list.total > 0) all.emplace_back(session, std::move(list));
  }
  return all;
}

}  // namespace strandcast
