#include "server/net/connection_private.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "common/wire/early_hello.h"
#include "common/wire/session_path.h"
#include "server/net/access.h"
#include "server/net/metrics.h"
#include "server/net/proxy.h"
#include "server/net/session_private.h"

namespace strandcast::net {
namespace {

constexpr const char* kWebSocketPath = "/v1";
constexpr const char* kForwardedFor = "X-Forwarded-For";
/// Of what a peer wrote, in a line of the log.
constexpr size_t kMaxQuotedBytes = 100;

IpAddress to_ip(const asio::ip::address& address) {
  return address.is_v4() ? IpAddress(address.to_v4().to_bytes()) : IpAddress(address.to_v6().to_bytes());
}

bool has_body(const http::request_parser<http::empty_body>& parser) {
  return parser.get().count(http::field::transfer_encoding) > 0 || parser.content_length().value_or(0) > 0;
}

/// Returns whether a field is there twice, so that a proxy or a browser may believe the other one.
bool is_ambiguous(const http::request<http::empty_body>& request) {
  const auto fields = {http::field::host, http::field::origin, http::field::authorization,
                       http::field::sec_websocket_key, http::field::sec_websocket_version};
  return request.count(kHelloField) > 1 || std::any_of(fields.begin(), fields.end(), [&](http::field field) {
           return request.count(field) > 1;
         });
}

/// The other side went away in the middle.
bool is_gone(const beast::error_code& error) {
  return error == http::error::end_of_stream || error == asio::error::connection_reset ||
         error == http::error::partial_message || error == asio::error::operation_aborted;
}

/// RFC 6455, section 4.1: 16 bytes in base64.
bool is_websocket_key(std::string_view key) {
  constexpr size_t kLetters = 22;
  return key.size() == kLetters + 2 && key.ends_with("==") &&
         std::all_of(key.begin(), key.begin() + kLetters, [](unsigned char c) {
           return c < 128 && (std::isalnum(c) != 0 || c == '+' || c == '/');
         });
}

bool offers_protocol(beast::string_view header) {
  for (const auto& token : http::token_list(header))
    if (view(token) == kWebSocketProtocol) return true;
  return false;
}

std::string quoted(std::string_view text) {
  return fmt::format("'{}'", text.substr(0, kMaxQuotedBytes));
}

}  // namespace

Connection::Connection(Context& context, tcp::socket socket) : context_(context), stream_(std::move(socket)) {
  beast::error_code error;
  const IpAddress peer = to_ip(stream_.socket().remote_endpoint(error).address());
  const IpAddress local = to_ip(stream_.socket().local_endpoint(error).address());
  local_address_ = local.to_string();
  is_loopback_ = local.is_loopback();
  peer_.address = peer.to_string();
  peer_.key = peer.key();
  peer_.is_proxy = is_in(context.config.trusted_proxies, peer);
  peer_.is_trusted =
      is_loopback_ && context.config.loopback_trust == LoopbackTrust::Trusted && !peer_.is_proxy;
  peer_.accepted_ns = since_ns_ = now_ns();
  from_ = peer_;
  stream_.socket().set_option(tcp::no_delay(true), error);
}

bool Connection::is_welcome() {
  const bool is_counted = !peer_.is_trusted && !peer_.is_proxy;
  if (is_counted && !context_.guard.take_connection(peer_.key, peer_.accepted_ns)) {
    context_.refuse(Refusal::Rate, peer_, "connects too often");
    return false;
  }
  if (context_.make_place(peer_)) return true;
  context_.refuse(Refusal::Full, peer_, "too many connections without a Hello");
  return false;
}

void Connection::start() {
  if (peer_.is_proxy && context_.config.proxy_protocol == ProxyProtocol::Version2)
    return read_proxy_header(kProxyFixedBytes);
  begin();
}

/// Reads exactly `size` bytes, because what follows belongs to TLS or HTTP.
void Connection::read_proxy_header(size_t size) {
  const size_t old_size = proxy_header_.size();
  proxy_header_.resize(size);
  asio::async_read(stream_.socket(), asio::buffer(proxy_header_) + old_size,
                   [self = shared_from_this()](const beast::error_code& error, size_t) {
                     self->guarded([&] { self->on_proxy_header(error); });
                   });
}

void Connection::on_proxy_header(const beast::error_code& error) {
  if (is_finished_) return;
  if (error) return finish();
  const auto bytes = std::as_bytes(std::span(proxy_header_));
  const Result<size_t> size = proxy_header_bytes(bytes);
  if (!size) return drop(Refusal::Proxy, size.error().to_string());
  if (bytes.size() < *size) return read_proxy_header(*size);
  const Result<std::optional<ProxiedPeer>> proxied = parse_proxy_header(bytes);
  if (!proxied) return drop(Refusal::Proxy, proxied.error().to_string());
  if (const std::optional<ProxiedPeer>& ends = *proxied) {
    local_address_ = ends->local_address.to_string();
    is_loopback_ = ends->local_address.is_loopback();
    if (const auto why = stand_for(ends->address)) return drop(*why, "connects too often through a proxy");
    from_ = peer_;
  }
  begin();
}

/// From here on this is the connection of a proxy's client, until its next request. It is counted like one of
/// its own would have been.
std::optional<Refusal> Connection::stand_for(const IpAddress& client) {
  const std::string key = client.key();
  const bool is_proxy = is_in(context_.config.trusted_proxies, client);
  const bool has_many = !is_proxy && context_.waiting_of(key) >= kSpareConnectionsPerAddress;
  peer_.address = client.to_string();
  peer_.key = key;
  peer_.is_proxy = is_proxy;
  const bool is_counted = !is_proxy && std::exchange(counted_key_, key) != key;
  if (is_counted && !context_.guard.take_connection(key, now_ns())) return Refusal::Rate;
  return has_many ? std::optional(Refusal::Full) : std::nullopt;
}

/// The first byte tells TLS from HTTP.
void Connection::begin() {
  if (context_.tls == nullptr) return read_request();
  stream_.async_wait_readable([self = shared_from_this()](const beast::error_code& wait_error) {
    if (wait_error || self->is_finished_) return self->finish();
    self->guarded([&] {
      if (!self->stream_.is_tls_hello()) return self->read_request();
      self->stream_.async_accept_tls(self->context_.tls, [self](const beast::error_code& error) {
        self->guarded([&] { self->on_tls(error); });
      });
    });
  });
}

void Connection::on_tls(const beast::error_code& error) {
  if (is_finished_) return;
  if (!error) return read_request();
  drop(Refusal::Tls, "no TLS: " + error.message());
}

/// The header only: a body would be in memory before anybody could refuse it.
void Connection::read_request() {
  is_reading_ = true;
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
  if (is_finished_) return;
  note_progress(time_ns);
  if (time_ns - since_ns_ < context_.config.limits.handshake_ms * kMsInNs) return;
  if (is_idle() && stream_.untaken_bytes() == 0) return finish();
  drop(Refusal::Timeout,
       fmt::format("no request answered within {} ms", context_.config.limits.handshake_ms));
}

void Connection::on_request(const beast::error_code& error) {
  const bool was_idle = is_idle();
  is_reading_ = false;
  if (is_finished_) return;
  // Between two requests every end is one: TLS may be cut off there too.
  if (is_gone(error) || (error && was_idle)) return finish();
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return refuse(Refusal::Request, http::status::request_header_fields_too_large,
                  fmt::format("The header of a request has at most {} bytes.", kMaxHttpHeaderBytes));
  if (error) return refuse(Refusal::Request, http::status::bad_request, "Bad request: " + error.message());
  const Request& request = parser_->get();
  if (is_fit(request) && is_client_known(request) && may_ask() && may_be_plain()) answer(request);
}

/// A connection that is kept may not ask more often than new ones could.
bool Connection::may_ask() {
  if (peer_.is_trusted || peer_.is_proxy || context_.guard.take_request(peer_.key, now_ns())) return true;
  refuse(Refusal::Rate, http::status::too_many_requests, "Too many requests of one address: wait a second.");
  return false;
}

/// Nothing in it may mean one thing to us and another to somebody before us.
bool Connection::is_fit(const Request& request) {
  if (has_body(*parser_)) {
    refuse(Refusal::Request, http::status::payload_too_large, "Requests are served without a body only.");
    return false;
  }
  if (is_ambiguous(request)) {
    refuse(Refusal::Request, http::status::bad_request, "A field is there twice that may be there once.");
    return false;
  }
  return true;
}

/// Asks the field in which a proxy of ours says for whom it connects.
bool Connection::is_client_known(const Request& request) {
  if (!peer_.is_proxy || request.count(kForwardedFor) == 0) return true;
  std::string all;
  const auto [begin, end] = request.equal_range(kForwardedFor);
  for (auto field = begin; field != end; ++field) {
    if (field != begin) all.push_back(',');
    all.append(view(field->value()));
  }
  const Result<IpAddress> client = forwarded_client(all, context_.config.trusted_proxies);
  if (!client) {
    refuse(Refusal::Proxy, http::status::bad_request, client.error().message + ".");
    return false;
  }
  const std::optional<Refusal> why = stand_for(*client);
  if (why) refuse(*why, http::status::too_many_requests, "Too many connections of one address.");
  return !why;
}

bool Connection::may_be_plain() {
  const bool is_plain_allowed =
      context_.tls == nullptr ||
      (peer_.is_trusted && context_.config.plain_access == PlainAccess::TrustedLoopback);
  if (stream_.is_tls() || is_plain_allowed) return true;
  response_.set(http::field::upgrade, "TLS/1.2");
  response_.set(http::field::connection, "Upgrade");
  refuse(Refusal::Tls, http::status::upgrade_required,
         "This server speaks TLS only: use https://, wss:// or --tls.");
  return false;
}

void Connection::answer(const Request& request) {
  const auto host = request[http::field::host];
  if (!is_host_allowed(view(host), local_address_, is_loopback_, context_.config.allowed_hosts))
    return refuse(Refusal::Host, http::status::forbidden,
                  "This Host is not served here (--allow-host adds one).", quoted(view(host)));
  const std::string_view path = without_session(view(request.target()));
  if (websocket::is_upgrade(request) && path == kWebSocketPath) return answer_upgrade(request);
  const bool is_get = request.method() == http::verb::get || request.method() == http::verb::head;
  if (is_get && path == "/healthz") return respond(http::status::ok, "ok\n");
  if (is_get && path == "/readyz") return answer_readiness();
  if (is_get && path == "/metrics") return answer_metrics(request);
  if (is_get && path.empty()) return redirect(std::string(view(request.target())) + '/');
  if (answer_page(request)) return;
  refuse(Refusal::Path, http::status::not_found,
         "Not found. Here are: / /healthz /readyz /metrics /v1 (WebSocket).",
         quoted(path_of_target(view(request.target()))));
}

void Connection::answer_readiness() {
  const Status status = context_.is_stopping
                            ? Status(make_error(ErrorCode::Unavailable, "The server is stopping."))
                            : context_.readiness();
  if (status) return respond(http::status::ok, "ready\n");
  respond(http::status::service_unavailable, status.error().message + "\n");
}

/// The page's files lie beside it: its name must end in a slash.
void Connection::redirect(const std::string& target) {
  response_.set(http::field::location, target);
  respond(http::status::permanent_redirect, "The page is at " + target + "\n");
}

/// What the server does is for those who may watch it: beyond trusted loopback any role's token is needed.
void Connection::answer_metrics(const Request& request) {
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view given = view(request[http::field::authorization]);
  if (!peer_.is_trusted &&
      (!given.starts_with(kScheme) || !find_grant(context_.tokens, given.substr(kScheme.size())))) {
    if (!given.empty() && context_.guard.is_blocked(peer_.key, now_ns()))
      return refuse(Refusal::Blocked, http::status::too_many_requests, kBlockedSentence);
    if (!given.empty()) context_.guard.on_wrong_token(peer_.key, now_ns());
    response_.set(http::field::www_authenticate, "Bearer");
    return refuse(given.empty() ? Refusal::Path : Refusal::Token, http::status::unauthorized,
                  "/metrics needs a token here (Authorization: Bearer).");
  }
  respond(http::status::ok,
          format_metrics(context_.counters_now()) +
              format_histogram("net_queue_delay_ms", "How long data waits on its way to a viewer.",
                               context_.queue_delays) +
              context_.heads.front().handler.metrics(),
          "text/plain; version=0.0.4");
}

void Connection::answer_upgrade(const Request& request) {
  // Sessions, not the proxy's own probes: whoever set it up has to know.
  if (peer_.is_proxy)
    context_.note(
        fmt::format("trusted proxy {} names no client: all of its clients count as one", peer_.address),
        LogLevel::Warn);
  const auto origin = request[http::field::origin];
  if (!is_origin_allowed(view(origin), view(request[http::field::host]), context_.config.allowed_origins))
    return refuse(Refusal::Origin, http::status::forbidden,
                  "Pages of another origin may not connect (--allow-origin adds one).", quoted(view(origin)));
  const auto protocols = request[http::field::sec_websocket_protocol];
  if (!offers_protocol(protocols))
    return refuse(Refusal::Path, http::status::bad_request,
                  fmt::format("The WebSocket subprotocol must be {}.", kWebSocketProtocol),
                  quoted(view(protocols)));
  const auto key = request[http::field::sec_websocket_key];
  if (!is_websocket_key(view(key)))
    return refuse(Refusal::Request, http::status::bad_request,
                  "Sec-WebSocket-Key must be 16 bytes in base64.", quoted(view(key)));
  upgrade();
}

void Connection::upgrade() {
  // A client may say Hello before it has our answer.
  const auto read_too_far = buffer_.cdata();
  stream_.put_back({static_cast<const std::byte*>(read_too_far.data()), read_too_far.size()});
  if (answered_ > 0)
    peer_.accepted_ns = now_ns();  // the time for its Hello does not begin with another request
  const SessionId id = context_.next_session++;
  const bool has_room = context_.has_room(peer_.key);
  auto session = std::make_shared<Session>(context_, id, std::move(stream_), peer_);
  context_.sessions.emplace(id, session);
  context_.update_session_counts();
  is_finished_ = true;
  context_.connections.erase(shared_from_this());
  session->start(parser_->release(), has_room);
}

/// Closes without an answer.
void Connection::drop(Refusal why, const std::string& sentence) {
  context_.refuse(why, peer_, sentence);
  finish();
}

/// One sentence to the peer, and one to the log, which may quote the peer in `detail`.
void Connection::refuse(Refusal why, http::status status, const std::string& sentence,
                        const std::string& detail) {
  context_.refuse(why, peer_, detail.empty() ? sentence : detail);
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
  // An answer to HEAD says how long the text is, and ends there.
  if (parser_ && parser_->get().method() == http::verb::head) response_.body().clear();
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
