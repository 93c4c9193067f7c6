#include "common/groom/usdc_coding.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <unordered_map>

namespace strandcast {
namespace {

// LZ4's block format (lz4_Block_format.md): a token of two lengths, literals, the distance of a match.
constexpr size_t kLeastMatch = 4, kMostDistance = 65'535;
constexpr size_t kLastLiterals = 5, kLastMatchBefore = 12;  // how a block has to end
constexpr size_t kMostExpansion = 255;                      // bytes from one packed byte
constexpr uint8_t kLongLength = 15, kLongByte = 255;
constexpr int kSlotBits = 12;

uint32_t word_at(std::span<const std::byte> bytes, size_t at) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof(word));
  return word;
}

void put_length(std::string& packed, size_t length) {
  if (length < kLongLength) return;
  for (length -= kLongLength; length >= kLongByte; length -= kLongByte)
    packed += static_cast<char>(kLongByte);
  packed += static_cast<char>(length);
}

/// Appends literals and, where `match` is not 0, a match of so many bytes.
void put_sequence(std::string& packed, std::span<const std::byte> literals, size_t distance, size_t match) {
  const size_t more = match == 0 ? 0 : match - kLeastMatch;
  packed += static_cast<char>(std::min<size_t>(literals.size(), kLongLength) << 4 |
                              std::min<size_t>(more, kLongLength));
  put_length(packed, literals.size());
  packed.append(reinterpret_cast<const char*>(literals.data()), literals.size());
  if (match == 0) return;
  packed += static_cast<char>(distance & 0xff);
  packed += static_cast<char>(distance >> 8);
  put_length(packed, more);
}

/// Reads one block of LZ4 and appends what it holds.
class BlockReader {
 public:
  BlockReader(std::span<const std::byte> block, size_t limit_bytes) : block_(block), limit_(limit_bytes) {}

  /// Returns whether the block is sound and the bytes are at most as many as the limit.
  bool append_to(std::vector<std::byte>& bytes) {
    const size_t begin = bytes.size();
    while (at_ < block_.size()) {
      const auto token = static_cast<uint8_t>(block_[at_++]);
      const size_t literals = length(token >> 4);
      if (literals > block_.size() - at_ || literals > limit_ - bytes.size()) return false;
      bytes.insert(bytes.end(), block_.begin() + static_cast<ptrdiff_t>(at_),
                   block_.begin() + static_cast<ptrdiff_t>(at_ + literals));
      at_ += literals;
      if (at_ == block_.size()) return true;
      if (block_.size() - at_ < 2) return false;
      const size_t distance = static_cast<size_t>(block_[at_]) | static_cast<size_t>(block_[at_ + 1]) << 8;
      at_ += 2;
      const size_t match = length(token & kLongLength) + kLeastMatch;
      if (distance == 0 || distance > bytes.size() - begin || match > limit_ - bytes.size()) return false;
      for (size_t i = 0; i < match; ++i) bytes.push_back(bytes[bytes.size() - distance]);
    }
    return false;  // a block ends with literals
  }

 private:
  size_t length(size_t first) {
    if (first < kLongLength) return first;
    for (size_t sum = first; at_ < block_.size();) {
      const auto more = static_cast<uint8_t>(block_[at_++]);
      sum += more;
      if (more < kLongByte) return sum;
    }
    return block_.size() * kMostExpansion;  // more than there is
  }

  const std::span<const std::byte> block_;
  const size_t limit_;
  size_t at_ = 0;
};

/// The difference that most numbers have to the one before.
int32_t common_difference(std::span<const int32_t> differences) {
  std::unordered_map<int32_t, size_t> count;
  int32_t common = 0;
  for (const int32_t difference : differences)
    if (++count[difference] > count[common]) common = difference;
  return common;
}

/// Bytes of a difference with this code; 0 for the common one.
constexpr std::array<size_t, 4> kCodeBytes = {0, 1, 2, 4};

size_t code_of(int32_t difference, int32_t common) {
  if (difference == common) return 0;
  if (difference == static_cast<int8_t>(difference)) return 1;
  return difference == static_cast<int16_t>(difference) ? 2 : 3;
}

}  // namespace

std::string pack_usdc_bytes(std::span<const std::byte> bytes) {
  std::string packed(1, '\0');                         // one block follows
  std::vector<uint32_t> seen(size_t{1} << kSlotBits);  // where four bytes were last seen, from 1
  size_t literal = 0;
  for (size_t i = 0; i + kLastMatchBefore < bytes.size();) {
    const uint32_t word = word_at(bytes, i);
    uint32_t& slot = seen[word * 2654435761u >> (32 - kSlotBits)];
    const size_t before = slot;
    slot = static_cast<uint32_t>(i + 1);
    if (before == 0 || i + 1 - before > kMostDistance || word_at(bytes, before - 1) != word) {
      ++i;
      continue;
    }
    size_t match = kLeastMatch;
    while (i + match + kLastLiterals < bytes.size() && bytes[before - 1 + match] == bytes[i + match]) ++match;
    put_sequence(packed, bytes.subspan(literal, i - literal), i + 1 - before, match);
    i += match;
    literal = i;
  }
  put_sequence(packed, bytes.subspan(literal), 0, 0);
  return packed;
}

Result<std::vector<std::byte>> unpack_usdc_bytes(std::span<const std::byte> packed, size_t limit_bytes) {
  const Error damaged = make_error(ErrorCode::BadInput, "{} packed bytes are damaged, or more than {} bytes",
                                   packed.size(), limit_bytes);
  if (packed.empty()) return damaged;
  const auto block_count = static_cast<size_t>(packed[0]);
  packed = packed.subspan(1);
  std::vector<std::byte> bytes;
  bytes.reserve(std::min(limit_bytes, packed.size() * kMostExpansion));
  if (block_count == 0) {
    if (!BlockReader(packed, limit_bytes).append_to(bytes)) return damaged;
    return bytes;
  }
  for (size_t i = 0; i < block_count; ++i) {
    if (packed.size() < sizeof(uint32_t)) return damaged;
    const size_t size = word_at(packed, 0);
    packed = packed.subspan(sizeof(uint32_t));
    if (size > packed.size() || !BlockReader(packed.first(size), limit_bytes).append_to(bytes))
      return damaged;
    packed = packed.subspan(size);
  }
  return bytes;
}

std::string pack_usdc_ints(std::span<const int32_t> numbers) {
  std::vector<int32_t> differences;
  uint32_t before = 0;
  for (const int32_t number : numbers) {
    differences.push_back(static_cast<int32_t>(static_cast<uint32_t>(number) - before));
    before = static_cast<uint32_t>(number);
  }
  const int32_t common = common_difference(differences);
  const size_t codes_at = sizeof(common), code_bytes = (numbers.size() + 3) / 4;
  std::vector<std::byte> bytes(codes_at + code_bytes);
  std::memcpy(bytes.data(), &common, sizeof(common));
  for (size_t i = 0; i < differences.size(); ++i) {
    const size_t code = code_of(differences[i], common);
    bytes[codes_at + i / 4] |= static_cast<std::byte>(code << 2 * (i % 4));
    const auto* const raw = reinterpret_cast<const std::byte*>(&differences[i]);
    bytes.insert(bytes.end(), raw, raw + kCodeBytes[code]);
  }
  return pack_usdc_bytes(bytes);
}

Result<std::vector<int32_t>> unpack_usdc_ints(std::span<const std::byte> packed, size_t count) {
  const size_t codes_at = sizeof(int32_t), code_bytes = (count + 3) / 4;
  ASSIGN_OR_RETURN(const std::vector<std::byte> bytes,
                   unpack_usdc_bytes(packed, codes_at + code_bytes + count * sizeof(int32_t)));
  const Error cut = make_error(ErrorCode::BadInput, "{} bytes hold no {} numbers", bytes.size(), count);
  if (bytes.size() < codes_at + code_bytes) return cut;
  const uint32_t common = word_at(bytes, 0);
  size_t at = codes_at + code_bytes;
  std::vector<int32_t> numbers(count);
  uint32_t number = 0;
  for (size_t i = 0; i < count; ++i) {
    const size_t code = static_cast<size_t>(bytes[codes_at + i / 4]) >> 2 * (i % 4) & 3;
    const size_t width = kCodeBytes[code];
    if (width > bytes.size() - at) return cut;
    uint32_t difference = code == 0 ? common : 0;
    std::memcpy(&difference, bytes.data() + at, width);
    at += width;
    if (code == 1) difference = static_cast<uint32_t>(static_cast<int8_t>(difference));
    if (code == 2) difference = static_cast<uint32_t>(static_cast<int16_t>(difference));
    number += difference;
    numbers[i] = static_cast<int32_t>(number);
  }
  return numbers;
}

}  // namespace strandcast
