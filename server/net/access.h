// Access checks of the server: listening address, Host and Origin headers, message rate. Pure functions on
// untrusted text, any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server/net/roles.h"

namespace strandcast {

/// Refuses to listen without a token where other machines can connect. `is_trusted`: the address is loopback,
/// and loopback is trusted.
Status check_listening(bool is_trusted, const std::string& address, const std::vector<AccessToken>& tokens);

/// Returns the Host header without its port, in lower case, IPv6 without brackets; empty if malformed.
std::string host_name_of(std::string_view host_header);

/// Returns true for names that a foreign web page cannot make a browser send to us (DNS rebinding). They are
/// the allowed names, the address of the connection, and loopback names on a loopback connection.
bool is_host_allowed(std::string_view host_header, const std::string& local_address, bool is_loopback,
                     const std::vector<std::string>& allowed_names);

/// Returns true if the origin is absent (not a browser), is this server's own page, or is exactly one of the
/// allowed origins ("https://hair.example:8443").
bool is_origin_allowed(std::string_view origin_header, std::string_view host_header,
                       const std::vector<std::string>& allowed_origins);

/// Token bucket that fills at `rate_per_s` and holds those of `depth_s`.
class RateLimit {
 public:
  explicit RateLimit(double rate_per_s, double depth_s = 1.0)
      : rate_per_s_(rate_per_s), most_(rate_per_s * depth_s), tokens_(most_) {}
  /// Takes a token; returns false if there is none.
  bool take(int64_t time_ns);

 private:
  double rate_per_s_;
  double most_;
  double tokens_;
  int64_t last_ns_ = 0;
};

}  // namespace strandcast
