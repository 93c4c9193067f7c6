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

using Request = http::request<http::empty_body>;

bool has_body(const http::request_parser<http::empty_body>& parser) {
  return parser.get().count(http::field::transfer_encoding) > 0 || parser.content_length().value_or(0) > 0;
}

/// True when a field is there twice of which a proxy or a browser may believe the other one.
bool is_ambiguous(const Request& request) {
  const auto fields = {http::field::host, http::field::origin, http::field::authorization,
                       http::field::sec_websocket_key, http::field::sec_websocket_version};
  return std::any_of(fields.begin(), fields.end(),
                     [&](http::field field) { return request.count(field) > 1; });
}

/// The other side went away in the middle.
bool is_gone(const beast::error_code& error) {
  return error == http::error::end_of_stream || error == asio::error::connection_reset ||
         error == http::error::partial_message || error == asio::error::operation_aborted;
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

/// The header only: a body would be in memory before anybody could refuse it.
void Connection::read_request() {
  parser_.emplace();
  parser_->header_limit(kMaxHttpHeaderBytes);
  parser_->body_limit(boost::none);
  http::async_read_header(stream_, buffer_, *parser_,
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
  if (is_gone(error)) return finish();
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return refuse(http::status::request_header_fields_too_large,
                  fmt::format("The header of a request has at most {} bytes.", kMaxHttpHeaderBytes));
  if (error) return refuse(http::status::bad_request, "Bad request: " + error.message());
  const Request& request = parser_->get();
  if (has_body(*parser_))
    return refuse(http::status::payload_too_large, "Requests are served without a body only.");
  if (is_ambiguous(request))
    return refuse(http::status::bad_request, "A field is there twice that may be there once.");
  const bool is_plain_allowed =
      context_.tls == nullptr ||
      (peer_.is_trusted && context_.config.plain_access == PlainAccess::TrustedLoopback);
  if (!stream_.is_tls() && !is_plain_allowed) {
    context_.count(&NetCounters::refused_tls);
    response_.set(http::field::upgrade, "TLS/1.2");
    response_.set(http::field::connection, "Upgrade");
    return respond(http::status::upgrade_required, "This server speaks TLS only: use wss:// or --tls.\n");
  }
  if (!is_host_allowed(view(request[http::field::host]), local_address_, is_loopback_,
                       context_.config.allowed_hosts))
    return refuse(http::status::forbidden, "This Host is not served here (--allow-host adds one).");
  answer(request);
}

void Connection::answer(const Request& request) {
  const std::string_view path = view(request.target());
  if (websocket::is_upgrade(request) && path == kWebSocketPath) return answer_upgrade(request);
  const bool is_get = request.method() == http::verb::get;
  if (is_get && path == "/healthz") return respond(http::status::ok, "ok\n");
  if (is_get && path == "/metrics") return answer_metrics();
  refuse(http::status::not_found, "Not found. Here are: /healthz /metrics /v1 (WebSocket).");
}

void Connection::answer_upgrade(const Request& request) {
  if (!is_origin_allowed(view(request[http::field::origin]), view(request[http::field::host]),
                         context_.config.allowed_origins))
    return refuse(http::status::forbidden,
                  "Pages of another origin may not connect (--allow-origin adds one).");
  if (!offers_protocol(request[http::field::sec_websocket_protocol]))
    return refuse(http::status::bad_request,
                  fmt::format("The WebSocket subprotocol must be {}.", kWebSocketProtocol));
  upgrade();
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
  // A client may say Hello before it has our answer.
  const auto read_too_far = buffer_.cdata();
  stream_.put_back({static_cast<const std::byte*>(read_too_far.data()), read_too_far.size()});
  const SessionId id = context_.next_session++;
  const bool has_room = context_.has_room(peer_.key);
  auto session = std::make_shared<Session>(context_, id, std::move(stream_), peer_);
  context_.sessions.emplace(id, session);
  context_.update_session_counts();
  is_finished_ = true;
  context_.connections.erase(shared_from_this());
  session->start(parser_->release(), has_room);
}

void Connection::refuse(http::status status, const std::string& sentence) {
  context_.count(&NetCounters::refused_http);
  respond(status, sentence + "\n");
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
