// A plain datagram socket on loopback, for tests of what comes in by datagrams.
#pragma once

#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace strandcast::test {

class UdpSocket {
 public:
  /// On any free port of this address.
  explicit UdpSocket(const char* address = "127.0.0.1") : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in own = place(address, 0);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof(own)), 0) << address;
    socklen_t size = sizeof(own);
    EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &size), 0);
    port_ = ntohs(own.sin_port);
    address_ = address;
  }
  ~UdpSocket() { close(socket_); }
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  void send(const std::vector<std::byte>& bytes, uint16_t port, const char* address = "127.0.0.1") const {
    const sockaddr_in to = place(address, port);
    EXPECT_EQ(
        sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to)),
        static_cast<ssize_t>(bytes.size()));
  }
  uint16_t port() const { return port_; }
  /// As a receiver names it.
  std::string name() const { return address_ + ":" + std::to_string(port_); }

 private:
  static sockaddr_in place(const char* address, uint16_t port) {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = htons(port);
    EXPECT_EQ(inet_pton(AF_INET, address, &place.sin_addr), 1);
    return place;
  }

  int socket_;
  uint16_t port_ = 0;
  std::string address_;
};

/// A port that nobody listens on now.
inline uint16_t free_udp_port() {
  return UdpSocket().port();
}

}  // namespace strandcast::test
