#include <linux/sockios.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/ioctl.h>

#include <atomic>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <optional>
#include <vector>

#include "common/base/profile.h"
#include "common/net/net_stream_private.h"
#include "common/net/tls_private.h"

namespace strandcast::net {
namespace {

namespace asio = boost::asio;
constexpr unsigned char kTlsHandshakeRecord = 0x16;  // RFC 8446, section 5.1

/// The handler without its executor, which Asio 1.81 cannot post to: all of a stream runs on one thread
/// anyway.
auto plain(NetStream::Done done) {
  return [done = std::move(done)](const NetStream::error_code& error) mutable { std::move(done)(error); };
}
auto plain(NetStream::Transferred done) {
  return [done = std::move(done)](const NetStream::error_code& error, size_t size) mutable {
    std::move(done)(error, size);
  };
}

}  // namespace

struct NetStream::State {
  explicit State(Socket connected) : socket(std::move(connected)) {}
  Socket socket;
  std::optional<asio::ssl::stream<Socket&>> tls;
  std::vector<std::byte> put_back;
  std::shared_ptr<uint64_t> read_left;  // null: no limit
  // Shared with reads under way, which may outlive the stream.
  const std::shared_ptr<std::atomic<int64_t>> received_ns = std::make_shared<std::atomic<int64_t>>(0);
};

NetStream::NetStream(Socket socket) : state_(std::make_unique<State>(std::move(socket))) {}
NetStream::NetStream(NetStream&&) noexcept = default;
NetStream::~NetStream() = default;

NetStream::executor_type NetStream::get_executor() {
  return state_->socket.get_executor();
}
NetStream::Socket& NetStream::socket() {
  return state_->socket;
}
bool NetStream::is_tls() const {
  return state_->tls.has_value();
}
size_t NetStream::untaken_bytes() {
  int bytes = 0;
  return ioctl(state_->socket.native_handle(), SIOCOUTQ, &bytes) == 0 ? static_cast<size_t>(bytes) : 0;
}
int64_t NetStream::received_ns() const {
  return *state_->received_ns;
}
void NetStream::close() {
  error_code ignored;
  state_->socket.close(ignored);
}

void NetStream::async_wait_readable(Done done) {
  state_->socket.async_wait(Socket::wait_read, plain(std::move(done)));
}

bool NetStream::is_tls_hello() {
  unsigned char first = 0;
  error_code error;
  state_->socket.non_blocking(true, error);
  const size_t size = state_->socket.receive(asio::buffer(&first, 1), Socket::message_peek, error);
  return !error && size == 1 && first == kTlsHandshakeRecord;
}

void NetStream::put_back(std::span<const std::byte> bytes) {
  state_->put_back.insert(state_->put_back.begin(), bytes.begin(), bytes.end());
}

void NetStream::limit_reading(uint64_t bytes) {
  state_->read_left = bytes == kNoReadLimit ? nullptr : std::make_shared<uint64_t>(bytes);
}

void NetStream::async_accept_tls(const TlsContextPtr& context, Done done) {
  state_->tls.emplace(state_->socket, context->ssl);
  state_->tls->async_handshake(asio::ssl::stream_base::server, plain(std::move(done)));
}

void NetStream::async_connect_tls(const TlsContextPtr& context, const std::string& host, Done done) {
  state_->tls.emplace(state_->socket, context->ssl);
  SSL* const native = state_->tls->native_handle();
  X509_VERIFY_PARAM* const rules = SSL_get0_param(native);
  X509_VERIFY_PARAM_set_hostflags(rules, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
  error_code no_address;
  (void)asio::ip::make_address(host, no_address);
  const bool is_set = no_address ? X509_VERIFY_PARAM_set1_host(rules, host.data(), host.size()) == 1 &&
                                       SSL_set_tlsext_host_name(native, host.c_str()) == 1
                                 : X509_VERIFY_PARAM_set1_ip_asc(rules, host.c_str()) == 1;
  if (!is_set)
    return asio::post(get_executor(), [done = std::move(done)]() mutable {
      std::move(done)(error_code(asio::error::invalid_argument));
    });
  state_->tls->async_handshake(asio::ssl::stream_base::client, plain(std::move(done)));
}

std::string NetStream::certificate_trouble() const {
  if (!state_->tls) return {};
  // OpenSSL only reads here; Asio's const overload is missing.
  const long result = SSL_get_verify_result(const_cast<State&>(*state_).tls->native_handle());
  return result == X509_V_OK ? std::string() : X509_verify_cert_error_string(result);
}

bool NetStream::is_tls_error(const error_code& error) {
  return error.category() == asio::error::get_ssl_category();
}

void NetStream::async_shut_down(Done done) {
  const auto end_sending = [](Socket& socket) {
    error_code ignored;
    socket.shutdown(Socket::shutdown_send, ignored);
  };
  if (state_->tls) {
    state_->tls->async_shutdown([this, end_sending, done = std::move(done)](const error_code& error) mutable {
      end_sending(state_->socket);
      std::move(done)(error);
    });
    return;
  }
  end_sending(state_->socket);
  asio::post(get_executor(), [done = std::move(done)]() mutable { std::move(done)(error_code()); });
}

void NetStream::async_tear_down(boost::beast::role_type role, Done done) {
  boost::beast::websocket::async_teardown(role, state_->socket, plain(std::move(done)));
}

void NetStream::read_some(const MutableBuffers& buffers, Transferred done) {
  if (std::vector<std::byte>& held = state_->put_back; !held.empty()) {
    const size_t size = asio::buffer_copy(buffers, asio::buffer(held));
    held.erase(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(size));
    return asio::post(get_executor(),
                      [size, done = std::move(done)]() mutable { std::move(done)(error_code(), size); });
  }
  if (state_->read_left == nullptr) return read_fresh(buffers, std::move(done));
  const std::shared_ptr<uint64_t> left = state_->read_left;
  if (*left == 0)
    return asio::post(get_executor(), [done = std::move(done)]() mutable {
      std::move(done)(error_code(asio::error::message_size), 0);
    });
  MutableBuffers some;
  size_t room = 0;
  for (const asio::mutable_buffer& buffer : buffers) {
    if (room == *left) break;
    some.push_back(asio::buffer(buffer, static_cast<size_t>(*left - room)));
    room += some.back().size();
  }
  read_fresh(some, [left, done = std::move(done)](const error_code& error, size_t size) mutable {
    *left -= size;
    std::move(done)(error, size);
  });
}

void NetStream::read_fresh(const MutableBuffers& buffers, Transferred done) {
  auto noting = [received = state_->received_ns, done = std::move(done)](const error_code& error,
                                                                         size_t size) mutable {
    if (size > 0) *received = now_ns();
    std::move(done)(error, size);
  };
  if (state_->tls) return state_->tls->async_read_some(buffers, std::move(noting));
  state_->socket.async_read_some(buffers, std::move(noting));
}

void NetStream::write_some(const ConstBuffers& buffers, Transferred done) {
  if (state_->tls) return state_->tls->async_write_some(buffers, plain(std::move(done)));
  state_->socket.async_write_some(buffers, plain(std::move(done)));
}

void beast_close_socket(NetStream& stream) {
  stream.close();
}

void teardown(boost::beast::role_type role, NetStream& stream, NetStream::error_code& error) {
  boost::beast::websocket::teardown(role, stream.socket(), error);
}

}  // namespace strandcast::net
