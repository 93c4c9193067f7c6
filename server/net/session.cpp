#include "server/net/session_private.h"

#include <algorithm>
#include <exception>
#include <type_traits>
#include <utility>

#include "common/base/log.h"
#include "common/base/profile.h"

namespace strandcast::net {
namespace {

/// How much waits unsent in the kernel, so that a late frame is dropped here and not queued there.
constexpr int kUnsentBytes = 128 << 10;
constexpr int64_t kProbeIntervalNs = 1'000 * kNsPerMs;
/// Longest sentence of ours put into a Goodbye.
constexpr size_t kMaxReasonCharacters = 500;

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};

CloseCode close_code_for(const Error& error) {
  switch (error.code) {
    case ErrorCode::LimitExceeded:
      return CloseCode::Full;
    case ErrorCode::Unauthorized:
      return CloseCode::Unauthorized;
    default:
      return CloseCode::Policy;
  }
}

const char* message_name(const ClientMessage& message) {
  constexpr const char* kNames[] = {"Hello",           "MotionSamples", "WindSamples", "CameraChange",
                                    "KeyframeRequest", "FrameAck",      "Ping",        "ControlCommand",
                                    "SetParameter",    "ViewerReport",  "ModeRequest", "AdminCommand"};
  static_assert(std::size(kNames) == std::variant_size_v<ClientMessage>);
  return kNames[message.index()];
}

}  // namespace

Session::Session(Context& context, SessionId id, NetStream stream, Peer peer)
    : context_(context),
      id_(id),
      socket_(std::move(stream)),
      peer_(std::move(peer)),
      rate_(context.config.limits.messages_per_s),
      state_since_ns_(peer_.accepted_ns) {}

void Session::start(http::request<http::empty_body> request, bool has_room) {
  request_ = std::move(request);
  const NetLimits& limits = context_.config.limits;
  beast::error_code ignored;
  auto& tcp_socket = socket_.next_layer().socket();
  tcp_socket.set_option(asio::socket_base::send_buffer_size(static_cast<int>(kSendBufferBytes)), ignored);
  using UnsentLowWater = asio::detail::socket_option::integer<IPPROTO_TCP, TCP_NOTSENT_LOWAT>;
  tcp_socket.set_option(UnsentLowWater(kUnsentBytes), ignored);

  websocket::stream_base::timeout timeout;
  timeout.handshake_timeout = std::chrono::milliseconds(limits.handshake_ms);
  timeout.idle_timeout = std::chrono::milliseconds(limits.idle_ms);
  timeout.keep_alive_pings = true;
  socket_.set_option(timeout);
  socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(http::field::sec_websocket_protocol, kWebSocketProtocol);
    response.set(http::field::server, "strandcast");
  }));
  socket_.read_message_max(kMaxControlBytes);
  socket_.auto_fragment(false);
  socket_.binary(true);
  socket_.async_accept(request_, [self = shared_from_this(), has_room](const beast::error_code& error) {
    if (error) return self->finish();
    self->guarded([&] { self->on_open(has_room); });
  });
}

void Session::on_open(bool has_room) {
  if (state_ != State::Handshake) return;
  state_ = State::AwaitHello;
  read();
  if (context_.is_stopping) return close(CloseCode::GoingAway, "The server is stopping.");
  if (!has_room) {
    context_.count(&NetCounters::refused_full);
    close(CloseCode::Full,
          fmt::format("The server is full: at most {} sessions and {} from one address.",
                      context_.config.limits.sessions, context_.config.limits.sessions_per_address));
  }
}

void Session::read() {
  socket_.async_read(read_buffer_, [self = shared_from_this()](const beast::error_code& error, size_t) {
    self->guarded([&] { self->on_read(error); });
  });
}

void Session::on_read(const beast::error_code& error) {
  if (state_ == State::Closed) return;
  if (error) {
    // Beast has answered an oversized or malformed frame with the fitting close code already.
    if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow ||
        error == websocket::condition::protocol_violation)
      context_.count(&NetCounters::bad_messages);
    if (error != websocket::error::closed) log_debug("net", "session {}: {}", id_, error.message());
    return finish();
  }
  if (state_ == State::Closing) return;  // the close under way drains the rest
  const auto data = read_buffer_.cdata();
  const int64_t arrival_ns = now_ns();
  if (!rate_.take(arrival_ns))
    return reject(CloseCode::Policy, fmt::format("More than {:.0f} messages per second.",
                                                 context_.config.limits.messages_per_s));
  context_.count(&NetCounters::messages_received);
  received_ns_ = arrival_ns;
  on_message({static_cast<const std::byte*>(data.data()), data.size()}, arrival_ns);
  read_buffer_.consume(read_buffer_.size());
  if (state_ == State::AwaitHello || state_ == State::Joined) read();
}

void Session::on_message(std::span<const std::byte> bytes, int64_t arrival_ns) {
  if (socket_.got_text()) return reject(CloseCode::BadData, "Text messages are not part of the protocol.");
  const Result<ClientMessage> message = decode_client_message(bytes);
  if (!message) return reject(CloseCode::BadData, message.error().to_string());
  if (state_ == State::AwaitHello) {
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

void Session::join(const Hello& hello) {
  if (const Status allowed = check_role(context_.config.tokens, hello); !allowed) {
    context_.count(&NetCounters::refused_token);
    if (allowed.error().code == ErrorCode::Unauthorized && !peer_.is_trusted)
      context_.guard.on_wrong_token(peer_.key, now_ns());
    log_warn("net", "session {} from {} as {}: {}", id_, peer_.address, to_string(hello.role),
             allowed.error().to_string());
    return close(close_code_for(allowed.error()), allowed.error().to_string());
  }
  Result<Admission> admission = context_.handler.on_hello(id_, hello);
  if (!admission) return close(close_code_for(admission.error()), admission.error().to_string());
  hello_ = hello;
  hello_.token.clear();
  admission->welcome.role = hello.role;
  mode_ = admission->welcome.mode;
  picture_class_ = admission->picture_class;
  picture_costs_ = admission->picture_costs;
  picture_step_ = admission->picture_step;
  has_joined_ = true;
  state_ = State::Joined;
  state_since_ns_ = now_ns();
  context_.update_session_counts();
  log_info("net", "session {} from {} joined: {} '{}', {}", id_, peer_.address, to_string(hello.role),
           hello.name, to_string(mode_));
  // The asset is set before anything is written, and strands start only once it is: nothing can overtake it.
  if (hello.role != Role::Source) {
    queue_.set_asset(admission->asset);
    has_asset_ = admission->asset != nullptr;
    if (mode_ == StreamMode::Strands) queue_.start_strands();
    if (mode_ == StreamMode::Frames) {
      queue_.start_pictures();
      // The first pictures are too small to show what the link carries.
      flow_.start_over(now_ns());
    }
  }
  if (hello.role != Role::Source) {
    if (hello.acknowledges) flow_.expect_acks();
    flow_.remember_capacity_for(context_.config.limits.link_memory_ms * kNsPerMs);
    socket_.control_callback(
        [this](websocket::frame_type kind, beast::string_view) { on_control_frame(kind); });
    probe(now_ns());
  }
  queue_control(std::move(admission->welcome));
  // The Welcome says nothing about a rate below that of the simulation.
  if (mode_ == StreamMode::Strands && flow_.expects_acks() && context_.strand_classes[0].rate_divisor > 1)
    announce_quality("the stream is set so");
  ask_for_keyframe(now_ns());
}

void Session::dispatch(const ClientMessage& message, int64_t arrival_ns) {
  NetHandler& handler = context_.handler;
  std::visit(Overloaded{[](const Hello&) {},
                        [&](const MotionSamples& samples) { handler.on_motion(id_, samples, arrival_ns); },
                        [&](const WindSamples& samples) { handler.on_wind(id_, samples, arrival_ns); },
                        [&](const CameraChange& camera) { handler.on_camera(id_, camera); },
                        [&](const KeyframeRequest&) {
                          queue_.lose_chain();
                          if (mode_ == StreamMode::Frames || changes_to(StreamMode::Frames))
                            queue_.start_pictures();
                          flow_.forget_in_flight();
                          account_drops();
                          ask_for_keyframe(arrival_ns);
                        },
                        [&](const FrameAck& ack) {
                          on_ack(ack, arrival_ns);
                          handler.on_ack(id_, ack);
                        },
                        [&](const Ping& ping) {
                          queue_control(Pong{ping.client_time_ns, arrival_ns, 0});
                        },
                        [&](const ControlCommand& command) { handler.on_command(id_, command); },
                        [&](const SetParameter& parameter) { handler.on_parameter(id_, parameter); },
                        [&](const ViewerReport& report) { handler.on_report(id_, report); },
                        [&](const ModeRequest& request) { handler.on_mode_request(id_, request); },
                        [&](const AdminCommand& command) { obey(command, arrival_ns); }},
             message);
}

void Session::obey(const AdminCommand& command, int64_t time_ns) {
  if (command.action == AdminAction::ListSessions) return queue_control(context_.list_sessions(time_ns));
  log_info("net", "session {} from {}: an admin {}", id_, peer_.address,
           command.action == AdminAction::Kick ? fmt::format("ends session {}", command.session)
                                               : "ends the server");
  if (command.action == AdminAction::ShutDown) {
    queue_control(Notice{false, "The server is stopping."});
    return context_.handler.on_shut_down(id_);
  }
  const bool is_known = context_.kick(command.session);
  if (state_ != State::Joined) return;  // it was this one
  queue_control(is_known ? Notice{false, fmt::format("Session {} was ended.", command.session)}
                         : Notice{true, fmt::format("There is no session {}.", command.session)});
}

SessionInfo Session::info(int64_t time_ns) const {
  SessionInfo info;
  info.id = id_;
  info.name = hello_.name;
  info.address = peer_.address;
  info.role = hello_.role;
  info.mode = mode_;
  info.sent_bytes = sent_bytes_;
  info.queue_delay_ms = static_cast<double>(flow_.queue_delay_ns()) / kNsPerMs;
  info.connected_s = static_cast<double>(time_ns - state_since_ns_) * 1e-9;
  return info;
}

void Session::reject(CloseCode code, const std::string& reason) {
  context_.count(&NetCounters::bad_messages);
  log_warn("net", "session {} from {}: {}", id_, peer_.address, reason);
  close(code, reason);
}

void Session::send(ServerMessage message) {
  if (state_ != State::Joined) return;
  if (auto* status = std::get_if<ServerStatus>(&message)) {
    status->dropped_frames = queue_.dropped_frames();
    status->queue_delay_ms = static_cast<double>(flow_.queue_delay_ns()) / kNsPerMs;
  }
  guarded([&] { queue_control(std::move(message)); });
}

void Session::queue_control(ServerMessage message) {
  if (!queue_.push_control(std::move(message)))
    return close(
        CloseCode::TryLater,
        fmt::format("{} control messages are waiting: this client reads too slowly.", kMaxQueuedControl));
  pump();
}

void Session::deliver_strands(const EncodedFramePtr& frame) {
  if (state_ != State::Joined || frame->header.stream_id != strand_class_) return;
  guarded([&] {
    const int64_t time_ns = now_ns();
    const SendQueue::Offer offer = queue_.offer_strands(frame);
    if (offer == SendQueue::Offer::LostChain) {
      flow_.on_chain_loss(time_ns);
      adapt(time_ns);
    }
    if (offer == SendQueue::Offer::Queued) finish_mode_switch();
    account_drops();
    pump();
  });
}

void Session::deliver_picture(PictureClass picture_class, const PicturePtr& picture) {
  // The keyframe of the strands that follow needs an empty pipe.
  if (!watches(picture_class) || changes_to(StreamMode::Strands)) return;
  guarded([&] {
    const int64_t time_ns = now_ns();
    const uint64_t dropped = queue_.dropped_frames();
    const SendQueue::Offer offer = queue_.offer_picture(picture);
    if (offer == SendQueue::Offer::Queued && changes_to(StreamMode::Frames)) {
      finish_mode_switch();
    } else if (queue_.dropped_frames() != dropped) {
      flow_.on_chain_loss(time_ns);
      adapt_pictures(time_ns);
    }
    account_drops();
    pump();
    ask_for_keyframe(time_ns);
  });
}

void Session::account_drops() {
  context_.count(&NetCounters::frames_dropped,
                 queue_.dropped_frames() - std::exchange(counted_drops_, queue_.dropped_frames()));
  context_.count(&NetCounters::chain_losses,
                 queue_.chain_losses() - std::exchange(counted_losses_, queue_.chain_losses()));
}

void Session::ask_for_keyframe(int64_t time_ns) {
  // The first picture of a change replaces what waits; other first frames need an empty pipe.
  const bool is_changing = changes_to(StreamMode::Frames) && queue_.awaits_picture();
  const bool needs_picture = is_changing || (queue_.needs_picture() && !changes_to(StreamMode::Strands));
  if (state_ != State::Joined || !(needs_picture || queue_.needs_keyframe())) return;
  if (!is_changing && !flow_.may_start(time_ns)) return;
  const int64_t interval_ns = context_.config.limits.keyframe_interval_ms * kNsPerMs;
  if (keyframe_asked_ns_ != 0 && time_ns - keyframe_asked_ns_ < interval_ns) return;
  keyframe_asked_ns_ = time_ns;
  context_.count(&NetCounters::keyframe_requests);
  if (needs_picture)
    context_.handler.on_picture_request(id_, is_changing ? next_mode_->picture_class : picture_class_);
  else
    context_.handler.on_keyframe_request(id_, strand_class_);
}

void Session::on_ack(const FrameAck& ack, int64_t time_ns) {
  flow_.on_ack(ack.stream_id, ack.sequence, time_ns);
  adapt(time_ns);
  ask_for_keyframe(time_ns);
  pump();
}

std::string Session::describe_link(int64_t time_ns) const {
  return fmt::format("link {:.2f} Mbit/s, {:.0f} ms of data on its way",
                     flow_.capacity_bytes_per_s(time_ns) * 8e-6,
                     static_cast<double>(flow_.queue_delay_ns()) / kNsPerMs);
}

/// Moves to another step of the ladder of pictures when the link says so.
void Session::adapt_pictures(int64_t time_ns) {
  if (state_ != State::Joined || mode_ != StreamMode::Frames || next_mode_ || !flow_.expects_acks()) return;
  const double present = context_.picture_cost(picture_class_);
  if (present <= 0.0 || picture_costs_.empty()) return;
  std::vector<double> costs;
  for (const double cost : picture_costs_) costs.push_back(present * cost / picture_costs_[picture_step_]);
  const double cap = context_.config.limits.viewer_bytes_per_s;
  const size_t chosen = flow_.choose_class(picture_step_, costs, cap, time_ns);
  if (chosen == picture_step_) return;
  const char* why = chosen < picture_step_ ? "the link has room" : "the link or this viewer is too slow";
  if (!context_.handler.on_picture_step(id_, chosen, fmt::format("{}: {}", why, describe_link(time_ns))))
    return;
  picture_step_ = chosen;
  context_.forget_picture_load(picture_class_);
  context_.count(&NetCounters::class_changes);
}

/// Moves to another strand class when the link says so.
void Session::adapt(int64_t time_ns) {
  if (mode_ == StreamMode::Frames) return adapt_pictures(time_ns);
  if (state_ != State::Joined || mode_ != StreamMode::Strands || !flow_.expects_acks()) return;
  const std::vector<double> costs = context_.strand_costs();
  if (costs.empty()) return;
  const double cap = context_.config.limits.viewer_bytes_per_s;
  const size_t chosen = flow_.choose_class(strand_class_, costs, cap, time_ns);
  if (chosen == strand_class_) return;
  const bool is_better = chosen < strand_class_;
  change_strand_class(chosen);
  announce_quality(fmt::format("{}: {}; {}",
                               is_better ? "the link has room" : "the link or this viewer is too slow",
                               to_string(context_.strand_classes[strand_class_]), describe_link(time_ns)));
  ask_for_keyframe(time_ns);
}

void Session::change_strand_class(size_t chosen) {
  strand_class_ = static_cast<uint16_t>(chosen);
  context_.count(&NetCounters::class_changes);
  queue_.restart_strands();
  context_.handler.on_strand_class(id_, strand_class_);
}

void Session::announce_quality(const std::string& reason) {
  log_info("net", "session {}: {}", id_, reason);
  const StrandClass& now = context_.strand_classes[strand_class_];
  queue_control(StreamQuality{strand_class_, now.rate_divisor, now.strand_share, now.bound_m, reason});
}

void Session::follow_strand_classes(const std::string& reason) {
  const bool is_coming = next_mode_ && next_mode_->change.mode == StreamMode::Strands;
  const bool is_concerned = mode_ == StreamMode::Strands || is_coming;
  if (state_ != State::Joined || !is_concerned || hello_.role == Role::Source) return;
  guarded([&] {
    const size_t last = context_.strand_classes.size() - 1;
    if (strand_class_ > last) change_strand_class(last);
    announce_quality(fmt::format("{}: {}", reason, to_string(context_.strand_classes[strand_class_])));
    ask_for_keyframe(now_ns());
  });
}

/// Measures the bare round trip, and shows whether a viewer still reads.
void Session::probe(int64_t time_ns) {
  if (is_probe_under_way_ || is_close_started_ || time_ns - probe_sent_ns_ < kProbeIntervalNs) return;
  is_probe_under_way_ = true;
  probe_sent_ns_ = time_ns;
  socket_.async_ping({}, [self = shared_from_this()](const beast::error_code&) {});
}

void Session::on_control_frame(websocket::frame_type kind) {
  received_ns_ = now_ns();
  if (kind == websocket::frame_type::pong && std::exchange(is_probe_under_way_, false))
    flow_.on_round_trip(received_ns_ - probe_sent_ns_, received_ns_);
}

/// A write does not get on; or something waits for an answer and nothing at all comes; or other things come,
/// but never an acknowledgement.
bool Session::is_stalled(int64_t time_ns) const {
  const NetLimits& limits = context_.config.limits;
  const auto is_past = [&](int64_t since_ns, int64_t limit_ms) {
    return time_ns - since_ns >= limit_ms * kNsPerMs;
  };
  if (is_writing_ && is_past(write_since_ns_, limits.stalled_ms)) return true;
  const int64_t oldest_ns = flow_.oldest_sent_ns();
  if (oldest_ns != 0 && is_past(std::max(oldest_ns, received_ns_), limits.stalled_ms)) return true;
  if (oldest_ns != 0 && is_past(oldest_ns, limits.unused_ms)) return true;
  return is_probe_under_way_ && is_past(std::max(probe_sent_ns_, received_ns_), limits.stalled_ms);
}

void Session::pump() {
  if (is_writing_ || is_close_started_ || state_ == State::Closed || state_ == State::Handshake) return;
  const bool is_held = !flow_.may_send(now_ns());
  std::optional<SendQueue::Item> item =
      queue_.take_next(is_held ? SendQueue::Media::Held : SendQueue::Media::Allowed);
  if (!item) {
    if (state_ == State::Closing) start_close();
    return;
  }
  if (auto* message = std::get_if<ServerMessage>(&*item)) {
    // Stamped as late as possible, so that the time in the queue does not blur the client's clock.
    if (auto* pong = std::get_if<Pong>(message)) pong->server_send_ns = now_ns();
    control_bytes_ = encode(*message);
    unwritten_ = control_bytes_;
  } else {
    media_ = std::get<EncodedFramePtr>(std::move(*item));
    unwritten_ = media_->message;
    flow_.on_sent(media_->header, media_->message.size(), now_ns());
  }
  is_writing_ = true;
  write_chunk();
}

void Session::write_chunk() {
  write_since_ns_ = now_ns();
  const size_t byte_count = std::min(unwritten_.size(), kWriteChunkBytes);
  const bool is_last = byte_count == unwritten_.size();
  socket_.async_write_some(is_last, asio::buffer(unwritten_.data(), byte_count),
                           [self = shared_from_this()](const beast::error_code& error, size_t written_count) {
                             self->guarded([&] { self->on_written(error, written_count); });
                           });
}

void Session::on_written(const beast::error_code& error, size_t byte_count) {
  if (state_ == State::Closed) return;
  if (error) return finish();
  context_.count(&NetCounters::bytes_sent, byte_count);
  sent_bytes_ += byte_count;
  unwritten_ = unwritten_.subspan(byte_count);
  if (!unwritten_.empty()) return write_chunk();
  is_writing_ = false;
  if (media_ != nullptr) {
    media_ = nullptr;
    queue_.written();
    context_.count(&NetCounters::frames_sent);
  }
  ask_for_keyframe(now_ns());
  pump();
}

void Session::close(CloseCode code, const std::string& reason) {
  if (state_ == State::Closing || state_ == State::Closed) return;
  if (state_ == State::Handshake) return abort();
  leave();
  state_ = State::Closing;
  state_since_ns_ = now_ns();
  close_code_ = code;
  context_.update_session_counts();
  queue_.clear();
  (void)queue_.push_control(Goodbye{reason.substr(0, kMaxReasonCharacters)});  // cannot be full: just cleared
  pump();
}

void Session::start_close() {
  is_close_started_ = true;
  socket_.async_close(websocket::close_reason(static_cast<uint16_t>(close_code_)),
                      [self = shared_from_this()](const beast::error_code&) { self->finish(); });
}

void Session::check_deadlines(int64_t time_ns) {
  const NetLimits& limits = context_.config.limits;
  const int64_t in_state_ms = (time_ns - state_since_ns_) / kNsPerMs;
  if (state_ == State::Closing) {
    if (in_state_ms >= limits.close_ms) abort();
    return;
  }
  if (state_ == State::AwaitHello && in_state_ms >= limits.handshake_ms) {
    context_.count(&NetCounters::timeouts);
    return close(CloseCode::Policy, fmt::format("No Hello within {} ms.", limits.handshake_ms));
  }
  if (is_stalled(time_ns)) {
    context_.count(&NetCounters::stalled);
    log_warn("net", "session {} from {}: takes nothing for {} ms, dropped", id_, peer_.address,
             limits.stalled_ms);
    return abort();
  }
  if (state_ != State::Joined) return;
  guarded([&] {
    if (hello_.role != Role::Source) probe(time_ns);
    adapt(time_ns);
    report_link(time_ns);
    ask_for_keyframe(time_ns);
    pump();
  });
}

void Session::abort() {
  finish();
}

void Session::leave() {
  if (!std::exchange(has_joined_, false)) return;
  log_info("net", "session {} left", id_);
  context_.handler.on_left(id_);
}

void Session::finish() {
  if (state_ == State::Closed) return;
  state_ = State::Closed;
  queue_.clear();
  socket_.next_layer().close();
  context_.sessions.erase(id_);
  context_.update_session_counts();
  try {
    leave();
  } catch (const std::exception& exception) {
    log_error("net", "session {} leaving: {}", id_, exception.what());
  }
}

}  // namespace strandcast::net
