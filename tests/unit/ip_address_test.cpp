// Addresses and ranges of them, from text and bytes.
#include "server/net/ip_address.h"

#include <gtest/gtest.h>

namespace strandcast::ip_address_test {
namespace {

TEST(IpAddress, ReadsNumericTextOnly) {
  for (const char* text : {"0.0.0.0", "10.0.0.7", "255.255.255.255", "::", "::1", "2001:db8::1", "fe80::1"}) {
    const auto address = IpAddress::parse(text);
    ASSERT_TRUE(address) << text;
    EXPECT_EQ(address->to_string(), text);
  }
  for (const std::string& text :
       {std::string(), std::string("10.0.0"), std::string("10.0.0.256"), std::string("010.0.0.7"),
        std::string("10.0.0.7 "), std::string("10.0.0.7:80"), std::string("[::1]"),
        std::string("fe80::1%eth0"), std::string("localhost"), std::string("1::2::3"),
        std::string("10.0.0.7\0x", 10), std::string(1'000, '1')})
    EXPECT_FALSE(IpAddress::parse(text)) << text;
}

TEST(IpAddress, CountsMappedIpv4AsIpv4) {
  const auto mapped = IpAddress::parse("::ffff:10.0.0.7");
  ASSERT_TRUE(mapped);
  EXPECT_EQ(*mapped, *IpAddress::parse("10.0.0.7"));
  EXPECT_EQ(mapped->to_string(), "10.0.0.7");
  EXPECT_EQ(*mapped, IpAddress(IpAddress::Bytes4{10, 0, 0, 7}));
}

TEST(IpAddress, OneKeyForWhatIsAsEasilyHadAsOneAddress) {
  EXPECT_EQ(IpAddress::parse("10.0.0.7")->key(), "10.0.0.7");
  EXPECT_EQ(IpAddress::parse("2001:db8:1:2::7")->key(), "2001:db8:1:2::/64");
  EXPECT_EQ(IpAddress::parse("2001:db8:1:2:ffff::")->key(), "2001:db8:1:2::/64");
  EXPECT_NE(IpAddress::parse("2001:db8:1:3::7")->key(), "2001:db8:1:2::/64");
}

TEST(IpAddress, KnowsLoopback) {
  for (const char* text : {"127.0.0.1", "127.255.0.3", "::1", "::ffff:127.0.0.1"})
    EXPECT_TRUE(IpAddress::parse(text)->is_loopback()) << text;
  for (const char* text : {"128.0.0.1", "0.0.0.0", "::", "::2", "1::1"})
    EXPECT_FALSE(IpAddress::parse(text)->is_loopback()) << text;
}

bool is_within(const char* range, const char* address) {
  const auto parsed = parse_address_range(range);
  EXPECT_TRUE(parsed) << range;
  return parsed && parsed->contains(*IpAddress::parse(address));
}

TEST(AddressRange, ContainsWhatBeginsWithItsBits) {
  EXPECT_TRUE(is_within("10.0.0.7", "10.0.0.7"));
  EXPECT_FALSE(is_within("10.0.0.7", "10.0.0.6"));
  EXPECT_TRUE(is_within("10.0.0.0/8", "10.255.255.255"));
  EXPECT_FALSE(is_within("10.0.0.0/8", "11.0.0.0"));
  EXPECT_TRUE(is_within("10.0.0.4/30", "10.0.0.7"));
  EXPECT_FALSE(is_within("10.0.0.4/30", "10.0.0.8"));
  EXPECT_FALSE(is_within("10.0.0.4/30", "10.0.0.3"));
  EXPECT_TRUE(is_within("0.0.0.0/0", "203.0.113.9"));
  EXPECT_FALSE(is_within("0.0.0.0/0", "2001:db8::1")) << "another family";
  EXPECT_TRUE(is_within("2001:db8::/32", "2001:db8:ffff::1"));
  EXPECT_FALSE(is_within("2001:db8::/32", "2001:db9::"));
  EXPECT_TRUE(is_within("::/0", "2001:db8::1"));
  EXPECT_FALSE(is_within("::/0", "10.0.0.7"));
}

TEST(AddressRange, RefusesAllElse) {
  for (const char* text : {"", "/8", "10.0.0.0/", "10.0.0.0/33", "10.0.0.0/-1", "10.0.0.0/8x", "10.0.0.7/8",
                           "2001:db8::/129", "2001:db8::1/64", "proxy.example", "10.0.0.0/8/8"}) {
    const auto range = parse_address_range(text);
    ASSERT_FALSE(range) << text;
    EXPECT_NE(range.error().message.find(text), std::string::npos);
  }
}

}  // namespace
}  // namespace strandcast::ip_address_test
