// The part of Session that understands its client: Hello lets it in, and what comes later goes to the
// application when its role may send it.
#include <type_traits>
#include <utility>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "server/net/roles.h"
#include "server/net/session_private.h"

namespace strandcast::net {
namespace {

// Less than what a client doubts a silent server after (kDoubtedServer).
constexpr int64_t kLongestJoinWaitNs = 1'000'000'000;

CloseCode close_code_for(const Error& error) {
  switch (error.code) {
    case ErrorCode::LimitExceeded:
      return CloseCode::Full;
    case ErrorCode::Unavailable:
      return CloseCode::TryLater;
    case ErrorCode::Unauthorized:
      return CloseCode::Unauthorized;
    case ErrorCode::Unsupported:
      return CloseCode::Refused;
    case ErrorCode::NotFound:
      return CloseCode::NotFound;
    default:
      return CloseCode::Policy;
  }
}

}  // namespace

void Session::on_message(std::span<const std::byte> bytes, int64_t arrival_ns) {
  const Result<ClientMessage> message = decode_client_message(bytes);
  if (!message && message.error().code == ErrorCode::Unsupported)
    return context_.count(&NetCounters::unknown_messages);
  if (!message) return reject(CloseCode::BadData, message.error().to_string());
  if (state_ == State::AwaitHello) {
    if (waiting_hello_)
      return reject(CloseCode::Policy, fmt::format("{} comes before the Welcome.", message_name(*message)));
    const Hello* hello = std::get_if<Hello>(&*message);
    if (hello == nullptr)
      return reject(CloseCode::Policy,
                    fmt::format("The first message must be Hello, not {}.", message_name(*message)));
    return join(*hello);
  }
  if (!may_send(hello_.role, *message))
    return reject(CloseCode::Policy,
                  fmt::format("A {} may not send {}{}.", to_string(hello_.role), message_name(*message),
                              std::holds_alternative<Hello>(*message) ? " twice" : ""));
  dispatch(*message, arrival_ns);
}

/// Whether this client may have the role that it asks for; else the session ends.
bool Session::check_token(const Hello& hello) {
  if (context_.guard.is_banned(peer_.key, now_ns())) {
    context_.refuse(Refusal::Blocked, peer_, "an admin has banned this address");
    close(CloseCode::Policy, "An admin has banned this address for a time.");
    return false;
  }
  // None at all is no guess: a page that was opened without its token.
  const bool is_guessing = !peer_.is_trusted && !context_.tokens.empty() && !hello.token.empty();
  const Status allowed = check_role(context_.tokens, hello);
  if (allowed) return true;
  const bool is_wrong = allowed.error().code == ErrorCode::Unauthorized;
  // A right one passes a block: others at this address may have mistyped theirs.
  if (is_guessing && is_wrong && context_.guard.is_blocked(peer_.key, now_ns())) {
    context_.refuse(Refusal::Blocked, peer_, "tries a token too soon after too many wrong ones");
    close(CloseCode::TryLater, kBlockedSentence);
    return false;
  }
  const std::string sentence = allowed.error().to_string();
  if (is_guessing && is_wrong) context_.guard.on_wrong_token(peer_.key, now_ns());
  context_.refuse(is_wrong ? Refusal::Token : Refusal::Role, peer_, sentence);
  close(close_code_for(allowed.error()), sentence);
  return false;
}

void Session::check_stay() {
  if (state_ != State::Joined) return;
  const Status may_stay = strandcast::check_stay(context_.tokens, hello_);
  token_expires_unix_s_ = expiry_of(context_.tokens, hello_.token);
  if (may_stay) return;
  const std::string sentence = may_stay.error().to_string();
  context_.note(fmt::format("session {} from {}: {}", id_, peer_.address, sentence), LogLevel::Warn);
  close(close_code_for(may_stay.error()), sentence);
}

/// Whether somebody waits for what may be there in a moment, as a relay's server: to come again would take a
/// client longer.
bool Session::wait_with(const Hello& hello, const Error& trouble) {
  if (waiting_since_ns_ == 0) waiting_since_ns_ = now_ns();
  const int64_t waited_ns = now_ns() - waiting_since_ns_;
  if (trouble.code != ErrorCode::Unavailable || context_.is_stopping || waited_ns >= kLongestJoinWaitNs)
    return false;
  waiting_hello_ = hello;
  return true;
}

void Session::join(const Hello& hello) {
  if (!check_token(hello)) return;
  if (!context_.make_room(peer_.key)) return close_as_full();
  const Result<size_t> found = context_.find_head(hello.head);
  if (!found) return close(close_code_for(found.error()), found.error().message);
  head_ = *found;
  subscription_.begin(hello);
  Result<Admission> admission =
      head().handler.on_hello({id_, peer_.key, peer_.address, subscription_}, hello);
  if (!admission && wait_with(hello, admission.error())) return;
  if (!admission) return close(close_code_for(admission.error()), admission.error().to_string());
  hello_ = hello;
  token_expires_unix_s_ = expiry_of(context_.tokens, hello.token);
  codec_ = admission->welcome.codec;
  preview_ = std::move(admission->preview);
  admission->welcome.role = hello.role;
  admission->welcome.mode = subscription_.mode();
  has_joined_ = true;
  state_ = State::Joined;
  state_since_ns_ = now_ns();
  context_.update_session_counts();
  const bool gets_strands = subscription_.gets(StreamMode::Strands);
  context_.note(fmt::format("session {} from {} joined: {} '{}', {}{}", id_, peer_.address,
                            to_string(hello.role), hello.name,
                            subscription_.is_empty() ? "no stream" : to_string(subscription_.mode()),
                            gets_strands ? " by " + codec_text(admission->welcome) : std::string()));
  // Everything is set before anything is written, and strands start only behind the asset.
  if (!subscription_.is_empty()) begin_media(hello, admission->asset);
  queue_control(std::move(admission->welcome));
  // The Welcome says nothing about a rate below that of the simulation.
  if (subscription_.mode() == StreamMode::Strands && flow_.expects_acks() &&
      head().strands.classes()[0].rate_divisor > 1)
    announce_quality("the stream is set so");
  ask_for_keyframe(now_ns());
}

void Session::dispatch(const ClientMessage& message, int64_t arrival_ns) {
  std::visit(Overloaded{[&](const CameraChange& camera) { move_camera(camera); },
                        [&](const WindowChange& window) { follow_window(window, arrival_ns); },
                        [&](const KeyframeRequest&) {
                          if (is_relay())
                            ask_for_anchor(arrival_ns);
                          else
                            start_again(arrival_ns);
                        },
                        [&](const FrameAck& ack) { on_ack(ack, arrival_ns); },
                        [&](const Ping& ping) {
                          queue_control(Pong{ping.client_time_ns, arrival_ns + context_.clock_offset_ns, 0});
                        },
                        [&](const ModeRequest&) {
                          head().handler.on_message(id_, message, arrival_ns);
                          is_mode_request_waiting_ = true;
                          report_link(arrival_ns);
                        },
                        [&](const AdminCommand& command) { obey(command, arrival_ns); },
                        [&](const auto&) { head().handler.on_message(id_, message, arrival_ns); }},
             message);
}

/// Moves this viewer's camera, as it asked itself or as a controller did.
void Session::move_camera(const CameraChange& camera) {
  const PictureClass before = subscription_.pictures.picture_class;
  head().handler.on_message(id_, camera, now_ns());
  follow_picture_class(before);
}

/// What nobody sees stops at once, and begins again like what a client has lost.
void Session::follow_window(const WindowChange& window, int64_t time_ns) {
  const PictureClass before = subscription_.pictures.picture_class;
  const bool was_hidden = subscription_.is_hidden();
  head().handler.on_message(id_, window, time_ns);
  if (subscription_.is_hidden()) give_up_mode_change();
  if (subscription_.is_hidden() != was_hidden) return start_again(time_ns);
  follow_picture_class(before);
}

void Session::obey(const AdminCommand& command, int64_t time_ns) {
  if (command.action == AdminAction::ListSessions) return queue_control(context_.list_sessions(time_ns));
  log_info("net", "session {} from {}: an admin {}", id_, peer_.address,
           command.action == AdminAction::Kick
               ? fmt::format("ends session {}{}", command.session,
                             command.ban_s > 0.0 ? " and bans its address" : "")
               : "ends the server");
  if (command.action == AdminAction::ShutDown) {
    queue_control(Notice{false, "The server is stopping."});
    return head().handler.on_message(id_, command, time_ns);
  }
  const std::optional<std::string> key = context_.key_of(command.session);
  const bool is_own = key == peer_.key;
  if (command.ban_s > 0.0 && key && !is_own)
    context_.guard.ban(*key, time_ns, time_ns + static_cast<int64_t>(command.ban_s * 1e9));
  const bool is_known = context_.kick(command.session);
  if (state_ != State::Joined) return;  // it was this one
  const std::string ban = command.ban_s <= 0.0 ? ""
                          : is_own
                              ? " It is not banned: your own address is the same."
                              : fmt::format(" Nobody of its address is let in for {:g} s.", command.ban_s);
  queue_control(is_known ? Notice{false, fmt::format("Session {} was ended.{}", command.session, ban)}
                         : Notice{true, fmt::format("There is no session {}.", command.session)});
}

SessionInfo Session::info(int64_t time_ns) const {
  SessionInfo info;
  info.id = id_;
  info.name = hello_.name;
  info.address = peer_.address;
  info.role = hello_.role;
  info.mode = subscription_.mode();
  info.sent_bytes = sent_bytes_;
  info.queue_delay_ms = static_cast<double>(flow_.queue_delay_ns()) / kMsInNs;
  info.connected_s = static_cast<double>(time_ns - state_since_ns_) * 1e-9;
  return info;
}

void Session::reject(CloseCode code, const std::string& reason) {
  context_.refuse(Refusal::Message, peer_, reason);
  close(code, reason);
}

}  // namespace strandcast::net
