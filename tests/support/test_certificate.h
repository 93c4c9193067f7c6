// Certificates made on the spot, so that no key lies in the project.
#pragma once

#include <string>

#include "common/net/tls_context.h"

namespace strandcast::test {

struct CertificatePlan {
  std::string names = "DNS:localhost,IP:127.0.0.1";  // as OpenSSL writes subjectAltName
  long valid_s = 86'400;                             // from now; negative: over already
};

/// Writes DIR/NAME.crt and DIR/NAME.key (mode 0600): a certificate signed by its own key.
TlsFiles make_certificate(const std::filesystem::path& folder, const std::string& name,
                          const CertificatePlan& plan = {});

}  // namespace strandcast::test
