#include "server/net/connection_private.h"

#include <string_view>
#include <utility>

#include "common/base/log.h"
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

bool offers_protocol(beast::string_view header) {
  for (const auto& token : http::token_list(header))
    if (view(token) == kWebSocketProtocol) return true;
  return false;
}

}  // namespace

Connection::Connection(Context& context, tcp::socket socket) : context_(context), stream_(std::move(socket)) {
  beast::error_code error;
  const tcp::endpoint peer = stream_.socket().remote_endpoint(error);
  const asio::ip::address local = plain_address(stream_.socket().local_endpoint(error).address());
  peer_address_ = plain_address(peer.address()).to_string();
  local_address_ = local.to_string();
  is_loopback_ = local.is_loopback();
  stream_.socket().set_option(tcp::no_delay(true), error);
}

void Connection::start() {
  parser_.emplace();
  parser_->header_limit(kMaxHttpHeaderBytes);
  parser_->body_limit(0);
  stream_.expires_after(std::chrono::milliseconds(context_.config.limits.handshake_ms));
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](const beast::error_code& error, size_t) {
                     try {
                       self->on_request(error);
                     } catch (const std::exception& exception) {
                       log_error("net", "connection from {}: {}", self->peer_address_, exception.what());
                       self->finish();
                     }
                   });
}

void Connection::on_request(const beast::error_code& error) {
  if (is_finished_) return;
  if (error == beast::error::timeout) {
    context_.count(&NetCounters::timeouts);
    return finish();
  }
  if (error == http::error::end_of_stream || error == asio::error::connection_reset ||
      error == http::error::partial_message || error == asio::error::operation_aborted)
    return finish();
  if (error) {
    context_.count(&NetCounters::refused_http);
    return respond(http::status::bad_request, "Bad request: " + error.message() + "\n");
  }
  const auto& request = parser_->get();
  const std::string_view host = view(request[http::field::host]);
  if (!is_host_allowed(host, local_address_, is_loopback_, context_.config.allowed_hosts)) {
    context_.count(&NetCounters::refused_http);
    return respond(http::status::forbidden, "This Host is not served here (--allow-host adds one).\n");
  }
  if (websocket::is_upgrade(request) && view(request.target()) == kWebSocketPath) {
    if (!is_origin_allowed(view(request[http::field::origin]), host)) {
      context_.count(&NetCounters::refused_http);
      return respond(http::status::forbidden, "Pages of another origin may not connect.\n");
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
  const bool is_free = is_loopback_ && context_.config.loopback_trust == LoopbackTrust::Trusted;
  if (!is_free &&
      (!given.starts_with(kScheme) || !find_grant(context_.config.tokens, given.substr(kScheme.size())))) {
    context_.count(&NetCounters::refused_token);
    response_.set(http::field::www_authenticate, "Bearer");
    return respond(http::status::unauthorized, "/metrics needs a token here (Authorization: Bearer).\n");
  }
  respond(http::status::ok, format_metrics(context_.counters_now()) + context_.handler.metrics(),
          "text/plain; version=0.0.4");
}

void Connection::upgrade() {
  const SessionId id = context_.next_session++;
  const bool has_room = context_.has_room(peer_address_);
  auto session = std::make_shared<Session>(context_, id, std::move(stream_), peer_address_);
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
  stream_.expires_after(std::chrono::milliseconds(context_.config.limits.handshake_ms));
  http::async_write(stream_, response_, [self = shared_from_this()](const beast::error_code&, size_t) {
    beast::error_code ignored;
    self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    self->finish();
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
