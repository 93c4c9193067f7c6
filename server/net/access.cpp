#include "server/net/access.h"

#include <algorithm>
#include <cctype>

#include "server/net/net_server.h"

namespace strandcast {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

bool is_digits(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

}  // namespace

Status check_listening(bool is_trusted, const std::string& address, const std::vector<AccessToken>& tokens) {
  if (is_trusted || !tokens.empty()) return {};
  return make_error(ErrorCode::Unauthorized,
                    "listening on '{}' needs a token (--token-file); without one only loopback is served",
                    address);
}

std::string host_name_of(std::string_view host_header) {
  if (host_header.empty()) return {};
  std::string_view name = host_header;
  std::string_view rest;
  if (name.front() == '[') {
    const size_t end = name.find(']');
    if (end == std::string_view::npos) return {};
    rest = name.substr(end + 1);
    name = name.substr(1, end - 1);
  } else if (const size_t colon = name.find(':'); colon != std::string_view::npos) {
    rest = name.substr(colon);
    name = name.substr(0, colon);
  }
  if (!rest.empty() && (rest.front() != ':' || !is_digits(rest.substr(1)))) return {};
  return lower(name);
}

bool is_host_allowed(std::string_view host_header, const std::string& local_address, bool is_loopback,
                     const std::vector<std::string>& allowed_names) {
  const std::string name = host_name_of(host_header);
  if (name.empty()) return false;
  if (name == local_address) return true;
  if (is_loopback && (name == "localhost" || name == "127.0.0.1" || name == "::1")) return true;
  return std::any_of(allowed_names.begin(), allowed_names.end(),
                     [&](const std::string& allowed) { return lower(allowed) == name; });
}

bool is_origin_allowed(std::string_view origin_header, std::string_view host_header,
                       const std::vector<std::string>& allowed_origins) {
  if (origin_header.empty()) return true;
  const std::string origin = lower(origin_header);
  const std::string host = lower(host_header);
  if (origin == "http://" + host || origin == "https://" + host) return true;
  return std::any_of(allowed_origins.begin(), allowed_origins.end(),
                     [&](const std::string& allowed) { return lower(allowed) == origin; });
}

bool RateLimit::take(int64_t time_ns) {
  if (last_ns_ != 0) {
    const double elapsed_s = static_cast<double>(std::max<int64_t>(time_ns - last_ns_, 0)) * 1e-9;
    tokens_ = std::min(most_, tokens_ + elapsed_s * rate_per_s_);
  }
  last_ns_ = time_ns;
  if (tokens_ < 1.0) return false;
  tokens_ -= 1.0;
  return true;
}

}  // namespace strandcast
