// Who stands behind a proxy: PROXY headers and X-Forwarded-For, right and wrong.
#include "server/net/proxy.h"

#include <gtest/gtest.h>

#include "tests/support/proxy_header.h"

namespace strandcast::proxy_test {
namespace {

using test::bytes_of;
using test::proxy_header;
using test::proxy_v4;

Result<std::optional<ProxiedPeer>> parse(const std::string& bytes) {
  return parse_proxy_header(std::as_bytes(std::span(bytes)));
}

TEST(ProxyHeader, GivesBothEnds) {
  const auto v4 = parse(proxy_v4(9));
  ASSERT_TRUE(v4 && *v4);
  EXPECT_EQ((*v4)->address.to_string(), "203.0.113.9");
  EXPECT_EQ((*v4)->local_address.to_string(), "192.0.2.1");
  const std::string ends = bytes_of({0x20, 0x01, 0x0d, 0xb8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 7}) +
                           bytes_of({0x20, 0x01, 0x0d, 0xb8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 2});
  const auto v6 = parse(proxy_header(0x21, 0x21, ends));
  ASSERT_TRUE(v6 && *v6);
  EXPECT_EQ((*v6)->address.to_string(), "2001:db8::7");
  EXPECT_EQ((*v6)->local_address.to_string(), "2001:db8::1");
}

TEST(ProxyHeader, AProxyMaySpeakForItself) {
  for (const std::string& header :
       {proxy_header(0x20, 0x00, {}), proxy_header(0x20, 0xff, "anything at all")}) {
    const auto parsed = parse(header);
    ASSERT_TRUE(parsed);
    EXPECT_FALSE(*parsed);
  }
}

TEST(ProxyHeader, WhatAProxyAddsIsPassedOver) {
  const std::string authority = bytes_of({0x02, 0, 4}) + "name";
  EXPECT_TRUE(parse(proxy_v4(9, authority + bytes_of({0x04, 0, 0}) + authority)));
  // Type and length without the value, and lengths that lead out of the header.
  for (const std::string& added : {bytes_of({2}), bytes_of({2, 0}), bytes_of({2, 0, 1}),
                                   authority + bytes_of({2, 0}), bytes_of({2, 0xff, 0xff, 1})})
    EXPECT_FALSE(parse(proxy_v4(9, added)));
}

TEST(ProxyHeader, RefusesAllElse) {
  const std::string whole = proxy_v4(9);
  for (size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(parse(whole.substr(0, size))) << size;
  EXPECT_FALSE(parse(whole + "x"));
  const std::string rest = whole.substr(kProxyFixedBytes);
  for (const int command : {0x00, 0x01, 0x10, 0x11, 0x22, 0x2f, 0x31, 0xff})
    EXPECT_FALSE(parse(proxy_header(static_cast<uint8_t>(command), 0x11, rest))) << command;
  for (const int family : {0x00, 0x10, 0x12, 0x20, 0x22, 0x31, 0x32, 0xff})
    EXPECT_FALSE(parse(proxy_header(0x21, static_cast<uint8_t>(family), rest))) << family;
  EXPECT_FALSE(parse(proxy_header(0x21, 0x21, rest))) << "IPv6 with the addresses of IPv4";
  for (size_t i = 0; i < 12; ++i) {
    std::string wrong = whole;
    wrong[i] = static_cast<char>(wrong[i] ^ 1);
    EXPECT_FALSE(parse(wrong)) << "signature, byte " << i;
  }
  EXPECT_FALSE(parse("PROXY TCP4 203.0.113.9 192.0.2.1 54321 7878\r\n")) << "version 1";
}

TEST(ProxyHeader, TheWholeLengthIsKnownFromItsBegin) {
  const auto size_of = [](const std::string& header) {
    return proxy_header_bytes(std::as_bytes(std::span(header)).first(kProxyFixedBytes));
  };
  EXPECT_EQ(*size_of(proxy_v4(9)), 28u);
  EXPECT_EQ(*size_of(proxy_header(0x20, 0, std::string(kMaxProxyBytes - kProxyFixedBytes, '\0'))),
            kMaxProxyBytes);
  const auto one_over =
      size_of(proxy_header(0x20, 0, std::string(kMaxProxyBytes - kProxyFixedBytes + 1, '\0')));
  ASSERT_FALSE(one_over);
  EXPECT_EQ(one_over.error().code, ErrorCode::LimitExceeded);
}

std::string client_of(std::string_view field) {
  const std::vector<AddressRange> proxies = {*parse_address_range("10.0.0.0/8"),
                                             *parse_address_range("fd00::/8")};
  const auto address = forwarded_client(field, proxies);
  return address ? address->to_string() : to_string(address.error().code);
}

TEST(ForwardedFor, TheLastAddressThatIsNoProxyOfOurs) {
  EXPECT_EQ(client_of("203.0.113.9"), "203.0.113.9");
  EXPECT_EQ(client_of(" 203.0.113.9\t"), "203.0.113.9");
  EXPECT_EQ(client_of("198.51.100.1, 203.0.113.9"), "203.0.113.9")
      << "the client may write what it likes first";
  EXPECT_EQ(client_of("203.0.113.9,10.0.0.1 , 10.255.0.2"), "203.0.113.9");
  EXPECT_EQ(client_of("198.51.100.1, 203.0.113.9, fd00::1"), "203.0.113.9");
  EXPECT_EQ(client_of("10.0.0.3, 10.0.0.2"), "10.0.0.3") << "all are ours: the first began";
  EXPECT_EQ(client_of("203.0.113.9:4711"), "203.0.113.9");
  EXPECT_EQ(client_of("2001:db8::7"), "2001:db8::7");
  EXPECT_EQ(client_of("[2001:db8::7]"), "2001:db8::7");
  EXPECT_EQ(client_of("[2001:db8::7]:4711"), "2001:db8::7");
  EXPECT_EQ(client_of("nonsense, , 203.0.113.9"), "203.0.113.9") << "nobody looks at what stands before";
}

TEST(ForwardedFor, RefusesWhatNamesNoAddress) {
  for (const char* field :
       {"", ",", "unknown", "_hidden", "203.0.113.9,", "203.0.113.9, unknown", "203.0.113",
        "203.0.113.9:", "203.0.113.9:x", "203.0.113.9:123456", "[203.0.113.9]", "[::1", "[::1]x",
        "[::1]:", "fe80::1%eth0", "nonsense, 10.0.0.1", "\"203.0.113.9\"", "for=203.0.113.9"})
    EXPECT_EQ(client_of(field), "bad input") << field;
}

TEST(ForwardedFor, FollowsAFewProxiesOnly) {
  std::string field = "203.0.113.9";
  for (size_t i = 1; i < kMaxForwardedHops; ++i) field += ",10.0.0.1";
  EXPECT_EQ(client_of(field), "203.0.113.9") << "at the limit";
  EXPECT_EQ(client_of(field + ",10.0.0.1"), "limit exceeded") << "one over";
}

}  // namespace
}  // namespace strandcast::proxy_test
