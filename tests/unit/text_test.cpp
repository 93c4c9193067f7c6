#include "common/base/text.h"
#include "common/base/base64.h"

namespace strandcast::text_test {
namespace {

/// By the table of RFC 3629, section 3.
std::string utf8(char32_t code) {
  const auto byte = [](char32_t value) { return static_cast<char>(value); };
  if (code < 0x80) return {byte(code)};
  if (code < 0x800) return {byte(0xc0 | code >> 6), byte(0x80 | (code & 0x3f))};
  if (code < 0x10000)
    return {byte(0xe0 | code >> 12), byte(0x80 | (code >> 6 & 0x3f)), byte(0x80 | (code & 0x3f))};
  return {byte(0xf0 | code >> 18), byte(0x80 | (code >> 12 & 0x3f)), byte(0x80 | (code >> 6 & 0x3f)),
          byte(0x80 | (code & 0x3f))};
}

TEST(Text, EveryCharacterOfUnicodeHasItsLengthAndSurrogatesHaveNone) {
  for (char32_t code = 0; code < 0x120000; code += code < 0x12000 ? 1 : 97) {
    const std::string text = utf8(code);
    const bool is_character = code <= 0x10ffff && (code < 0xd800 || code > 0xdfff);
    ASSERT_EQ(utf8_length(text, 0), is_character ? text.size() : 0) << static_cast<uint32_t>(code);
    for (size_t cut = 1; cut < text.size(); ++cut)
      ASSERT_EQ(utf8_length(text.substr(0, cut), 0), 0u) << static_cast<uint32_t>(code);
  }
  for (const char* overlong : {"\xc0\x80", "\xc1\xbf", "\xe0\x9f\xbf", "\xf0\x8f\xbf\xbf"})
    EXPECT_EQ(utf8_length(overlong, 0), 0u);
}

TEST(Text, Base64ComesBackAndNothingElseIsRead) {
  std::vector<std::byte> bytes;
  for (size_t size = 0; size < 70; ++size) {
    EXPECT_EQ(from_base64(base64_of(bytes)), bytes) << size;
    bytes.push_back(static_cast<std::byte>(7 * size * size + 251));
  }
  for (const char* bad :
       {"Q", "QQ", "QQ=", "QQ===", "QQ=x", "QR==", "Q Q=", "QUI", "QUJD=", "QUJ\n", "=", "QUJD\xff"})
    EXPECT_FALSE(from_base64(bad)) << bad;
}

TEST(Text, IsPrintableWithoutControlsAndBrokenBytes) {
  for (const char* good : {"", "abc", "Zoë 髪 \U0001f488", "\u202e"}) EXPECT_TRUE(is_printable(good)) << good;
  for (const char* bad : {"a\n", "\x1b[2J", "\x7f", "\xff", "caf\xc3", "\xed\xa0\x80"})
    EXPECT_FALSE(is_printable(bad)) << bad;
}

TEST(Text, PrintableReplacesWhatIsNotAndCountsCharacters) {
  EXPECT_EQ(printable("a\tb\xff"
                      "c",
                      10),
            "a b?c");
  EXPECT_EQ(printable("éèê", 2), "éè");
  EXPECT_EQ(printable("\u202e", 2), "\u202e");
  EXPECT_EQ(printable("abc", 0), "");
}

TEST(Text, ExcerptsSayThatThereIsMore) {
  EXPECT_EQ(excerpt("abc", 3), "abc");
  EXPECT_EQ(excerpt("abcd", 3), "abc...");
  EXPECT_EQ(excerpt("éè\n", 2), "éè...");
}

TEST(Text, OneLineShowsNothingThatActsOnATerminal) {
  EXPECT_EQ(one_line("Zoë 髪 \U0001f488", 64), "Zoë 髪 \U0001f488");
  // CSI as one C1 control, right-to-left override, line separator, zero-width space, a tag.
  EXPECT_EQ(one_line("a\xc2\x9b"
                     "2Jb\u202ec\u2028d\u200be\U000e0041f",
                     64),
            "a?2Jb?c?d?e?f");
  EXPECT_EQ(one_line("line\r\nbreak\x1b[0m\xff", 64), "line  break [0m?");
  EXPECT_EQ(one_line("abcdef", 3), "abc");
  // Every character of the categories Cc and Cf that texts of attackers are known to use.
  for (const char32_t code : {0x80, 0x85, 0x9f, 0xad, 0x61c, 0x200e, 0x200f, 0x202a, 0x202d, 0x2066, 0x2069,
                              0xfeff, 0xfff9, 0xe0001, 0xe007f})
    EXPECT_EQ(one_line(utf8(code), 4), "?") << static_cast<uint32_t>(code);
  for (const char32_t code : {0xa0, 0xac, 0xae, 0x2027, 0x202f, 0x205f, 0x2070, 0xfffd})
    EXPECT_EQ(one_line(utf8(code), 4), utf8(code)) << static_cast<uint32_t>(code);
}

}  // namespace
}  // namespace strandcast::text_test
