#include "server/net/net_server.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <future>
#include <thread>
#include <utility>

#include "common/base/check.h"
#include "common/base/profile.h"
#include "common/base/thread_name.h"
#include "common/log/log.h"
#include "server/net/access.h"
#include "server/net/connection_private.h"
#include "server/net/session_private.h"

namespace strandcast {
namespace net {
namespace {

constexpr auto kSweepInterval = std::chrono::milliseconds(50);
/// Pause after a failed accept (no file descriptors left): the others are served meanwhile.
constexpr auto kAcceptPause = std::chrono::milliseconds(100);
constexpr int64_t kAcceptTellNs = 10'000'000'000;
constexpr int kListenBacklog = 128;

std::string own_host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? std::string(name.data()) : std::string();
}

}  // namespace
}  // namespace net

using net::beast::error_code;

struct NetServer::State {
  State(const NetConfig& config, const std::vector<NetHead>& heads)
      : context(config, heads), acceptor(context.io), sweep_timer(context.io), accept_timer(context.io) {}

  Status open();
  Status claim();
  Result<net::tcp::endpoint> find_place();
  void open_port(const net::tcp::endpoint& place, error_code& error);
  void accept();
  void on_accept(const error_code& error, net::tcp::socket socket);
  void sweep();
  void begin_stop();
  void end_if_done(int64_t time_ns);
  void run();
  template <class Work>
  void for_all(Work work);
  template <class Work>
  void for_head(size_t head, Work work);
  template <class Work>
  void post_to(SessionId session, Work work);

  net::Context context;
  net::tcp::acceptor acceptor;
  net::asio::steady_timer sweep_timer;
  net::asio::steady_timer accept_timer;
  int64_t accept_told_ns = 0;
  uint16_t port = 0;
  bool is_trusted = false;  // who comes by loopback, without a token
  int64_t stop_deadline_ns = 0;
  std::atomic<bool> has_stopped{false};
  std::thread thread;
};

/// Where the server is to listen, or does already.
Result<net::tcp::endpoint> NetServer::State::find_place() {
  const NetConfig& config = context.config;
  error_code error;
  if (config.socket >= 0) {
    net::tcp::endpoint place;
    auto size = static_cast<socklen_t>(place.capacity());
    if (getsockname(config.socket, place.data(), &size) != 0)
      error = error_code(errno, net::asio::error::get_system_category());
    if (!error) place.resize(size);
    if (!error) acceptor.assign(place.protocol(), config.socket, error);
    if (!error) return place;
    return make_error(ErrorCode::BadInput, "the socket that was passed to the server cannot be used: {}",
                      error.message());
  }
  const std::string numeric = config.address == "localhost" ? "127.0.0.1" : config.address;
  const auto address = net::asio::ip::make_address(numeric, error);
  if (!error) return net::tcp::endpoint(address, config.port);
  return make_error(ErrorCode::BadInput,
                    "'{}' is no numeric address to listen on (such as 127.0.0.1 or 0.0.0.0)", config.address);
}

/// The port, where nobody else has it and who may come in is known by a token or by loopback.
Status NetServer::State::claim() {
  const NetConfig& config = context.config;
  ASSIGN_OR_RETURN(const net::tcp::endpoint place, find_place());
  const std::string address = place.address().to_string();
  is_trusted = place.address().is_loopback() && config.loopback_trust == LoopbackTrust::Trusted &&
               config.trusted_proxies.empty();
  RETURN_IF_ERROR(check_listening(is_trusted, address, config.tokens));
  error_code error;
  if (config.socket < 0) open_port(place, error);
  if (error == net::asio::error::address_in_use)
    return make_error(ErrorCode::Unavailable,
                      "port {} on {} is in use by another program (--port 0 takes a free one)", place.port(),
                      address);
  if (error)
    return make_error(ErrorCode::Unavailable, "cannot listen on {} port {}: {}", address, place.port(),
                      error.message());
  port = acceptor.local_endpoint(error).port();
  return {};
}

Status NetServer::State::open() {
  const NetConfig& config = context.config;
  RETURN_IF_ERROR(claim());
  if (config.tls) {
    ASSIGN_OR_RETURN(context.tls, make_server_tls(*config.tls));
  } else if (!is_trusted) {
    log_warn("net",
             "listening on {} without TLS: whoever is on the way can read tokens and frames (--tls-cert)",
             config.address);
  }
  return {};
}

void NetServer::State::open_port(const net::tcp::endpoint& place, error_code& error) {
  acceptor.open(place.protocol(), error);
  if (!error) acceptor.set_option(net::asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(place, error);
  if (!error) acceptor.listen(net::kListenBacklog, error);
}

void NetServer::State::accept() {
  acceptor.async_accept(
      [this](const error_code& error, net::tcp::socket socket) { on_accept(error, std::move(socket)); });
}

void NetServer::State::on_accept(const error_code& error, net::tcp::socket socket) {
  if (error == net::asio::error::operation_aborted || context.is_stopping) return;
  if (error) {
    context.count(&NetCounters::accept_errors);
    // It is tried again at once: one line in a while is enough.
    if (const int64_t time_ns = now_ns();
        time_ns - accept_told_ns > net::kAcceptTellNs || accept_told_ns == 0) {
      accept_told_ns = time_ns;
      log_warn("net", "cannot accept a connection: {}", error.message());
    }
    accept_timer.expires_after(net::kAcceptPause);
    accept_timer.async_wait([this](const error_code& wait_error) {
      if (!wait_error) accept();
    });
    return;
  }
  context.count(&NetCounters::connections);
  auto connection = std::make_shared<net::Connection>(context, std::move(socket));
  if (connection->is_welcome()) {
    context.connections.insert(connection);
    connection->start();
  }
  accept();
}

void NetServer::State::sweep() {
  sweep_timer.expires_after(net::kSweepInterval);
  sweep_timer.async_wait([this](const error_code& error) {
    if (error) return;
    const int64_t time_ns = now_ns();
    const auto connections = context.connections;  // a deadline may remove one
    for (const auto& connection : connections) connection->check_deadline(time_ns);
    for_all([time_ns](net::Session& session) { session.check_deadlines(time_ns); });
    if (context.is_stopping) end_if_done(time_ns);
    sweep();
  });
}

void NetServer::State::begin_stop() {
  if (std::exchange(context.is_stopping, true)) return;
  error_code ignored;
  acceptor.close(ignored);
  stop_deadline_ns = now_ns() + context.config.limits.close_ms * 1'000'000;
  const auto connections = context.connections;
  for (const auto& connection : connections) connection->abort();
  for_all([](net::Session& session) { session.close(CloseCode::GoingAway, "The server is stopping."); });
}

void NetServer::State::end_if_done(int64_t time_ns) {
  if (!context.sessions.empty() && time_ns < stop_deadline_ns) return;
  for_all([](net::Session& session) { session.abort(); });
  context.io.stop();
}

void NetServer::State::run() {
  name_thread("network");
  while (!context.io.stopped()) {
    try {
      context.io.run();
    } catch (const std::exception& exception) {
      log_error("net", "{}", exception.what());
    }
  }
}

/// Does the work for all sessions, over a copy, because it may end some.
template <class Work>
void NetServer::State::for_all(Work work) {
  const auto sessions = context.sessions;
  for (const auto& [id, session] : sessions) work(*session);
}

/// Those who have joined for this head.
template <class Work>
void NetServer::State::for_head(size_t head, Work work) {
  for_all([&](net::Session& session) {
    if (session.is_about(head)) work(session);
  });
}

/// Nothing when the session is gone by then.
template <class Work>
void NetServer::State::post_to(SessionId session, Work work) {
  net::asio::post(context.io, [this, session, work = std::move(work)] {
    const auto found = context.sessions.find(session);
    // A copy of the pointer: a full queue ends the session under our feet.
    if (found != context.sessions.end()) work(*std::shared_ptr(found->second));
  });
}

NetServer::NetServer(std::unique_ptr<State> state) : state_(std::move(state)) {}

NetServer::~NetServer() {
  stop();
}

Status NetServer::check_port(const NetConfig& config) {
  if (config.socket >= 0) return {};
  return State(config, {}).claim();
}

Result<std::unique_ptr<NetServer>> NetServer::listen(const NetConfig& config, std::vector<NetHead> heads) {
  CHECK(!heads.empty());
  NetConfig complete = config;
  complete.allowed_hosts.push_back(net::own_host_name());
  auto state = std::make_unique<State>(complete, heads);
  RETURN_IF_ERROR(state->open());
  return std::unique_ptr<NetServer>(new NetServer(std::move(state)));
}

Result<std::unique_ptr<NetServer>> NetServer::listen(const NetConfig& config, NetHandler& handler) {
  return listen(config, std::vector<NetHead>{{.name = {}, .handler = &handler}});
}

void NetServer::start() {
  State* state = state_.get();
  CHECK(!state->thread.joinable());
  state->accept();
  state->sweep();
  state->thread = std::thread([state] { state->run(); });
}

Status NetServer::reload_tls() {
  if (!state_->context.config.tls) return {};
  ASSIGN_OR_RETURN(TlsContextPtr fresh, make_server_tls(*state_->context.config.tls));
  net::asio::post(state_->context.io, [state = state_.get(), fresh = std::move(fresh)]() mutable {
    state->context.tls = std::move(fresh);
  });
  return {};
}

Status NetServer::set_tokens(std::vector<AccessToken> tokens) {
  if (tokens.empty() != state_->context.config.tokens.empty())
    return make_error(ErrorCode::BadInput,
                      "a server that began with tokens cannot go on without, nor the reverse");
  net::asio::post(state_->context.io, [state = state_.get(), tokens = std::move(tokens)]() mutable {
    state->context.tokens = std::move(tokens);
    state->for_all([](net::Session& session) { session.check_stay(); });
  });
  return {};
}

uint16_t NetServer::port() const {
  return state_->port;
}

void NetServer::name_head(size_t head, std::string name) {
  net::asio::post(state_->context.io, [state = state_.get(), head, name = std::move(name)]() mutable {
    state->context.heads[head].name = std::move(name);
  });
}

void NetServer::publish_strands(EncodedFramePtr frame, size_t head) {
  net::asio::post(state_->context.io, [state = state_.get(), frame = std::move(frame), head] {
    state->context.heads[head].strands.note_frame(frame->header, frame->message.size(), now_ns());
    state->for_head(head, [&](net::Session& session) { session.deliver_strands(frame); });
  });
}

void NetServer::publish_picture(PictureClass picture_class, PicturePtr picture, size_t head) {
  net::asio::post(state_->context.io, [state = state_.get(), picture_class, picture = std::move(picture),
                                       head] {
    state->context.heads[head].pictures.note_picture(picture_class, picture->message_bytes(), now_ns());
    state->for_head(head, [&](net::Session& session) { session.deliver_picture(picture_class, picture); });
  });
}

void NetServer::set_strand_classes(std::vector<StrandClass> classes, std::string reason,
                                   std::function<void()> then, size_t head) {
  CHECK(!classes.empty());
  net::asio::post(state_->context.io, [state = state_.get(), classes = std::move(classes),
                                       reason = std::move(reason), then = std::move(then), head] {
    net::Head& changed = state->context.heads[head];
    // What was measured of the old ones is forgotten.
    changed.strands = StrandCosts(classes, changed.strands.codecs());
    state->for_head(head, [&](net::Session& session) { session.follow_strand_classes(reason); });
    then();
  });
}

void NetServer::renew_asset(EncodedFramePtr asset, std::function<void()> then, size_t head) {
  net::asio::post(state_->context.io,
                  [state = state_.get(), asset = std::move(asset), then = std::move(then), head] {
                    state->for_head(head, [&](net::Session& session) { session.renew_asset(asset); });
                    then();
                  });
}

void NetServer::send_away(std::string reason, size_t head) {
  net::asio::post(state_->context.io, [state = state_.get(), reason = std::move(reason), head] {
    state->for_head(head, [&](net::Session& session) { session.close(CloseCode::GoingAway, reason); });
  });
}

void NetServer::begin_anew(std::vector<StrandClass> classes, std::vector<StrandByteModel> codecs,
                           std::string reason, std::function<void()> then, size_t head) {
  CHECK(!classes.empty() && !codecs.empty());
  net::asio::post(
      state_->context.io, [state = state_.get(), classes = std::move(classes), codecs = std::move(codecs),
                           reason = std::move(reason), then = std::move(then), head] {
        state->for_head(head, [&](net::Session& session) { session.close(CloseCode::GoingAway, reason); });
        state->context.heads[head].strands = StrandCosts(classes, codecs);
        then();
      });
}

void NetServer::set_clock_offset(int64_t offset_ns) {
  net::asio::post(state_->context.io,
                  [state = state_.get(), offset_ns] { state->context.clock_offset_ns = offset_ns; });
}

void NetServer::broadcast(ServerMessage message, size_t head) {
  tell_each([message = std::move(message)](SessionId) { return message; }, head);
}

void NetServer::tell_each(std::function<ServerMessage(SessionId)> of, size_t head) {
  net::asio::post(state_->context.io, [state = state_.get(), of = std::move(of), head] {
    const auto sessions = state->context.sessions;
    for (const auto& [id, session] : sessions)
      if (session->is_about(head)) session->send(of(id));
  });
}

void NetServer::send_to_class(PictureClass picture_class, ServerMessage message, size_t head) {
  net::asio::post(state_->context.io,
                  [state = state_.get(), picture_class, message = std::move(message), head] {
                    state->for_head(head, [&](net::Session& session) {
                      if (session.watches(picture_class)) session.send(message);
                    });
                  });
}

void NetServer::send(SessionId session, ServerMessage message) {
  state_->post_to(session, [message = std::move(message)](net::Session& one) { one.send(message); });
}

void NetServer::send_chain(SessionId session, std::vector<EncodedFramePtr> chain) {
  state_->post_to(session, [chain = std::move(chain)](net::Session& one) { one.deliver_chain(chain); });
}

void NetServer::close(SessionId session, CloseCode code, std::string reason) {
  state_->post_to(session,
                  [code, reason = std::move(reason)](net::Session& one) { one.close(code, reason); });
}

NetCounters NetServer::counters() const {
  return state_->context.counters_now();
}

void NetServer::stop() {
  if (state_->has_stopped.exchange(true) || !state_->thread.joinable()) return;
  net::asio::post(state_->context.io, [state = state_.get()] { state->begin_stop(); });
  state_->thread.join();
  state_->context.sessions.clear();
  state_->context.connections.clear();
}

}  // namespace strandcast
