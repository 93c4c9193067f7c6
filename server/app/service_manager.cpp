#include "server/app/service_manager.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <utility>
#include <vector>

#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr int kFirstPassed = 3;  // behind standard input, output and error
constexpr int64_t kMostPassed = 16;

/// A whole number of the environment; nothing where it is missing or none.
std::optional<int64_t> number_of(const char* variable) {
  const char* text = std::getenv(variable);
  if (text == nullptr) return std::nullopt;
  int64_t value = 0;
  const char* end = text + std::strlen(text);
  const auto [rest, failure] = std::from_chars(text, end, value);
  return failure == std::errc() && rest == end && value >= 0 ? std::optional(value) : std::nullopt;
}

/// Returns whether this variable names this process, not the parent that it was inherited from.
bool is_for_us(const char* variable) {
  return number_of(variable) == int64_t{getpid()};
}

std::vector<std::string> split_names(const char* text) {
  std::vector<std::string> names(text != nullptr ? 1 : 0);
  for (; text != nullptr && *text != '\0'; ++text)
    *text == ':' ? (void)names.emplace_back() : names.back().push_back(*text);
  return names;
}

/// The descriptor of our name among the first `count` passed ones.
Result<int> find_named(int64_t count, const std::vector<std::string>& names) {
  if (names.empty() && count == 1) return kFirstPassed;
  std::vector<int> found;
  for (size_t i = 0; i < names.size() && static_cast<int64_t>(i) < count; ++i)
    if (names[i] == kServiceSocketName) found.push_back(kFirstPassed + static_cast<int>(i));
  if (found.size() == 1) return found.front();
  return make_error(
      ErrorCode::BadInput,
      "{} sockets were passed to the server and {} of them are called '{}', which one has to be "
      "(FileDescriptorName={} in the .socket unit)",
      count, found.size(), kServiceSocketName, kServiceSocketName);
}

Result<PassedSocket> describe(int descriptor) {
  const Error wrong = make_error(ErrorCode::BadInput,
                                 "the socket that was passed to the server is no listening TCP socket "
                                 "(ListenStream=ADDRESS:PORT in the .socket unit)");
  int is_listening = 0;
  socklen_t size = sizeof(is_listening);
  if (getsockopt(descriptor, SOL_SOCKET, SO_ACCEPTCONN, &is_listening, &size) != 0 || is_listening == 0)
    return wrong;
  sockaddr_storage own{};
  size = sizeof(own);
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&own), &size) != 0) return wrong;
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (own.ss_family == AF_INET) {
    const auto* place = reinterpret_cast<const sockaddr_in*>(&own);
    inet_ntop(AF_INET, &place->sin_addr, text.data(), text.size());
    return PassedSocket{descriptor, text.data(), ntohs(place->sin_port)};
  }
  if (own.ss_family != AF_INET6) return wrong;
  const auto* place = reinterpret_cast<const sockaddr_in6*>(&own);
  inet_ntop(AF_INET6, &place->sin6_addr, text.data(), text.size());
  return PassedSocket{descriptor, text.data(), ntohs(place->sin6_port)};
}

}  // namespace

ServiceManager ServiceManager::of_environment() {
  ServiceManager manager;
  const char* path = std::getenv("NOTIFY_SOCKET");
  // A path, or '@' and a name that is in no file system.
  if (path == nullptr || (path[0] != '/' && path[0] != '@')) return manager;
  manager.address_ = path;
  if (path[0] == '@') manager.address_[0] = '\0';
  if (manager.address_.size() > sizeof(sockaddr_un::sun_path)) return manager;
  manager.socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool has_watchdog = std::getenv("WATCHDOG_PID") == nullptr || is_for_us("WATCHDOG_PID");
  if (has_watchdog) manager.watchdog_ns_ = number_of("WATCHDOG_USEC").value_or(0) * kUsInNs;
  return manager;
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) close(socket_);
}

ServiceManager::ServiceManager(ServiceManager&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      watchdog_ns_(other.watchdog_ns_),
      last_beat_ns_(other.last_beat_ns_),
      address_(std::move(other.address_)),
      status_(std::move(other.status_)) {}

/// What cannot be sent is left out: no manager is a reason not to serve.
void ServiceManager::send(std::string_view text) const {
  if (socket_ < 0) return;
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::memcpy(to.sun_path, address_.data(), address_.size());
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  (void)sendto(socket_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
               reinterpret_cast<const sockaddr*>(&to), size);
}

void ServiceManager::tell_ready(const std::string& status) {
  status_ = status;
  send(fmt::format("READY=1\nSTATUS={}\n", status));
}

void ServiceManager::tell_status(const std::string& status) {
  if (status == status_) return;
  status_ = status;
  send(fmt::format("STATUS={}\n", status));
}

void ServiceManager::tell_stopping() {
  send("STOPPING=1\nSTATUS=Stopping\n");
}

void ServiceManager::beat(int64_t time_ns, int64_t busy_ns) {
  if (watchdog_ns_ == 0 || busy_ns > watchdog_ns_ / 2) return;
  if (last_beat_ns_ != 0 && time_ns - last_beat_ns_ < watchdog_ns_ / 2) return;
  last_beat_ns_ = time_ns;
  send("WATCHDOG=1\n");
}

Result<std::optional<PassedSocket>> take_passed_socket() {
  const bool is_ours = is_for_us("LISTEN_PID");
  const int64_t count = number_of("LISTEN_FDS").value_or(0);
  const std::vector<std::string> names = split_names(std::getenv("LISTEN_FDNAMES"));
  for (const char* variable : {"LISTEN_PID", "LISTEN_FDS", "LISTEN_FDNAMES"}) unsetenv(variable);
  if (!is_ours || count == 0) return std::optional<PassedSocket>();
  if (count > kMostPassed)
    return make_error(ErrorCode::LimitExceeded, "{} sockets were passed to the server, at most {} may be",
                      count, kMostPassed);
  for (int i = 0; i < static_cast<int>(count); ++i) fcntl(kFirstPassed + i, F_SETFD, FD_CLOEXEC);
  ASSIGN_OR_RETURN(const int descriptor, find_named(count, names));
  ASSIGN_OR_RETURN(PassedSocket socket, describe(descriptor));
  return std::optional(std::move(socket));
}

}  // namespace strandcast
