#include "tests/tools/load/load_socket.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

namespace strandcast::load {

Result<TlsSettings> make_tls_settings(const std::filesystem::path& authorities) {
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes without MSG_NOSIGNAL
  TlsSettings settings(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
  const std::string file = authorities.string();
  const int trusted = file.empty() ? SSL_CTX_set_default_verify_paths(settings.get())
                                   : SSL_CTX_load_verify_locations(settings.get(), file.c_str(), nullptr);
  if (trusted != 1)
    return at(file, make_error(ErrorCode::BadInput, "cannot use these certificate authorities"));
  SSL_CTX_set_min_proto_version(settings.get(), TLS1_2_VERSION);
  SSL_CTX_set_verify(settings.get(), SSL_VERIFY_PEER, nullptr);
  SSL_CTX_set_mode(settings.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  return settings;
}

Result<LoadSocket> LoadSocket::connect(const std::string& host, uint16_t port, const TlsSettings& tls) {
  LoadSocket made(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (made.descriptor_ < 0)
    return make_error(ErrorCode::Unavailable, "cannot open a socket: {}", std::strerror(errno));
  const int on = 1;
  setsockopt(made.descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  if (inet_pton(AF_INET, host.c_str(), &address.sin_addr) != 1)
    return make_error(ErrorCode::BadInput, "'{}' is no numeric IPv4 address", host);
  ::connect(made.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  if (tls == nullptr) return made;
  made.tls_.reset(SSL_new(tls.get()));
  X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(made.tls_.get()), host.c_str());
  SSL_set_fd(made.tls_.get(), made.descriptor_);
  SSL_set_connect_state(made.tls_.get());
  return made;
}

LoadSocket::LoadSocket(LoadSocket&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      tls_(std::move(other.tls_)),
      needs_input_to_write_(other.needs_input_to_write_) {}

LoadSocket::~LoadSocket() {
  if (descriptor_ >= 0) close(descriptor_);
}

ssize_t LoadSocket::send_some(std::span<const std::byte> bytes) {
  if (tls_ == nullptr) {
    const ssize_t size = send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    return size < 0 && (errno == EAGAIN || errno == ENOTCONN) ? 0 : size;
  }
  const int size = SSL_write(tls_.get(), bytes.data(), static_cast<int>(bytes.size()));
  const int why = SSL_get_error(tls_.get(), size);
  needs_input_to_write_ = size <= 0 && why == SSL_ERROR_WANT_READ;
  if (size > 0) return size;
  const bool is_too_early = why == SSL_ERROR_SYSCALL && errno == ENOTCONN;
  return why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE || is_too_early ? 0 : -1;
}

ssize_t LoadSocket::receive_some(std::span<std::byte> buffer) {
  if (tls_ == nullptr) {
    const ssize_t size = recv(descriptor_, buffer.data(), buffer.size(), 0);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
    return size == 0 ? -1 : size;
  }
  needs_input_to_write_ = false;
  const int size = SSL_read(tls_.get(), buffer.data(), static_cast<int>(buffer.size()));
  if (size > 0) return size;
  const int why = SSL_get_error(tls_.get(), size);
  return why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE ? 0 : -1;
}

bool LoadSocket::has_more() const {
  return tls_ != nullptr && SSL_pending(tls_.get()) > 0;
}

void LoadSocket::be_rude() {
  const linger now{1, 0};
  setsockopt(descriptor_, SOL_SOCKET, SO_LINGER, &now, sizeof now);
}

}  // namespace strandcast::load
