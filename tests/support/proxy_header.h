// Headers of the PROXY protocol, version 2, written from its document and not with the parser's names.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>

namespace strandcast::test {

inline constexpr const char* kProxySignature = "\r\n\r\n\0\r\nQUIT\n";

/// A header with this command and family and `rest` behind them.
inline std::string proxy_header(uint8_t command, uint8_t family, const std::string& rest) {
  std::string header(kProxySignature, 12);
  header += static_cast<char>(command);
  header += static_cast<char>(family);
  header += static_cast<char>(rest.size() >> 8);
  header += static_cast<char>(rest.size());
  return header + rest;
}

inline std::string bytes_of(std::initializer_list<int> values) {
  std::string bytes;
  for (const int value : values) bytes += static_cast<char>(value);
  return bytes;
}

/// TCP over IPv4 from 203.0.113.`last` to 192.0.2.1, with what a proxy adds.
inline std::string proxy_v4(int last, const std::string& added = {}) {
  return proxy_header(0x21, 0x11,
                      bytes_of({203, 0, 113, last, 192, 0, 2, 1, 0xd4, 0x31, 0x1e, 0xc6}) + added);
}

}  // namespace strandcast::test
