// ServiceManager: talks to systemd, or a manager with the same protocol. It receives a listening socket
// (LISTEN_FDS) and reports readiness, a status line and a heartbeat (NOTIFY_SOCKET, WATCHDOG_USEC). Does
// nothing without a manager. One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// Name of the server's socket in a unit file (FileDescriptorName=).
inline constexpr std::string_view kServiceSocketName = "strandcast";

class ServiceManager {
 public:
  /// Makes a manager connection from the environment of this process.
  static ServiceManager of_environment();
  ~ServiceManager();
  ServiceManager(ServiceManager&& other) noexcept;
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// Returns whether a manager listens to notifications.
  bool is_there() const { return socket_ >= 0; }
  /// Reports that the server answers from now on.
  void tell_ready(const std::string& status);
  /// Reports a status line for people; sent only if it has changed.
  void tell_status(const std::string& status);
  /// Reports that shutdown has begun.
  void tell_stopping();
  /// Sends a heartbeat at half the manager's watchdog timeout. Sends none while the simulation has been in
  /// one turn of its loop (`busy_ns`) for longer than the timeout.
  void beat(int64_t time_ns, int64_t busy_ns);

 private:
  ServiceManager() = default;
  void send(std::string_view text) const;

  int socket_ = -1;          // none: nobody asks
  int64_t watchdog_ns_ = 0;  // 0: no heartbeat is waited for
  int64_t last_beat_ns_ = 0;
  std::string address_;  // of the manager's socket, as the kernel takes it
  std::string status_;
};

/// A listening socket that the manager opened. The receiver closes it.
struct PassedSocket {
  int descriptor = -1;
  std::string address;  // numeric
  uint16_t port = 0;
};

/// Returns the socket named kServiceSocketName, or the only one if the manager gives no names; empty if none
/// was passed. BadInput if it is not a listening TCP socket, or if not exactly one has the name. Removes the
/// variables from the environment.
Result<std::optional<PassedSocket>> take_passed_socket();

}  // namespace strandcast
