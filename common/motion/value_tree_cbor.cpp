// CBOR of a ValueTree.
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/base/text.h"
#include "common/motion/value_tree_private.h"

namespace strandcast {
namespace {

// ---- CBOR: a byte of major type (three bits) and argument (five, or as many bytes as they say)

enum CborMajor : uint8_t {
  kUnsigned = 0,
  kNegative = 1,
  kBytes = 2,
  kText = 3,
  kArray = 4,
  kMap = 5,
  kTag = 6,
  kSimple = 7
};
enum CborSimple : uint8_t { kFalse = 20, kTrue = 21, kHalf = 25, kSingle = 26, kDouble = 27 };
constexpr uint8_t kOneByteFollows = 24;
constexpr uint8_t kIndefinite = 31;
constexpr std::byte kCborBreak{0xFF};

double half_of(uint64_t bits) {
  const int exponent = static_cast<int>(bits >> 10 & 0x1F);
  const auto mantissa = static_cast<double>(bits & 0x3FF);
  double number = 0.0;
  if (exponent == 0)
    number = std::ldexp(mantissa, -24);
  else if (exponent == 31)
    number =
        mantissa == 0.0 ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
  else
    number = std::ldexp(mantissa + 1024.0, exponent - 25);
  return (bits >> 15) != 0 ? -number : number;
}

class CborReader {
 public:
  explicit CborReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  Result<ValueTree> read() {
    ASSIGN_OR_RETURN(ValueTree tree, read_value(1));
    if (at_ != bytes_.size()) return tree_error(at_, "something stands behind the document");
    return tree;
  }

 private:
  struct Head {
    uint8_t major = 0;
    uint8_t info = 0;
    uint64_t argument = 0;
    bool is_indefinite = false;
  };

  Result<Head> read_head() {
    const size_t begin = at_;
    if (at_ >= bytes_.size()) return tree_error(at_, "the document is cut");
    const auto first = std::to_integer<uint8_t>(bytes_[at_++]);
    Head head{static_cast<uint8_t>(first >> 5), static_cast<uint8_t>(first & 0x1F), 0, false};
    head.argument = head.info;
    if (head.info < kOneByteFollows) return head;
    if (head.info == kIndefinite) {
      head.is_indefinite = head.major >= kBytes && head.major <= kMap;
      if (!head.is_indefinite) return tree_error(begin, "an end of what did not begin");
      return head;
    }
    if (head.info > kDouble) return tree_error(begin, "a length that CBOR has not");
    const size_t count = size_t{1} << (head.info - kOneByteFollows);
    if (bytes_.size() - at_ < count) return tree_error(begin, "the document is cut");
    head.argument = 0;
    for (size_t i = 0; i < count; ++i)
      head.argument = head.argument << 8 | std::to_integer<uint8_t>(bytes_[at_++]);
    return head;
  }

  bool take_break() {
    if (at_ >= bytes_.size() || bytes_[at_] != kCborBreak) return false;
    ++at_;
    return true;
  }

  Result<ValueTree> read_value(size_t depth) {
    RETURN_IF_ERROR(budget_.take(depth));
    ASSIGN_OR_RETURN(const Head head, read_head());
    switch (head.major) {
      case kUnsigned:
        return ValueTree{static_cast<double>(head.argument)};
      case kNegative:
        return ValueTree{-1.0 - static_cast<double>(head.argument)};
      case kBytes: {
        RETURN_IF_ERROR(read_text(head));
        return ValueTree{};
      }
      case kText: {
        ASSIGN_OR_RETURN(std::string text, read_text(head));
        for (size_t i = 0; i < text.size();) {
          const size_t bytes = utf8_length(text, i);
          if (bytes == 0) return tree_error(at_, "a byte that no text has");
          i += bytes;
        }
        return ValueTree{std::move(text)};
      }
      case kArray:
        return read_list(head, depth);
      case kMap:
        return read_map(head, depth);
      case kTag:
        return read_value(depth + 1);
      default:
        return read_simple(head);
    }
  }

  static ValueTree read_simple(const Head& head) {
    if (head.info == kFalse || head.info == kTrue) return ValueTree{head.info == kTrue};
    if (head.info == kHalf) return ValueTree{half_of(head.argument)};
    if (head.info == kSingle)
      return ValueTree{static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(head.argument)))};
    if (head.info == kDouble) return ValueTree{std::bit_cast<double>(head.argument)};
    return ValueTree{};
  }

  /// Bytes of a text, in one piece or in several up to a break.
  Result<std::string> read_text(const Head& head) {
    std::string text;
    if (!head.is_indefinite) return append_piece(text, head) ? Result(text) : cut_text();
    while (!take_break()) {
      ASSIGN_OR_RETURN(const Head piece, read_head());
      if (piece.major != head.major || piece.is_indefinite)
        return tree_error(at_, "a piece of a text that is none");
      if (!append_piece(text, piece)) return cut_text();
    }
    return text;
  }
  Error cut_text() const { return tree_error(at_, "a text is longer than the document"); }
  bool append_piece(std::string& text, const Head& piece) {
    if (piece.argument > bytes_.size() - at_) return false;
    const auto size = static_cast<size_t>(piece.argument);
    text.append(reinterpret_cast<const char*>(bytes_.data()) + at_, size);
    at_ += size;
    return true;
  }

  /// True where a list or map ends that has had `count` items.
  bool is_over(const Head& head, uint64_t count) {
    return head.is_indefinite ? take_break() : count == head.argument;
  }

  Result<ValueTree> read_list(const Head& head, size_t depth) {
    ValueTree::List list;
    while (!is_over(head, list.size())) {
      ASSIGN_OR_RETURN(ValueTree value, read_value(depth + 1));
      list.push_back(std::move(value));
    }
    return ValueTree{std::move(list)};
  }

  Result<ValueTree> read_map(const Head& head, size_t depth) {
    ValueTree::Map map;
    while (!is_over(head, map.size())) {
      ASSIGN_OR_RETURN(const ValueTree key, read_value(depth + 1));
      ASSIGN_OR_RETURN(ValueTree value, read_value(depth + 1));
      // A key that is no text has no name here.
      map.emplace_back(key.text() != nullptr ? *key.text() : std::string(), std::move(value));
    }
    return ValueTree{std::move(map)};
  }

  std::span<const std::byte> bytes_;
  size_t at_ = 0;
  TreeBudget budget_;
};

class CborWriter {
 public:
  void put(const ValueTree& tree) {
    if (const auto number = tree.number()) return put_number(*number);
    if (const auto truth = tree.truth()) return put_head(kSimple, *truth ? kTrue : kFalse);
    if (tree.text() != nullptr) return put_text(*tree.text());
    if (const auto* list = tree.list()) {
      put_head(kArray, list->size());
      for (const ValueTree& value : *list) put(value);
    } else if (const auto* map = std::get_if<ValueTree::Map>(&tree.value)) {
      put_head(kMap, map->size());
      for (const auto& [key, value] : *map) {
        put_text(key);
        put(value);
      }
    } else {
      constexpr uint8_t kNull = 22;
      put_head(kSimple, kNull);
    }
  }
  std::vector<std::byte> take() && { return std::move(bytes_); }

 private:
  void put_big_endian(uint64_t number, size_t count) {
    for (size_t i = count; i-- > 0;) bytes_.push_back(static_cast<std::byte>(number >> (8 * i)));
  }
  void put_head(CborMajor major, uint64_t argument) {
    const auto put_first = [&](uint64_t info) {
      bytes_.push_back(static_cast<std::byte>(static_cast<uint64_t>(major) << 5 | info));
    };
    if (argument < kOneByteFollows) return put_first(argument);
    const int power = argument <= 0xFF ? 0 : argument <= 0xFFFF ? 1 : argument <= 0xFFFF'FFFF ? 2 : 3;
    put_first(kOneByteFollows + static_cast<uint64_t>(power));
    put_big_endian(argument, size_t{1} << power);
  }
  void put_text(std::string_view text) {
    put_head(kText, text.size());
    for (const char letter : text) bytes_.push_back(static_cast<std::byte>(letter));
  }
  void put_number(double number) {
    constexpr double kMostWhole = 9e15;  // below it a double tells every whole number
    const bool is_whole = std::abs(number) < kMostWhole && number == std::floor(number) &&
                          !(number == 0.0 && std::signbit(number));
    if (is_whole && number >= 0.0) return put_head(kUnsigned, static_cast<uint64_t>(number));
    if (is_whole) return put_head(kNegative, static_cast<uint64_t>(-1.0 - number));
    bytes_.push_back(static_cast<std::byte>(kSimple << 5 | kDouble));
    put_big_endian(std::bit_cast<uint64_t>(number), sizeof(double));
  }

  std::vector<std::byte> bytes_;
};

}  // namespace

Result<ValueTree> read_cbor(std::span<const std::byte> bytes) {
  return CborReader(bytes).read();
}

std::vector<std::byte> write_cbor(const ValueTree& tree) {
  CborWriter writer;
  writer.put(tree);
  return std::move(writer).take();
}

}  // namespace strandcast
