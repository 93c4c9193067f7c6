#include "common/net/tls_context.h"

#include <openssl/ssl.h>
#include <sys/stat.h>

#include "common/net/tls_private.h"

namespace strandcast {
namespace {

namespace ssl = boost::asio::ssl;
using boost::system::error_code;

/// Forward secrecy and authenticated encryption only; those of TLS 1.3 are all of that kind.
constexpr const char* kCiphers12 = "ECDHE+AESGCM:ECDHE+CHACHA20";

Error file_error(const std::filesystem::path& path, const char* what, const error_code& error) {
  return at(path.string(), make_error(ErrorCode::BadInput, "{}: {}", what, error.message()));
}

/// Restricts a context, of server or client, to TLS 1.2 and newer without resumption, renegotiation or
/// compression.
Status restrict_protocol(ssl::context& context) {
  SSL_CTX* const native = context.native_handle();
  context.set_options(ssl::context::default_workarounds | ssl::context::no_sslv2 | ssl::context::no_sslv3 |
                      ssl::context::no_compression);
  SSL_CTX_set_options(native, SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_NO_TICKET);
  // No resumption: nothing to keep, and every connection proves itself anew.
  SSL_CTX_set_session_cache_mode(native, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_num_tickets(native, 0);
  if (SSL_CTX_set_min_proto_version(native, TLS1_2_VERSION) != 1 ||
      SSL_CTX_set_cipher_list(native, kCiphers12) != 1)
    return make_error(ErrorCode::Unsupported, "this OpenSSL lacks TLS 1.2 or its ciphers");
  return {};
}

Status check_key_mode(const std::filesystem::path& key) {
  struct stat facts {};
  constexpr mode_t kModeBits = 0777;
  constexpr mode_t kNotForOthers = S_IRWXO | S_IWGRP;
  if (stat(key.c_str(), &facts) != 0 || (facts.st_mode & kNotForOthers) == 0) return {};
  return at(key.string(),
            make_error(ErrorCode::BadInput,
                       "the key has mode {:04o}, so that others may read or change it (chmod 600 FILE)",
                       facts.st_mode & kModeBits));
}

}  // namespace

Result<TlsContextPtr> make_server_tls(const TlsFiles& files) {
  auto made = std::make_shared<TlsContext>(ssl::context::tls_server);
  RETURN_IF_ERROR(restrict_protocol(made->ssl));
  error_code error;
  made->ssl.use_certificate_chain_file(files.certificate.string(), error);
  if (error) return file_error(files.certificate, "cannot use this certificate", error);
  RETURN_IF_ERROR(check_key_mode(files.key));
  // A key with a password is refused; OpenSSL would ask for it on the terminal.
  made->ssl.set_password_callback([](size_t, ssl::context::password_purpose) { return std::string(); });
  made->ssl.use_private_key_file(files.key.string(), ssl::context::pem, error);
  if (error) return file_error(files.key, "cannot use this key with the certificate", error);
  return TlsContextPtr(std::move(made));
}

Result<TlsContextPtr> make_client_tls(const std::filesystem::path& authorities) {
  auto made = std::make_shared<TlsContext>(ssl::context::tls_client);
  RETURN_IF_ERROR(restrict_protocol(made->ssl));
  error_code error;
  if (authorities.empty()) {
    made->ssl.set_default_verify_paths(error);
    if (error)
      return make_error(ErrorCode::Unavailable, "the system's certificate authorities cannot be read: {}",
                        error.message());
  } else {
    made->ssl.load_verify_file(authorities.string(), error);
    if (error) return file_error(authorities, "cannot use these certificate authorities", error);
  }
  made->ssl.set_verify_mode(ssl::verify_peer);
  return TlsContextPtr(std::move(made));
}

}  // namespace strandcast
