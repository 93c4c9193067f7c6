// A plain datagram socket on loopback, for tests of what comes in by datagrams.
#pragma once

#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace strandcast::test {

class UdpSocket {
 public:
  /// On this port of this address, 0 = any free one.
  explicit UdpSocket(const char* address = "127.0.0.1", uint16_t port = 0)
      : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in own = place(address, port);
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
  /// Waits for a datagram; false when none comes.
  bool is_sent_something() const {
    constexpr int kMostMs = 20'000;
    pollfd waiting{socket_, POLLIN, 0};
    return poll(&waiting, 1, kMostMs) == 1;
  }
  /// Takes a datagram that has come; empty when there is none.
  std::vector<std::byte> take() const {
    std::vector<std::byte> bytes(65'536);
    const ssize_t size = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    bytes.resize(size > 0 ? static_cast<size_t>(size) : 0);
    return bytes;
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

/// An address of IPv4 of this machine that is not loopback's; empty where there is none.
inline std::string own_network_address() {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return {};
  std::string found;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    const auto* place = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    char text[INET_ADDRSTRLEN] = {};
    const bool is_loopback = (ntohl(place->sin_addr.s_addr) >> 24) == 127;
    if (!is_loopback && inet_ntop(AF_INET, &place->sin_addr, text, sizeof(text)) != nullptr) found = text;
  }
  freeifaddrs(all);
  return found;
}

}  // namespace strandcast::test
