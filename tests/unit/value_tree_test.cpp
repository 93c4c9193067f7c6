// Documents in JSON and CBOR. Expected values are those of RFC 8259 and of appendix A of RFC 8949.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/motion/value_tree.h"

namespace strandcast::value_tree_test {
namespace {

using testing::HasSubstr;

std::vector<std::byte> bytes_of(const std::vector<int>& numbers) {
  std::vector<std::byte> bytes;
  for (const int number : numbers) bytes.push_back(static_cast<std::byte>(number));
  return bytes;
}
std::string shown(const Result<ValueTree>& tree) {
  return tree ? write_json(*tree) : "error: " + tree.error().to_string();
}

TEST(ValueTree, ReadsEveryKindOfJson) {
  const auto tree = read_json(
      " { \"a\" : [1, -2.5e1, true, false, null, {}, []],\n\"b\":\"x\\n\\u00e9\\ud83d\\ude00/\\/\"}\t");
  ASSERT_TRUE(tree) << tree.error().to_string();
  ASSERT_NE(tree->find("a"), nullptr);
  const ValueTree::List& list = *tree->find("a")->list();
  ASSERT_EQ(list.size(), 7u);
  EXPECT_EQ(list[0].number(), 1.0);
  EXPECT_EQ(list[1].number(), -25.0);
  EXPECT_EQ(list[2].truth(), true);
  EXPECT_EQ(list[3].truth(), false);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(list[4].value));
  EXPECT_EQ(*tree->find("b")->text(), "x\n\xC3\xA9\xF0\x9F\x98\x80//");
  EXPECT_EQ(tree->find("c"), nullptr);
  EXPECT_EQ(list[0].find("a"), nullptr);
}

TEST(ValueTree, RefusesWhatIsNoJson) {
  for (const char* text :
       {"",         " ",        "{",         "[",           "\"",          "{\"a\"}",
        "{\"a\":}", "{a:1}",    "[1,]",      "[1 2]",       "{\"a\":1,}",  "01",
        "+1",       ".5",       "1.e",       "- 1",         "nul",         "tru",
        "1 1",      "\"\\x\"",  "\"\\u12\"", "\"\\ud83d\"", "\"\\udc00\"", "\"\\ud83d\\u0041\"",
        "\"\x01\"", "\"\xC3\"", "NaN",       "Infinity",    "1e999",       "\"\\"})
    EXPECT_FALSE(read_json(text)) << text;
  EXPECT_EQ(read_json("[1,]").error().place, "byte 3");
}

TEST(ValueTree, ReadsTheExamplesOfCbor) {
  const auto json_of = [](const std::vector<int>& bytes) { return shown(read_cbor(bytes_of(bytes))); };
  EXPECT_EQ(json_of({0x00}), "0");
  EXPECT_EQ(json_of({0x18, 0x64}), "100");
  EXPECT_EQ(json_of({0x1a, 0x00, 0x0f, 0x42, 0x40}), "1000000");
  EXPECT_EQ(json_of({0x39, 0x03, 0xe7}), "-1000");
  EXPECT_EQ(json_of({0xf9, 0x3e, 0x00}), "1.5");
  EXPECT_EQ(json_of({0xf9, 0xc4, 0x00}), "-4");
  EXPECT_EQ(json_of({0xf9, 0x00, 0x01}), "5.960464477539063e-08");
  EXPECT_EQ(json_of({0xf9, 0x7c, 0x00}), "null") << "infinity, which JSON has not";
  EXPECT_EQ(json_of({0xfa, 0x47, 0xc3, 0x50, 0x00}), "100000");
  EXPECT_EQ(json_of({0xfb, 0x3f, 0xf1, 0x99, 0x99, 0x99, 0x99, 0x99, 0x9a}), "1.1");
  EXPECT_EQ(json_of({0xf4}), "false");
  EXPECT_EQ(json_of({0xf5}), "true");
  EXPECT_EQ(json_of({0xf6}), "null");
  EXPECT_EQ(json_of({0x62, 0xc3, 0xbc}), "\"\xC3\xBC\"");
  EXPECT_EQ(json_of({0x83, 0x01, 0x82, 0x02, 0x03, 0x82, 0x04, 0x05}), "[1,[2,3],[4,5]]");
  EXPECT_EQ(json_of({0xbf, 0x61, 0x61, 0x01, 0x61, 0x62, 0x9f, 0x02, 0x03, 0xff, 0xff}),
            "{\"a\":1,\"b\":[2,3]}");
  EXPECT_EQ(json_of({0x7f, 0x65, 0x73, 0x74, 0x72, 0x65, 0x61, 0x64, 0x6d, 0x69, 0x6e, 0x67, 0xff}),
            "\"streaming\"");
  EXPECT_EQ(json_of({0xc1, 0x1a, 0x51, 0x4b, 0x67, 0xb0}), "1363896240") << "a tag is left out";
  EXPECT_EQ(json_of({0x44, 0x01, 0x02, 0x03, 0x04}), "null") << "bytes";
}

TEST(ValueTree, RefusesWhatIsNoCbor) {
  for (const std::vector<int>& bytes :
       std::vector<std::vector<int>>{{},
                                     {0x18},
                                     {0x1c},
                                     {0x61},
                                     {0x62, 0x61},
                                     {0x61, 0xff},
                                     {0x81},
                                     {0x9f, 0x01},
                                     {0xa1, 0x61, 0x61},
                                     {0xff},
                                     {0x5f, 0x61, 0x61, 0xff},
                                     {0x7f, 0x7f, 0xff, 0xff},
                                     {0x00, 0x00},
                                     {0x9b, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff},
                                     {0x7b, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff}})
    EXPECT_FALSE(read_cbor(bytes_of(bytes)));
}

TEST(ValueTree, DepthAndNumberAreBounded) {
  const auto nested = [](size_t lists) { return std::string(lists, '[') + std::string(lists, ']'); };
  const auto deep = [](size_t lists) { return std::vector<std::byte>(lists, std::byte{0x81}); };
  EXPECT_TRUE(read_json(nested(kMaxTreeDepth)));
  EXPECT_EQ(read_json(nested(kMaxTreeDepth + 1)).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(read_json(std::string(60'000, '[')).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(read_cbor(deep(60'000)).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(read_cbor(std::vector<std::byte>(60'000, std::byte{0xC1})).error().code,
            ErrorCode::LimitExceeded);
  std::string many = "[0";
  for (size_t i = 2; i < kMaxTreeValues; ++i) many += ",0";
  EXPECT_TRUE(read_json(many + "]")) << "with the list itself";
  EXPECT_EQ(read_json(many + ",0]").error().code, ErrorCode::LimitExceeded);
}

TEST(ValueTree, ComesBackAsItWasWritten) {
  ValueTree::Map map;
  map.emplace_back("quote \" and \\ and \x01", ValueTree{std::string("\xC3\xA9\n")});
  ValueTree::List numbers;
  for (const double number : {0.0, -0.0, 1.0, -1.0, 23.0, 24.0, -24.0, -25.0, 255.0, 256.0, 65'536.0,
                              4294967296.0, 0.1, -1e300, 5e-324, 9007199254740993.0})
    numbers.push_back({number});
  map.emplace_back("numbers", ValueTree{numbers});
  map.emplace_back("others", ValueTree{ValueTree::List{{true}, {false}, {}}});
  const ValueTree tree{map};
  const auto of_json = read_json(write_json(tree));
  const auto of_cbor = read_cbor(write_cbor(tree));
  ASSERT_TRUE(of_json) << of_json.error().to_string();
  ASSERT_TRUE(of_cbor) << of_cbor.error().to_string();
  for (const ValueTree* found : {&*of_json, &*of_cbor}) {
    EXPECT_EQ(write_json(*found), write_json(tree));
    const ValueTree::List& back = *found->find("numbers")->list();
    for (size_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(back[i].number(), numbers[i].number()) << i;
    EXPECT_TRUE(std::signbit(*back[1].number()));
  }
}

/// Whatever the bytes are, they are read to their end or refused.
TEST(ValueTree, DamageGivesAnErrorOrATree) {
  std::mt19937 random(7);
  const auto json =
      write_json({ValueTree::Map{{"a", {ValueTree::List{{1.5}, {std::string("text")}, {true}}}}}});
  const auto cbor = write_cbor(*read_json(json));
  int refused = 0;
  for (int i = 0; i < 5'000; ++i) {
    std::string text = json;
    auto bytes = cbor;
    for (int change = 0; change < 3; ++change) {
      text[random() % text.size()] = static_cast<char>(random());
      bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    }
    const auto from_text = read_json(text), from_bytes = read_cbor(bytes);
    refused += (from_text ? 0 : 1) + (from_bytes ? 0 : 1);
    if (from_text) {
      EXPECT_TRUE(read_json(write_json(*from_text)));
    }
  }
  EXPECT_GT(refused, 5'000);
}

}  // namespace
}  // namespace strandcast::value_tree_test
