#include "common/wire/record_batch.h"

#include <optional>

#include "common/base/check.h"
#include "common/strands/byte_io.h"

namespace strandcast {
namespace {

constexpr std::byte kItemTag{0x0a};   // field 1, of bytes
constexpr std::byte kOrderTag{0x12};  // field 2, packed
constexpr std::byte kSpanTag{0x19};   // field 3, fixed64
constexpr uint64_t kBatchVarintBits = 7;
constexpr uint64_t kBatchVarintMore = 1u << kBatchVarintBits;
constexpr uint64_t kMostVarintShift = 63;

void put_varint(uint64_t value, std::vector<std::byte>& bytes) {
  for (; value >= kBatchVarintMore; value >>= kBatchVarintBits)
    bytes.push_back(static_cast<std::byte>(value % kBatchVarintMore + kBatchVarintMore));
  bytes.push_back(static_cast<std::byte>(value));
}

/// Reads what put_varint() wrote; nothing where it is too long or cut off.
std::optional<uint64_t> take_varint(ByteReader& reader) {
  uint64_t value = 0;
  for (uint64_t shift = 0; shift < kMostVarintShift; shift += kBatchVarintBits) {
    const uint64_t byte = reader.take<uint8_t>();
    if (!reader.ok()) return std::nullopt;
    value |= (byte % kBatchVarintMore) << shift;
    if (byte < kBatchVarintMore) return value;
  }
  return std::nullopt;
}

/// A field of bytes behind its tag.
std::optional<std::span<const std::byte>> take_field(ByteReader& reader) {
  const auto size = take_varint(reader);
  if (!size || *size > reader.rest().size()) return std::nullopt;
  return reader.take_bytes(static_cast<size_t>(*size));
}

bool has_tag(const ByteReader& reader, std::byte tag) {
  return !reader.rest().empty() && reader.rest().front() == tag;
}

/// Orders and times of the items, from what stands behind them.
bool read_places(ByteReader& reader, const BatchStart& start, std::vector<BatchItem>& items) {
  if (!has_tag(reader, kOrderTag)) return false;
  reader.take<uint8_t>();
  const auto packed = take_field(reader);
  if (!packed || !has_tag(reader, kSpanTag)) return false;
  reader.take<uint8_t>();
  const auto span_ns = reader.take<uint64_t>();
  if (!reader.ok() || !reader.rest().empty()) return false;
  ByteReader steps(*packed);
  uint32_t order = start.order;
  for (size_t i = 0; i < items.size(); ++i) {
    const auto step = take_varint(steps);
    if (!step) return false;
    order += static_cast<uint32_t>(*step);
    items[i].order = order;
    const double share = i > 0 ? static_cast<double>(i) / static_cast<double>(items.size() - 1) : 0.0;
    // A span that no recording has may be any number; it must only be one.
    const double passed_ns = share * static_cast<double>(span_ns % (uint64_t{1} << 62));
    items[i].time_ns = start.time_ns + static_cast<uint64_t>(passed_ns);
  }
  return steps.rest().empty();
}

}  // namespace

void RecordBatch::add(std::span<const std::byte> message, uint32_t order, uint64_t time_ns) {
  if (is_empty()) {
    first_order_ = last_order_ = order;
    first_time_ns_ = time_ns;
  }
  items_.push_back(kItemTag);
  put_varint(message.size(), items_);
  items_.insert(items_.end(), message.begin(), message.end());
  order_steps_.push_back(order - last_order_);
  last_order_ = order;
  last_time_ns_ = time_ns;
}

std::vector<std::byte> RecordBatch::encode() const {
  std::vector<std::byte> steps;
  for (const uint32_t step : order_steps_) put_varint(step, steps);
  std::vector<std::byte> bytes = items_;
  bytes.push_back(kOrderTag);
  put_varint(steps.size(), bytes);
  ByteWriter writer(bytes);
  writer.put_bytes(steps);
  bytes.push_back(kSpanTag);
  writer.put(last_time_ns_ - first_time_ns_);
  return bytes;
}

Result<std::vector<BatchItem>> read_batch(std::span<const std::byte> bytes, const BatchStart& start) {
  std::vector<BatchItem> items;
  ByteReader reader(bytes);
  bool is_whole = true;
  while (is_whole && has_tag(reader, kItemTag)) {
    reader.take<uint8_t>();
    const auto item = take_field(reader);
    is_whole = item.has_value();
    if (!item) break;
    if (items.size() == kMaxBatchItems)
      return make_error(ErrorCode::LimitExceeded, "a message has more than {} items", kMaxBatchItems);
    items.push_back({*item});
  }
  if (!is_whole || items.empty() || !read_places(reader, start, items))
    return make_error(ErrorCode::BadInput, "a message of {} bytes is not a list of items with their order",
                      bytes.size());
  return items;
}

}  // namespace strandcast
