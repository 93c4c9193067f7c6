// ServiceManager: what systemd, or whoever speaks as it does, gives this process and is told of it: a
// listening socket (LISTEN_FDS), readiness, a line of status and a heartbeat (NOTIFY_SOCKET, WATCHDOG_USEC).
// Where nobody asks it does nothing. One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// The name that a unit gives the server's socket (FileDescriptorName=).
inline constexpr std::string_view kServiceSocketName = "strandcast";

class ServiceManager {
 public:
  /// As the environment of this process says.
  static ServiceManager of_environment();
  ~ServiceManager();
  ServiceManager(ServiceManager&& other) noexcept;
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// Whether somebody is told anything.
  bool is_there() const { return socket_ >= 0; }
  /// The server answers from now on.
  void tell_ready(const std::string& status);
  /// For people who ask how it goes; sent where it is another one than before.
  void tell_status(const std::string& status);
  /// The end has begun.
  void tell_stopping();
  /// A heartbeat, at half the time after which the manager would restart the process; none while the
  /// simulation has been at one turn of its loop for longer than that, `busy_ns`.
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

/// A socket that was opened for us and listens. Its owner closes it.
struct PassedSocket {
  int descriptor = -1;
  std::string address;  // numeric
  uint16_t port = 0;
};

/// The one that is called kServiceSocketName, or the only one of a manager that gives no names; nothing where
/// none was passed to this process. BadInput where that is no listening TCP socket, or none or several have
/// the name. Takes the variables out of the environment.
Result<std::optional<PassedSocket>> take_passed_socket();

}  // namespace strandcast
