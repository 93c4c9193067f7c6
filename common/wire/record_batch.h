// Packs several messages of one kind, with their order, into one message of a recording, since a file entry
// costs more bytes than most messages. Layout: proto/RECORDING.md. Reads untrusted bytes. Pure functions, any
// thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// Largest number of messages in a batch and in one chunk of a recording.
inline constexpr size_t kMaxBatchItems = 4096;

struct BatchItem {
  std::span<const std::byte> bytes;  // the message of its kind
  uint32_t order = 0;                // number among all that was recorded
  uint64_t time_ns = 0;              // as the first one's, evenly spread up to the last one's
};

class RecordBatch {
 public:
  bool is_empty() const { return order_steps_.empty(); }
  size_t item_count() const { return order_steps_.size(); }
  size_t size_bytes() const { return items_.size(); }
  uint32_t first_order() const { return first_order_; }
  uint64_t first_time_ns() const { return first_time_ns_; }

  /// Appends a message; `order` and `time_ns` must never decrease.
  void add(std::span<const std::byte> message, uint32_t order, uint64_t time_ns);
  /// Returns the batch as protobuf bytes.
  std::vector<std::byte> encode() const;

 private:
  std::vector<std::byte> items_;       // as they are in the message
  std::vector<uint32_t> order_steps_;  // from the one before; the first is 0
  uint32_t first_order_ = 0;
  uint32_t last_order_ = 0;
  uint64_t first_time_ns_ = 0;
  uint64_t last_time_ns_ = 0;
};

/// Order and time of a batch's first message, as stored beside it in the file.
struct BatchStart {
  uint32_t order = 0;
  uint64_t time_ns = 0;
};
/// Returns the items as views into `bytes`. BadInput if the bytes are not exactly one batch.
Result<std::vector<BatchItem>> read_batch(std::span<const std::byte> bytes, const BatchStart& start);

}  // namespace strandcast
