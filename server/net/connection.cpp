#include "server/net/connection_private.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/base/profile.h"
#include "common/log/log.h"
#include "server/net/access.h"
#include "server/net/metrics.h"
#include "server/net/session_private.h"

namespace strandcast::net {
namespace {

constexpr uint32_t kMaxHttpHeaderBytes = 8u << 10;
constexpr const char* kWebSocketPath = "/v1";

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

/// An IPv4 peer of a listener on "::" counts as the IPv4 address it is.
asio::ip::address plain_address(const asio::ip::address& address) {
  if (address.is_v6() && address.to_v6().is_v4_mapped())
    return asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6());
  return address;
}

/// A network of 64 bits is as easily had as one address of IPv4.
std::string key_of(const asio::ip::address& address) {
  if (!address.is_v6()) return address.to_string();
  auto bytes = address.to_v6().to_bytes();
  std::fill(bytes.begin() + bytes.size() / 2, bytes.end(), uint8_t{0});
  return asio::ip::make_address_v6(bytes).to_string() + "/64";
}

bool offers_protocol(beast::string_view header) {
  for (const auto& token : http::token_list(header))
    if (view(token) == kWebSocketProtocol) return true;
  return false;
}

}  // namespace

Connection::Connection(Context& context, tcp::socket socket) : context_(context), stream_(std::move(socket)) {
  beast::error_code error;
  const asio::ip::address peer = plain_address(stream_.socket().remote_endpoint(error).address());
  const asio::ip::address local = plain_address(stream_.socket().local_endpoint(error).address());
  local_address_ = local.to_string();
  is_loopback_ = local.is_loopback();
  peer_.address = peer.to_string();
  peer_.key = key_of(peer);
  peer_.is_trusted = is_loopback_ && context.config.loopback_trust == LoopbackTrust::Trusted;
  peer_.accepted_ns = now_ns();
  stream_.socket().set_option(tcp::no_delay(true), error);
}

template <class Work>
void Connection::guarded(Work&& work) {
  try {
    work();
  } catch (const std::exception& exception) {
    log_error("net", "connection from {}: {}", peer_.address, exception.what());
    finish();
  }
}

void Connection::start() {
  if (context_.tls == nullptr) return read_request();
  stream_.async_wait_readable([self = shared_from_this()](const beast::error_code& error) {
    if (error || self->is_finished_) return self->finish();
    self->guarded([&] { self->begin(); });
  });
}

/// The first byte tells TLS from HTTP.
void Connection::begin() {
  if (!stream_.is_tls_hello()) return read_request();
  stream_.async_accept_tls(context_.tls, [self = shared_from_this()](const beast::error_code& error) {
    self->guarded([&] { self->on_tls(error); });
  });
}

void Connection::on_tls(const beast::error_code& error) {
  if (is_finished_) return;
  if (!error) return read_request();
  context_.count(&NetCounters::refused_tls);
  log_debug("net", "connection from {}: no TLS: {}", peer_.address, error.message());
  finish();
}

void Connection::read_request() {
  parser_.emplace();
  parser_->header_limit(kMaxHttpHeaderBytes);
  parser_->body_limit(0);
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](const beast::error_code& error, size_t size) {
                     // Beast limits the first line and the fields each by itself.
                     const bool is_long = !error && size > kMaxHttpHeaderBytes;
                     const beast::error_code too_long = http::error::header_limit;
                     self->guarded([&] { self->on_request(is_long ? too_long : error); });
                   });
}

void Connection::check_deadline(int64_t time_ns) {
  if (is_finished_ || time_ns - peer_.accepted_ns < context_.config.limits.handshake_ms * kNsPerMs) return;
  context_.count(&NetCounters::timeouts);
  finish();
}

void Connection::on_request(const beast::error_code& error) {
  if (is_finished_) return;
  if (error == http::error::end_of_stream || error == asio::error::connection_reset ||
      error == http::error::partial_message || error == asio::error::operation_aborted)
    return finish();
  if (error) {
    context_.count(&NetCounters::refused_http);
    return respond(http::status::bad_request, "Bad request: " + error.message() + "\n");
  }
  const bool is_plain_allowed =
      context_.tls == nullptr ||
      (peer_.is_trusted && context_.config.plain_access == PlainAccess::TrustedLoopback);
  if (!stream_.is_tls() && !is_plain_allowed) {
    context_.count(&NetCounters::refused_tls);
    response_.set(http::field::upgrade, "TLS/1.2");
    response_.set(http::field::connection, "Upgrade");
    return respond(http::status::upgrade_required, "This server speaks TLS only: use wss:// or --tls.\n");
  }
  const auto& request = parser_->get();
  const std::string_view host = view(request[http::field::host]);
  if (!is_host_allowed(host, local_address_, is_loopback_, context_.config.allowed_hosts)) {
    context_.count(&NetCounters::refused_http);
    return respond(http::status::forbidden, "This Host is not served here (--allow-host adds one).\n");
  }
  if (websocket::is_upgrade(request) && view(request.target()) == kWebSocketPath) {
    if (!is_origin_allowed(view(request[http::field::origin]), host, context_.config.allowed_origins)) {
      context_.count(&NetCounters::refused_http);
      return respond(http::status::forbidden,
                     "Pages of another origin may not connect (--allow-origin adds one).\n");
    }
    if (!offers_protocol(request[http::field::sec_websocket_protocol])) {
      context_.count(&NetCounters::refused_http);
      return respond(http::status::bad_request,
                     fmt::format("The WebSocket subprotocol must be {}.\n", kWebSocketProtocol));
    }
    return upgrade();
  }
  if (request.method() == http::verb::get && view(request.target()) == "/healthz")
    return respond(http::status::ok, "ok\n");
  if (request.method() == http::verb::get && view(request.target()) == "/metrics") return answer_metrics();
  context_.count(&NetCounters::refused_http);
  respond(http::status::not_found, "Not found. Here are: /healthz /metrics /v1 (WebSocket).\n");
}

/// What the server does is for those who may watch it: beyond trusted loopback any role's token is needed.
void Connection::answer_metrics() {
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view given = view(parser_->get()[http::field::authorization]);
  if (!peer_.is_trusted &&
      (!given.starts_with(kScheme) || !find_grant(context_.config.tokens, given.substr(kScheme.size())))) {
    context_.count(&NetCounters::refused_token);
    if (!given.empty()) context_.guard.on_wrong_token(peer_.key, now_ns());
    response_.set(http::field::www_authenticate, "Bearer");
    return respond(http::status::unauthorized, "/metrics needs a token here (Authorization: Bearer).\n");
  }
  respond(http::status::ok, format_metrics(context_.counters_now()) + context_.handler.metrics(),
          "text/plain; version=0.0.4");
}

void Connection::upgrade() {
  const SessionId id = context_.next_session++;
  const bool has_room = context_.has_room(peer_.key);
  auto session = std::make_shared<Session>(context_, id, std::move(stream_), peer_);
  context_.sessions.emplace(id, session);
  context_.update_session_counts();
  is_finished_ = true;
  context_.connections.erase(shared_from_this());
  session->start(parser_->release(), has_room);
}

void Connection::respond(http::status status, const std::string& text, const char* content_type) {
  response_.version(11);
  response_.result(status);
  response_.set(http::field::server, "strandcast");
  response_.set(http::field::content_type, content_type);
  response_.set(http::field::cache_control, "no-store");
  response_.keep_alive(false);
  response_.body() = text;
  response_.prepare_payload();
  http::async_write(stream_, response_, [self = shared_from_this()](const beast::error_code& error, size_t) {
    if (error || self->is_finished_) return self->finish();
    self->stream_.async_shut_down([self](const beast::error_code&) { self->finish(); });
  });
}

void Connection::abort() {
  finish();
}

void Connection::finish() {
  if (is_finished_) return;
  is_finished_ = true;
  stream_.close();
  context_.connections.erase(shared_from_this());
}

}  // namespace strandcast::net
