// Several messages of one kind in one message of a recording, with the order in which they came: a message of
// its own for each would take more bytes than most of them have. Layout: proto/RECORDING.md. Reading is of
// untrusted bytes. Pure, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// Of one message, and of one chunk of a recording.
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

  /// `order` and `time_ns` never decrease.
  void add(std::span<const std::byte> message, uint32_t order, uint64_t time_ns);
  /// The protobuf message.
  std::vector<std::byte> encode() const;

 private:
  std::vector<std::byte> items_;       // as they are in the message
  std::vector<uint32_t> order_steps_;  // from the one before; the first is 0
  uint32_t first_order_ = 0;
  uint32_t last_order_ = 0;
  uint64_t first_time_ns_ = 0;
  uint64_t last_time_ns_ = 0;
};

/// What stands beside the message in the file.
struct BatchStart {
  uint32_t order = 0;
  uint64_t time_ns = 0;
};
/// Views into `bytes`. BadInput where they are not exactly such a message.
Result<std::vector<BatchItem>> read_batch(std::span<const std::byte> bytes, const BatchStart& start);

}  // namespace strandcast
