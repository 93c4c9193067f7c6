#include "server/net/beast_private.h"
#include "server/net/context_private.h"
#include "server/net/session_private.h"

namespace strandcast::net {

Context::Context(const NetConfig& net_config, NetHandler& net_handler)
    : config(net_config),
      handler(net_handler),
      strands(net_config.strand_classes),
      guard({net_config.limits.connections_per_s, net_config.limits.wrong_tokens,
             net_config.limits.wrong_token_window_ms * kNsPerMs,
             net_config.limits.wrong_token_block_ms * kNsPerMs, net_config.limits.guarded_addresses}) {}

bool Context::has_room(const std::string& peer_key) const {
  size_t all = 0;
  size_t of_peer = 0;
  for (const auto& [id, session] : sessions) {
    if (session->state() == Session::State::Closing) continue;
    ++all;
    if (session->peer().key == peer_key) ++of_peer;
  }
  return all < config.limits.sessions && of_peer < config.limits.sessions_per_address;
}

SessionList Context::list_sessions(int64_t time_ns) const {
  SessionList list;
  for (const auto& [id, session] : sessions)
    if (session->state() == Session::State::Joined && list.sessions.size() < kMaxListedSessions)
      list.sessions.push_back(session->info(time_ns));
  return list;
}

bool Context::kick(SessionId id) {
  const auto found = sessions.find(id);
  if (found == sessions.end() || found->second->state() != Session::State::Joined) return false;
  std::shared_ptr(found->second)->close(CloseCode::Kicked, "An admin ended this session.");
  return true;
}

void Context::update_session_counts() {
  uint64_t joined = 0;
  for (const auto& [id, session] : sessions)
    if (session->state() == Session::State::Joined) ++joined;
  const std::lock_guard lock(mutex);
  counters.open_sessions = sessions.size();
  counters.joined_sessions = joined;
}

}  // namespace strandcast::net
