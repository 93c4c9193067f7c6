// Certificates and rules of one side of TLS. Any thread; an existing connection keeps the context it began
// with.
#pragma once

#include <filesystem>
#include <memory>

#include "common/base/result.h"

namespace strandcast {

/// PEM files of a server: its certificate with those in between up to the authority, and its key.
struct TlsFiles {
  std::filesystem::path certificate;
  std::filesystem::path key;
};

/// Holds OpenSSL's context, TLS 1.2 and later only.
class TlsContext;
using TlsContextPtr = std::shared_ptr<TlsContext>;

/// BadInput names the file that cannot be read, does not fit the other, or is a key that everybody on the
/// machine may read.
Result<TlsContextPtr> make_server_tls(const TlsFiles& files);

/// Trusts the system's authorities, or those in `authorities` (PEM) when it is not empty. BadInput names it.
Result<TlsContextPtr> make_client_tls(const std::filesystem::path& authorities);

}  // namespace strandcast
