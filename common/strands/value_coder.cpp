#include "common/strands/value_coder.h"

#include "common/base/check.h"
#include "common/strands/byte_io.h"

namespace strandcast {

void ValueWriter::finish(std::vector<std::byte>& destination) {
  // The reader meets the symbols in the opposite order of the arithmetic, so this runs backwards.
  words_.clear();
  uint32_t state = kRansLow;
  for (size_t i = steps_.size(); i-- > 0;) {
    const uint32_t share = steps_[i].share;
    if (state >= share << (32 - kProbabilityBits)) {
      words_.push_back(static_cast<uint16_t>(state));
      state >>= 16;
    }
    state = (state / share << kProbabilityBits) + state % share + steps_[i].start;
  }
  words_.push_back(static_cast<uint16_t>(state));
  words_.push_back(static_cast<uint16_t>(state >> 16));
  std::reverse(words_.begin(), words_.end());
  if (pending_count_ != 0) bits_.push_back(static_cast<std::byte>(pending_));

  ByteWriter writer(destination);
  writer.put(static_cast<uint32_t>(words_.size() * sizeof(uint16_t)));
  writer.put(static_cast<uint32_t>(bits_.size()));
  writer.put_bytes(std::as_bytes(std::span(words_)));
  writer.put_bytes(bits_);
  steps_.clear();
  bits_.clear();
  pending_ = 0;
  pending_count_ = 0;
}

Result<std::span<const std::byte>> ValueReader::open(std::span<const std::byte> source) {
  ByteReader reader(source);
  const auto word_bytes = reader.take<uint32_t>();
  const auto bit_bytes = reader.take<uint32_t>();
  words_ = reader.take_bytes(word_bytes);
  bits_ = reader.take_bytes(bit_bytes);
  if (!reader.ok())
    return make_error(ErrorCode::BadInput, "slice of {} + {} bytes is cut off, {} bytes are left", word_bytes,
                      bit_bytes, source.size());
  pending_ = 0;
  pending_count_ = 0;
  is_short_ = false;
  const uint32_t high = next_word();
  state_ = high << 16 | next_word();
  return reader.rest();
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
  return !is_short_ && state_ == kRansLow && words_.empty() && bits_.empty() && pending_ == 0;
}

}  // namespace strandcast
