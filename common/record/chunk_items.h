// What the messages of a recording's chunks hold, one by one and in the order in which it was recorded. Input
// is untrusted. Pure functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/wire/recording_messages.h"

namespace strandcast {

/// What a channel carries.
enum class ChannelRole { Unknown, Asset, Keyframe, Delta, Message };
struct ChannelUse {
  ChannelRole role = ChannelRole::Unknown;
  size_t kind = 0;  // of a message: index of RecordedMessage
  bool has_many_in_one = false;
};
ChannelUse channel_use(const std::string& topic);
bool is_media(ChannelRole role);

struct ChunkItem {
  uint16_t channel = 0;
  uint32_t order = 0;     // among all of the recording
  uint64_t log_time = 0;  // as in MCAP
  std::span<const std::byte> bytes;
};
/// Whether an item was recorded before another; numbers may have gone past their end.
inline bool is_before(uint32_t order, uint32_t other) {
  return static_cast<int32_t>(order - other) < 0;
}

struct ChunkItems {
  std::vector<ChunkItem> items;  // in order
  std::optional<Error> error;    // of what is left out of it
};

/// Uses of channels by their ids.
class ChannelUses {
 public:
  void add(uint16_t channel, const std::string& topic);
  ChannelUse of(uint16_t channel) const;

 private:
  std::vector<std::pair<uint16_t, ChannelUse>> uses_;
};

/// Views into the records.
ChunkItems items_of(std::span<const std::byte> records, const ChannelUses& uses);

}  // namespace strandcast
