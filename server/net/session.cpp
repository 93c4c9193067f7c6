#include "server/net/session_private.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "common/base/base64.h"
#include "common/base/profile.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "common/wire/early_hello.h"

namespace strandcast::net {
namespace {

/// How much waits unsent in the kernel, so that a late frame is dropped here and not queued there.
constexpr int kUnsentBytes = 128 << 10;
constexpr int64_t kProbeIntervalNs = 1'000 * kMsInNs;
/// So long after a ping that nothing answers, whoever needs the place gets it.
constexpr int64_t kDoubtedNs = 1'500 * kMsInNs;
/// Between two messages about the state to a hidden window: one a second, however unevenly they come.
constexpr int64_t kHiddenStatusIntervalNs = 950 * kMsInNs;
/// Longest sentence of ours put into a Goodbye.
constexpr size_t kMaxReasonCharacters = 500;

}  // namespace

Session::Session(Context& context, SessionId id, NetStream stream, Peer peer)
    : context_(context),
      id_(id),
      socket_(std::move(stream)),
      peer_(std::move(peer)),
      rate_(context.config.limits.messages_per_s, kMessagesAtOnceS),
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
  const auto greeting = request_[kHelloField];
  if (auto hello = from_base64({greeting.data(), greeting.size()})) early_hello_ = std::move(*hello);
  const bool is_greeted = !early_hello_.empty();
  socket_.set_option(websocket::stream_base::decorator([is_greeted](websocket::response_type& response) {
    response.set(http::field::sec_websocket_protocol, kWebSocketProtocol);
    response.set(http::field::server, "strandcast");
    if (is_greeted) response.set(kHelloField, kHelloTaken);
  }));
  socket_.read_message_max(kMaxControlBytes);
  socket_.auto_fragment(false);
  socket_.binary(true);
  socket_.control_callback(
      [this](websocket::frame_type kind, beast::string_view) { on_control_frame(kind); });
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
  if (!has_room) return close_as_full();
  if (early_hello_.empty()) return;
  context_.count(&NetCounters::messages_received);
  on_message(std::exchange(early_hello_, {}), received_ns_ = now_ns());
}

void Session::close_as_full() {
  const NetLimits& limits = context_.config.limits;
  const std::string sentence = fmt::format("The server is full: at most {} sessions and {} from one address.",
                                           limits.sessions, limits.sessions_per_address);
  context_.refuse(Refusal::Full, peer_, sentence);
  close(CloseCode::Full, sentence);
}

void Session::read() {
  // Control frames and empty fragments do not make a message; they count for its bytes.
  socket_.next_layer().limit_reading(kMaxBytesOfMessage);
  socket_.async_read(read_buffer_, [self = shared_from_this()](const beast::error_code& error, size_t) {
    self->guarded([&] { self->on_read(error); });
  });
}

std::string Session::rate_sentence() const {
  return fmt::format("More than {:.0f} messages per second.", context_.config.limits.messages_per_s);
}

/// Not while many answers wait: who floods is heard as fast as it reads.
void Session::read_on() {
  if (state_ != State::AwaitHello && state_ != State::Joined) return;
  is_reading_held_ = queue_.control_count() >= kMostUnreadAnswers;
  if (!is_reading_held_) read();
}

void Session::on_read(const beast::error_code& error) {
  if (state_ == State::Closed) return;
  if (error) {
    // Beast has answered an oversized or malformed frame with the fitting close code already.
    if (error == asio::error::message_size)
      context_.refuse(Refusal::Message, peer_, "control frames and empty fragments without end");
    else if (error == websocket::error::message_too_big || error == websocket::error::buffer_overflow ||
             error == websocket::condition::protocol_violation)
      context_.count(&NetCounters::bad_messages);
    if (error != websocket::error::closed) log_debug("net", "session {}: {}", id_, error.message());
    return finish();
  }
  if (state_ == State::Closing) return;  // the close under way drains the rest
  const auto data = read_buffer_.cdata();
  const int64_t arrival_ns = now_ns();
  if (!rate_.take(arrival_ns)) return reject(CloseCode::Policy, rate_sentence());
  context_.count(&NetCounters::messages_received);
  received_ns_ = arrival_ns;
  if (socket_.got_text())
    reject(CloseCode::BadData, "Text messages are not part of the protocol.");
  else
    on_message({static_cast<const std::byte*>(data.data()), data.size()}, arrival_ns);
  read_buffer_.consume(read_buffer_.size());
  read_on();
}

void Session::send(ServerMessage message) {
  if (state_ != State::Joined) return;
  if (auto* status = std::get_if<ServerStatus>(&message)) {
    const int64_t time_ns = now_ns();
    if (subscription_.is_hidden() && time_ns - status_sent_ns_ < kHiddenStatusIntervalNs) return;
    status_sent_ns_ = time_ns;
    status->dropped_frames = queue_.dropped_frames();
    if (subscription_.mode() != StreamMode::Frames) status->picture_motions.clear();
    status->queue_delay_ms = static_cast<double>(flow_.queue_delay_ns()) / kMsInNs;
  }
  guarded([&] {
    if (const auto* camera = std::get_if<CameraChange>(&message)) move_camera(*camera);
    queue_control(std::move(message));
  });
}

void Session::queue_control(ServerMessage message) {
  if (!queue_.push_control(std::move(message)))
    return close(
        CloseCode::TryLater,
        fmt::format("{} control messages are waiting: this client reads too slowly.", kMaxQueuedControl));
  pump();
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
  // They cost as much as messages. Beast is in the middle of a read here.
  if (!rate_.take(received_ns_) && !std::exchange(is_flooding_, true))
    asio::post(socket_.get_executor(), [self = shared_from_this()] {
      self->guarded([&] { self->reject(CloseCode::Policy, self->rate_sentence()); });
    });
  if (kind == websocket::frame_type::pong && std::exchange(is_probe_under_way_, false))
    flow_.on_round_trip(received_ns_ - probe_sent_ns_, received_ns_);
}

/// Why it has to go: a write does not get on; or something waits for an answer and nothing at all comes; or
/// other things come, but never an acknowledgement. Empty while all is well.
std::string Session::stall_reason(int64_t time_ns) const {
  const NetLimits& limits = context_.config.limits;
  const auto is_past = [&](int64_t since_ns, int64_t limit_ms) {
    return time_ns - since_ns >= limit_ms * kMsInNs;
  };
  if (is_writing_ && is_past(progress_ns_, limits.stalled_ms))
    return fmt::format("takes nothing for {} ms", limits.stalled_ms);
  const int64_t due_ns = flow_.oldest_due_ns(time_ns);
  if (due_ns != 0 && is_past(due_ns, limits.unused_ms))
    return fmt::format("acknowledges nothing for {} ms while it says other things", limits.unused_ms);
  // What is on its way holds up the answer to a probe as well.
  const int64_t heard_ns = std::max({due_ns, received_ns_, is_writing_ ? progress_ns_ : 0});
  if (due_ns != 0 && is_past(heard_ns, limits.stalled_ms))
    return fmt::format("says nothing for {} ms although an acknowledgement is due", limits.stalled_ms);
  if (is_probe_under_way_ && !subscription_.is_empty() &&
      is_past(std::max(probe_sent_ns_, heard_ns), limits.stalled_ms))
    return fmt::format("answers no ping for {} ms", limits.stalled_ms);
  return {};
}

bool Session::is_doubted(int64_t time_ns) const {
  return is_probe_under_way_ && time_ns - std::max(probe_sent_ns_, received_ns_) >= kDoubtedNs;
}

void Session::give_way() {
  context_.count(&NetCounters::stalled);
  context_.note(
      fmt::format("session {} from {} answers no ping, and its place is needed", id_, peer_.address),
      LogLevel::Warn);
  abort();
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
    if (auto* pong = std::get_if<Pong>(message)) pong->server_send_ns = now_ns() + context_.clock_offset_ns;
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
  note_progress(now_ns());
  const size_t byte_count = std::min(unwritten_.size(), kWriteChunkBytes);
  const bool is_last = byte_count == unwritten_.size();
  socket_.async_write_some(is_last, asio::buffer(unwritten_.data(), byte_count),
                           [self = shared_from_this()](const beast::error_code& error, size_t written_count) {
                             self->guarded([&] { self->on_written(error, written_count); });
                           });
}

void Session::note_progress(int64_t time_ns) {
  progress_ns_ = time_ns;
  if (media_ != nullptr) flow_.on_written(media_->header, time_ns);
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
    const bool is_keyframe = std::exchange(media_, nullptr)->header.opcode == Opcode::StrandKeyframe;
    queue_.written();
    context_.count(&NetCounters::frames_sent);
    if (is_keyframe && after_preview_) {
      is_preview_written_ = true;
      if (flow_.capacity_bytes_per_s(now_ns()) > 0.0) end_preview();
    }
  }
  ask_for_keyframe(now_ns());
  if (is_reading_held_) read_on();
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
  (void)queue_.push_control(
      Goodbye{printable(reason, kMaxReasonCharacters)});  // cannot be full: just cleared
  pump();
}

void Session::start_close() {
  is_close_started_ = true;
  socket_.async_close(websocket::close_reason(static_cast<uint16_t>(close_code_)),
                      [self = shared_from_this()](const beast::error_code&) { self->finish(); });
}

void Session::check_deadlines(int64_t time_ns) {
  const NetLimits& limits = context_.config.limits;
  const int64_t in_state_ms = (time_ns - state_since_ns_) / kMsInNs;
  if (state_ == State::Closing) {
    if (in_state_ms >= limits.close_ms) abort();
    return;
  }
  if (waiting_hello_) return guarded([&] { join(*std::exchange(waiting_hello_, std::nullopt)); });
  if (state_ == State::AwaitHello && in_state_ms >= limits.handshake_ms) {
    const std::string sentence = fmt::format("No Hello within {} ms.", limits.handshake_ms);
    context_.refuse(Refusal::Timeout, peer_, sentence);
    return close(CloseCode::Policy, sentence);
  }
  // A write ends when the kernel has room for all of it, which on a slow link takes long.
  const size_t untaken_bytes = is_writing_ ? socket_.next_layer().untaken_bytes() : 0;
  if (untaken_bytes < std::exchange(untaken_bytes_, untaken_bytes)) note_progress(time_ns);
  if (const std::string reason = stall_reason(time_ns); !reason.empty()) {
    context_.count(&NetCounters::stalled);
    context_.note(fmt::format("session {} from {}: {}, dropped", id_, peer_.address, reason), LogLevel::Warn);
    return abort();
  }
  if (state_ != State::Joined) return;
  if (token_expires_unix_s_ != 0 && unix_time_s() >= token_expires_unix_s_) return check_stay();
  guarded([&] {
    probe(time_ns);
    watch_asset(time_ns);
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
  context_.note(fmt::format("session {} left", id_));
  head().handler.on_left(id_);
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
