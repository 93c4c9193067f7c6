// LoadSocket: one TCP connection that never blocks, with or without TLS. One thread. Knows nothing of what it
// carries.
#pragma once

#include <openssl/ssl.h>
#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "common/base/result.h"

namespace strandcast::load {

using TlsSettings = std::shared_ptr<SSL_CTX>;

/// Trusts the authorities in this file (PEM), or the system's when it is empty. BadInput names the file.
Result<TlsSettings> make_tls_settings(const std::filesystem::path& authorities);

class LoadSocket {
 public:
  /// Begins to connect to a numeric IPv4 address; `tls` may be null. Unavailable when there are no file
  /// descriptors left, BadInput for what is no address.
  static Result<LoadSocket> connect(const std::string& host, uint16_t port, const TlsSettings& tls);
  LoadSocket(LoadSocket&& other) noexcept;
  /// Closes.
  ~LoadSocket();

  int descriptor() const { return descriptor_; }
  /// Bytes taken; 0: none now, negative: the connection is broken.
  ssize_t send_some(std::span<const std::byte> bytes);
  /// Bytes put into the buffer; 0: none now, negative: the connection is over.
  ssize_t receive_some(std::span<std::byte> buffer);
  /// Writing waits for something to read: the TLS handshake does.
  bool needs_input_to_write() const { return needs_input_to_write_; }
  /// Something can be received that makes the descriptor readable no more: TLS has decrypted it already.
  bool has_more() const;
  /// Closing resets the connection from now on.
  void be_rude();

 private:
  explicit LoadSocket(int descriptor) : descriptor_(descriptor) {}

  int descriptor_;
  std::unique_ptr<SSL, decltype(&SSL_free)> tls_{nullptr, SSL_free};
  bool needs_input_to_write_ = false;
};

}  // namespace strandcast::load
