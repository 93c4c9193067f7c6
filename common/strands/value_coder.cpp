#include "common/strands/value_coder.h"

#include <algorithm>
#include <cstring>

#include "common/base/check.h"
#include "common/strands/byte_io.h"

namespace strandcast {

// The reader meets the symbols in the opposite order of the arithmetic, so this runs backwards, and fills the
// words from their end.
class ValueWriter::Packer {
 public:
  explicit Packer(ValueWriter& writer) : step_(writer.steps_.data() + writer.step_count_) {
    constexpr size_t kLast = 2;  // words of the last state
    if (writer.words_.size() < writer.step_count_ + kLast) writer.words_.resize(writer.step_count_ + kLast);
    end_ = word_ = writer.words_.data() + writer.words_.size();
  }

  void pack_one() {
    const SymbolStep step = *--step_;
    const uint32_t share = uint32_t{step.end} - step.begin;
    const bool is_full = state_ >= share << (32 - kProbabilityBits);
    word_[-1] = static_cast<uint16_t>(state_);
    word_ -= is_full ? 1 : 0;
    const uint32_t state = is_full ? state_ >> 16 : state_;
    state_ = (state / share << kProbabilityBits) + state % share + step.begin;
  }
  std::span<const uint16_t> words() {
    *--word_ = static_cast<uint16_t>(state_);
    *--word_ = static_cast<uint16_t>(state_ >> 16);
    return {word_, end_};
  }

 private:
  const SymbolStep* step_;
  uint32_t state_ = kRansLow;
  uint16_t* word_;
  const uint16_t* end_;
};

void ValueWriter::finish(std::vector<std::byte>& destination) {
  Packer packer(*this);
  for (size_t i = 0; i < step_count_; ++i) packer.pack_one();
  append_to(destination, packer.words());
}

void ValueWriter::finish_all(std::span<ValueWriter> writers, std::span<std::vector<std::byte>> destinations) {
  CHECK(writers.size() == destinations.size());
  size_t first = 0;
  constexpr size_t kAtOnce = 4;
  for (; first + kAtOnce <= writers.size(); first += kAtOnce) {
    const auto four = writers.subspan(first, kAtOnce);
    Packer a(four[0]);
    Packer b(four[1]);
    Packer c(four[2]);
    Packer d(four[3]);
    size_t common = SIZE_MAX;
    for (const ValueWriter& writer : four) common = std::min(common, writer.step_count_);
    for (size_t i = 0; i < common; ++i) {
      a.pack_one();
      b.pack_one();
      c.pack_one();
      d.pack_one();
    }
    size_t k = 0;
    for (Packer* packer : {&a, &b, &c, &d}) {
      for (size_t i = common; i < four[k].step_count_; ++i) packer->pack_one();
      four[k].append_to(destinations[first + k], packer->words());
      ++k;
    }
  }
  for (; first < writers.size(); ++first) writers[first].finish(destinations[first]);
}

void ValueWriter::append_to(std::vector<std::byte>& destination, std::span<const uint16_t> words) {
  if (pending_count_ != 0) bits_.push_back(static_cast<std::byte>(pending_));
  ByteWriter writer(destination);
  writer.put(static_cast<uint32_t>(words.size_bytes()));
  writer.put(static_cast<uint32_t>(bits_.size()));
  writer.put_bytes(std::as_bytes(words));
  writer.put_bytes(bits_);
  step_count_ = 0;
  bits_.clear();
  pending_ = 0;
  pending_count_ = 0;
}

Result<std::span<const std::byte>> ValueReader::open(std::span<const std::byte> source) {
  ByteReader reader(source);
  const auto word_bytes = reader.take<uint32_t>();
  const auto bit_bytes = reader.take<uint32_t>();
  const auto words = reader.take_bytes(word_bytes);
  bits_ = reader.take_bytes(bit_bytes);
  if (!reader.ok())
    return make_error(ErrorCode::BadInput, "slice of {} + {} bytes is cut off, {} bytes are left", word_bytes,
                      bit_bytes, source.size());
  pending_ = 0;
  pending_count_ = 0;
  // Half a word is none, and never all that was needed.
  word_count_ = words.size() / sizeof(uint16_t);
  has_half_word_ = words.size() % sizeof(uint16_t) != 0;
  words_.assign(word_count_ + 2, 0);
  if (word_count_ != 0) std::memcpy(words_.data(), words.data(), word_count_ * sizeof(uint16_t));
  state_ = uint32_t{words_[0]} << 16 | words_[1];
  is_short_ = word_count_ < 2;
  next_word_ = std::min<size_t>(2, word_count_);
  return reader.rest();
}

SymbolCursor ValueReader::begin_run(size_t symbol_count) {
  // A symbol takes a word at most.
  if (words_.size() < next_word_ + symbol_count) words_.resize(next_word_ + symbol_count, 0);
  return {state_, words_.data() + next_word_};
}

void ValueReader::end_run(const SymbolCursor& cursor) {
  state_ = cursor.state;
  next_word_ = static_cast<size_t>(cursor.next - words_.data());
  if (next_word_ > word_count_) {
    is_short_ = true;
    next_word_ = word_count_;
  }
}

uint32_t ValueReader::take_bits(uint32_t count) {
  while (pending_count_ < count) {
    if (bits_.empty()) {
      is_short_ = true;
      return 0;
    }
    pending_ |= static_cast<uint64_t>(bits_.front()) << pending_count_;
    bits_ = bits_.subspan(1);
    pending_count_ += 8;
  }
  const auto value = static_cast<uint32_t>(pending_ & ((uint64_t{1} << count) - 1));
  pending_ >>= count;
  pending_count_ -= count;
  return value;
}

uint32_t ValueReader::take_tail(uint32_t symbol) {
  const uint32_t begin = kTailBegin[symbol - kFirstTail];
  if (symbol + 1 < kSymbolCount) return begin + take_bits(kTailBits[symbol - kFirstTail]);
  const uint32_t length = take_bits(kLengthBits);
  return begin + take_bits(length) + (1u << length) - 1u;
}

bool ValueReader::is_spent() const {
  return !is_short_ && state_ == kRansLow && next_word_ == word_count_ && !has_half_word_ && bits_.empty() &&
         pending_ == 0;
}

}  // namespace strandcast
