// Who may talk to the server: listening address, Host and Origin headers, message rate. Pure functions
// on untrusted text, any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server/net/roles.h"

namespace strandcast {

/// Refuses to listen without a token where others can reach us. `is_trusted`: on loopback, and loopback is
/// trusted.
Status check_listening(bool is_trusted, const std::string& address, const std::vector<AccessToken>& tokens);

/// Host header without its port, lower case, IPv6 without brackets; empty when malformed.
std::string host_name_of(std::string_view host_header);

/// True for names that a foreign web page cannot make a browser send for an address of ours (DNS rebinding):
/// loopback names when the connection came in on loopback, the address it came in on, and the allowed names.
bool is_host_allowed(std::string_view host_header, const std::string& local_address, bool is_loopback,
                     const std::vector<std::string>& allowed_names);

/// Absent (empty: not a browser), or the page came from this very server, or exactly one of the allowed
/// origins ("https://hair.example:8443").
bool is_origin_allowed(std::string_view origin_header, std::string_view host_header,
                       const std::vector<std::string>& allowed_origins);

/// Token bucket: `rate_per_s` on average, as many at once.
class RateLimit {
 public:
  explicit RateLimit(double rate_per_s) : rate_per_s_(rate_per_s), tokens_(rate_per_s) {}
  /// False when this one is too many.
  bool take(int64_t time_ns);

 private:
  double rate_per_s_;
  double tokens_;
  int64_t last_ns_ = 0;
};

}  // namespace strandcast
