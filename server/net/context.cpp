#include "server/net/context_private.h"

#include <algorithm>
#include <functional>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "server/net/beast_private.h"
#include "server/net/connection_private.h"
#include "server/net/session_private.h"

namespace strandcast::net {
namespace {

/// Somebody without a Hello that was accepted.
struct Waiting {
  const Peer* peer = nullptr;
  bool is_idle = false;  // between two requests
  std::function<void()> end;
};

bool is_waiting(const Session& session) {
  return session.state() != Session::State::Joined && session.state() != Session::State::Closed;
}

std::vector<Waiting> all_waiting(const Context& context) {
  std::vector<Waiting> all;
  for (const auto& connection : context.connections)
    all.push_back({&connection->peer(), connection->is_idle(), [connection] { connection->abort(); }});
  for (const auto& [id, session] : context.sessions)
    if (is_waiting(*session)) all.push_back({&session->peer(), false, [one = session] { one->abort(); }});
  return all;
}

/// Of the address that has most of them, the one that came first.
const Waiting& least_worthy(const std::vector<Waiting>& waiting) {
  std::map<std::string_view, size_t> count_of;
  for (const Waiting& one : waiting) ++count_of[one.peer->key];
  return *std::min_element(waiting.begin(), waiting.end(), [&](const Waiting& a, const Waiting& b) {
    const size_t a_count = count_of[a.peer->key], b_count = count_of[b.peer->key];
    return a_count != b_count ? a_count > b_count : a.peer->accepted_ns < b.peer->accepted_ns;
  });
}

/// Ends the connection that came first of those between two requests; false when there is none. Of one
/// address, if its key is given.
bool end_idle(const std::vector<Waiting>& waiting, const std::string* peer_key) {
  const Waiting* oldest = nullptr;
  for (const Waiting& one : waiting)
    if (one.is_idle && (peer_key == nullptr || one.peer->key == *peer_key) &&
        (oldest == nullptr || one.peer->accepted_ns < oldest->peer->accepted_ns))
      oldest = &one;
  if (oldest != nullptr) oldest->end();
  return oldest != nullptr;
}

}  // namespace

Context::Context(const NetConfig& net_config, const std::vector<NetHead>& net_heads)
    : config(net_config),
      tokens(net_config.tokens),
      heads(net_heads.begin(), net_heads.end()),
      guard({net_config.limits.connections_per_s, net_config.limits.requests_per_s,
             net_config.limits.wrong_tokens, net_config.limits.wrong_token_window_ms * kMsInNs,
             net_config.limits.wrong_token_block_ms * kMsInNs, net_config.limits.guarded_addresses}),
      refusal_lines({net_config.limits.refusal_lines_per_address, net_config.limits.refusal_lines}),
      session_lines({net_config.limits.session_lines, net_config.limits.session_lines}) {}

void Context::refuse(Refusal why, const Peer& peer, std::string_view detail) {
  const RefusalRow& row = row_of(why);
  count(row.counter);
  const LogBudget::Verdict verdict = refusal_lines.take(peer.key, now_ns());
  if (verdict.left_out > 0) log_warn("net", "{} refusals before this one left no line", verdict.left_out);
  if (verdict.is_written) log_warn("net", "refused {} {}: {}", peer.address, row.word, detail);
}

void Context::note(const std::string& line, LogLevel level) {
  const LogBudget::Verdict verdict = session_lines.take({}, now_ns());
  if (verdict.left_out > 0) log_warn("net", "{} lines about sessions were left out", verdict.left_out);
  if (verdict.is_written) log_line(level, "net", line);
}

Context::Room Context::look_for_room(const std::string& peer_key) const {
  const int64_t time_ns = now_ns();
  size_t all = 0;
  size_t of_peer = 0;
  Session* doubted = nullptr;
  Session* doubted_of_peer = nullptr;
  const auto choose = [](Session*& chosen, Session& one) {
    if (chosen == nullptr || one.received_ns() < chosen->received_ns()) chosen = &one;
  };
  for (const auto& [id, session] : sessions) {
    if (session->state() != Session::State::Joined) continue;
    const bool is_of_peer = session->peer().key == peer_key;
    ++all;
    if (is_of_peer) ++of_peer;
    if (!session->is_doubted(time_ns)) continue;
    choose(doubted, *session);
    if (is_of_peer) choose(doubted_of_peer, *session);
  }
  if (of_peer >= config.limits.sessions_per_address) return {false, doubted_of_peer};
  return all < config.limits.sessions ? Room{true, nullptr} : Room{false, doubted};
}

bool Context::has_room(const std::string& peer_key) const {
  const Room room = look_for_room(peer_key);
  return room.is_free || room.doubted != nullptr;
}

bool Context::make_room(const std::string& peer_key) {
  const Room room = look_for_room(peer_key);
  if (room.doubted != nullptr)
    room.doubted->shared_from_this()->give_way();  // it leaves the list of sessions
  return room.is_free || room.doubted != nullptr;
}

size_t Context::waiting_of(const std::string& peer_key) const {
  const std::vector<Waiting> waiting = all_waiting(*this);
  return static_cast<size_t>(std::count_if(waiting.begin(), waiting.end(),
                                           [&](const Waiting& one) { return one.peer->key == peer_key; }));
}

bool Context::make_place(const Peer& peer) {
  std::vector<Waiting> waiting = all_waiting(*this);
  std::erase_if(waiting, [&](const Waiting& one) { return one.peer->is_trusted != peer.is_trusted; });
  if (peer.is_trusted)
    return waiting.size() < config.limits.sessions + kSpareConnections || end_idle(waiting, nullptr);
  if (!peer.is_proxy && waiting_of(peer.key) >= kSpareConnectionsPerAddress)
    return end_idle(waiting, &peer.key);
  if (waiting.size() < kSpareConnections || end_idle(waiting, nullptr)) return true;
  const Waiting& oldest = least_worthy(waiting);
  refuse(Refusal::Full, *oldest.peer, "gave its place to somebody else before it said Hello");
  oldest.end();
  return true;
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

std::optional<std::string> Context::key_of(SessionId id) const {
  const auto found = sessions.find(id);
  return found == sessions.end() ? std::nullopt : std::optional(found->second->peer().key);
}

Result<size_t> Context::find_head(const std::string& name) const {
  if (name.empty() || heads.front().name.empty()) return size_t{0};
  std::string known;
  for (size_t i = 0; i < heads.size(); ++i) {
    if (heads[i].name == name) return i;
    if (heads[i].name.empty()) continue;
    known += (known.empty() ? "" : ", ") + heads[i].name;
  }
  return make_error(ErrorCode::NotFound, "There is no head called '{}' here (there are: {}).", name, known);
}

Status Context::readiness() {
  for (Head& head : heads) {
    const Status status = head.handler.readiness();
    if (!status) return heads.size() == 1 || head.name.empty() ? status : at(head.name, status.error());
  }
  return {};
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
