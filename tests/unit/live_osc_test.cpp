// OSC. Packets are written by tests/support/live_packets.h from its specification.
#include "server/input/live/osc_reader.h"
#include "tests/support/live_packets.h"

namespace strandcast::live_osc_test {
namespace {

using test::osc;
using test::osc_bundle;
using test::PacketBytes;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr uint32_t kUsualLimit = 1500;

/// The two messages whose bytes stand in the OSC 1.0 specification, "OSC Message Examples".
PacketBytes specified_oscillator() {
  return test::PacketWriter(std::endian::big)
      .text(std::string("/oscillator/4/frequency\0,f\0\0\x43\xdc\0\0", 32))
      .bytes();
}
PacketBytes specified_foo() {
  return test::PacketWriter(std::endian::big)
      .text(std::string(
          "/foo\0\0\0\0,iisff\0\0\0\0\x03\xe8\xff\xff\xff\xffhello\0\0\0\x3f\x9d\xf3\xb6\x40\xb5\xb2\x2d",
          40))
      .bytes();
}

TEST(OscReader, ReadsTheExamplesOfItsSpecification) {
  const PacketBytes oscillator = specified_oscillator();
  const auto one = read_osc(oscillator, kUsualLimit);
  ASSERT_TRUE(one) << one.error().to_string();
  ASSERT_EQ(one->messages.size(), 1u);
  EXPECT_FALSE(one->is_bundle);
  EXPECT_EQ(one->messages[0].address, "/oscillator/4/frequency");
  EXPECT_EQ(OscArguments(one->messages[0]).take_float(), 440.0f);

  const PacketBytes foo = specified_foo();
  const auto other = read_osc(foo, kUsualLimit);
  ASSERT_TRUE(other) << other.error().to_string();
  OscArguments arguments(other->messages.at(0));
  EXPECT_EQ(arguments.take_int(), 1000);
  EXPECT_EQ(arguments.take_int(), -1);
  EXPECT_EQ(arguments.take_string(), "hello");
  EXPECT_EQ(arguments.take_float(), 1.234f);
  EXPECT_EQ(arguments.take_float(), 5.678f);
  EXPECT_TRUE(arguments.ok());
  EXPECT_EQ(arguments.take_int(), std::nullopt);
  EXPECT_FALSE(arguments.ok());
  EXPECT_EQ(foo, osc("/foo", {1000, -1, std::string("hello"), 1.234f, 5.678f})) << "the tests' own writer";
}

TEST(OscReader, UnfoldsBundlesInOrder) {
  const PacketBytes packet =
      osc_bundle({osc("/a", {1}), osc_bundle({osc("/b", {2}), osc("/c", {3})}), osc("/d", {4})});
  const auto read = read_osc(packet, kUsualLimit);
  ASSERT_TRUE(read) << read.error().to_string();
  EXPECT_TRUE(read->is_bundle);
  std::vector<std::string_view> addresses;
  for (const OscMessage& message : read->messages) addresses.push_back(message.address);
  EXPECT_THAT(addresses, ElementsAre("/a", "/b", "/c", "/d"));
}

// A string of four letters has four NULs behind it: some readers expect none (SharpOSC #11).
TEST(OscReader, KeepsPaddingOfStringsApart) {
  for (const std::string text : {"", "a", "abc", "four", "abcde", "eightlet"}) {
    const PacketBytes packet = osc("/" + text, {text, 7});
    const auto read = read_osc(packet, kUsualLimit);
    ASSERT_TRUE(read) << text << ": " << read.error().to_string();
    OscArguments arguments(read->messages.at(0));
    EXPECT_EQ(arguments.take_string(), text);
    EXPECT_EQ(arguments.take_int(), 7) << text;
  }
}

PacketBytes nested(int depth) {
  PacketBytes packet = osc("/x", {});
  for (int i = 0; i < depth; ++i) packet = osc_bundle({packet});
  return packet;
}

TEST(OscReader, HoldsItsLimits) {
  EXPECT_TRUE(read_osc(nested(kMaxOscBundleDepth), kUsualLimit));
  const auto deep = read_osc(nested(kMaxOscBundleDepth + 1), kUsualLimit);
  ASSERT_FALSE(deep);
  EXPECT_EQ(deep.error().code, ErrorCode::LimitExceeded);
  EXPECT_THAT(deep.error().message, HasSubstr("more than 4 bundles"));

  const std::vector<PacketBytes> most(kMaxOscBundleElements, osc("/", {}));
  EXPECT_TRUE(read_osc(osc_bundle(most), kMaxDatagramBytes));
  std::vector<PacketBytes> more = most;
  more.push_back(osc("/", {}));
  const auto many = read_osc(osc_bundle(more), kMaxDatagramBytes);
  ASSERT_FALSE(many);
  EXPECT_THAT(many.error().message, HasSubstr("more than 256 elements"));

  const PacketBytes large = osc("/large", {std::string(kUsualLimit, 'x')});
  EXPECT_THAT(read_osc(large, kUsualLimit).error().message, HasSubstr("the limit is 1500"));
  EXPECT_TRUE(read_osc(large, static_cast<uint32_t>(large.size())));
  EXPECT_FALSE(read_osc(large, static_cast<uint32_t>(large.size() - 1)));
}

/// A message with these tags and these bytes behind them.
PacketBytes raw_message(const std::string& tags, std::initializer_list<uint8_t> arguments) {
  test::PacketWriter writer(std::endian::big);
  writer.text_with_nul("/raw").fill_to_multiple_of(4).text_with_nul("," + tags).fill_to_multiple_of(4);
  for (const uint8_t byte : arguments) writer.put(byte);
  return writer.bytes();
}

TEST(OscReader, BelievesNoSizeFromOutside) {
  // A blob that says that it is larger than the packet (csound #2682, LuminosusEos #12), or so large that its
  // padding comes round to nothing.
  EXPECT_THAT(read_osc(raw_message("b", {0, 0, 0, 9, 1, 2, 3, 4}), kUsualLimit).error().message,
              HasSubstr("ends within its arguments"));
  EXPECT_FALSE(read_osc(raw_message("b", {0xff, 0xff, 0xff, 0xff}), kUsualLimit));
  EXPECT_FALSE(read_osc(raw_message("bi", {0xff, 0xff, 0xff, 0xfd, 0, 0, 0, 1}), kUsualLimit));
  EXPECT_TRUE(read_osc(raw_message("b", {0, 0, 0, 3, 1, 2, 3, 0}), kUsualLimit));
  EXPECT_FALSE(read_osc(raw_message("b", {0, 0, 0}), kUsualLimit));
  // Arguments that are not there, or more than their list says.
  EXPECT_FALSE(read_osc(raw_message("ff", {0, 0, 0, 0}), kUsualLimit));
  EXPECT_THAT(read_osc(raw_message("f", {0, 0, 0, 0, 0, 0, 0, 0}), kUsualLimit).error().message,
              HasSubstr("4 bytes behind its last argument"));
  // A string without end.
  EXPECT_FALSE(read_osc(raw_message("s", {'a', 'b', 'c', 'd'}), kUsualLimit));
  // An element larger than its bundle, of no size, and of a size that is no multiple of four.
  for (const uint32_t size : {9u, 0u, 0xfffffffcu, 0x80000000u, 3u}) {
    test::PacketWriter bundle(std::endian::big);
    bundle.text_with_nul("#bundle").put(uint64_t{1}).put(size).append(osc("/a", {}));
    EXPECT_FALSE(read_osc(bundle.bytes(), kUsualLimit)) << size;
  }
  // "#bundle" without its NUL (QOsc #2), and other beginnings.
  for (const std::string text : {"#bundle!\0\0\0\0\0\0\0\1", "#bundle", "#bun", "bundle\0\0", "\0\0\0\0"}) {
    test::PacketWriter packet(std::endian::big);
    EXPECT_FALSE(read_osc(packet.text(text).fill_to_multiple_of(4).bytes(), kUsualLimit)) << text;
  }
  EXPECT_FALSE(read_osc({}, kUsualLimit));
}

TEST(OscReader, RefusesEveryPacketThatIsCut) {
  const PacketBytes whole = osc_bundle({specified_foo(), osc_bundle({specified_oscillator()})});
  ASSERT_TRUE(read_osc(whole, kUsualLimit));
  const size_t first_end = 16 + 4 + specified_foo().size();
  for (size_t size = 0; size < whole.size(); ++size) {
    const bool ends_with_an_element = size == 16 || size == first_end;
    EXPECT_EQ(read_osc(std::span(whole).first(size), kUsualLimit).ok(), ends_with_an_element) << size;
  }
}

TEST(OscReader, LeavesOutWhatNobodyKnows) {
  const PacketBytes packet = osc_bundle({raw_message("Q", {1, 2, 3, 4}), osc("/known", {1})});
  const auto read = read_osc(packet, kUsualLimit);
  ASSERT_TRUE(read) << read.error().to_string();
  EXPECT_EQ(read->unknown_tags, 1u);
  ASSERT_EQ(read->messages.size(), 1u);
  EXPECT_EQ(read->messages[0].address, "/known");
}

}  // namespace
}  // namespace strandcast::live_osc_test
