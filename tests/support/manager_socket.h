// What a service tells its manager (sd_notify), as systemd would hear it.
#pragma once

#include <gtest/gtest.h>

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <string>

namespace strandcast::test {

class ManagerSocket {
 public:
  /// At this path of a file system; the service finds it in NOTIFY_SOCKET.
  explicit ManagerSocket(const std::filesystem::path& path) : socket_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un own{};
    own.sun_family = AF_UNIX;
    std::strncpy(own.sun_path, path.c_str(), sizeof(own.sun_path) - 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof(own)), 0) << path;
  }
  ~ManagerSocket() { close(socket_); }
  ManagerSocket(const ManagerSocket&) = delete;
  ManagerSocket& operator=(const ManagerSocket&) = delete;

  /// The next datagram; empty when none comes in time.
  std::string next(int wait_ms = 20'000) {
    pollfd waiting{socket_, POLLIN, 0};
    if (poll(&waiting, 1, wait_ms) != 1) return {};
    std::array<char, 4'096> text{};
    const ssize_t size = recv(socket_, text.data(), text.size(), 0);
    return {text.data(), static_cast<size_t>(size > 0 ? size : 0)};
  }
  /// Skips what comes before; whether something with these words comes.
  bool hears(const std::string& words) {
    constexpr int kMost = 200;
    for (int i = 0; i < kMost; ++i) {
      const std::string text = next();
      if (text.empty()) return false;
      if (text.find(words) != std::string::npos) return true;
    }
    return false;
  }

 private:
  int socket_;
};

}  // namespace strandcast::test
