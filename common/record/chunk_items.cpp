#include "common/record/chunk_items.h"

#include <algorithm>

#include "common/record/mcap_records.h"
#include "common/record/recording_layout.h"

namespace strandcast {
namespace {

/// Of one chunk; the writer closes one before.
constexpr size_t kMaxChunkItems = 16 * kMaxBatchItems;

Status add_message(const mcap::Message& message, const ChannelUses& uses, std::vector<ChunkItem>& items) {
  if (items.size() + kMaxBatchItems > kMaxChunkItems)
    return make_error(ErrorCode::LimitExceeded, "a chunk has more than {} items",
                      kMaxChunkItems - kMaxBatchItems);
  if (!uses.of(message.channel_id).has_many_in_one) {
    items.push_back({message.channel_id, message.sequence, message.log_time, message.data});
    return {};
  }
  ASSIGN_OR_RETURN(const auto batch, read_batch(message.data, {message.sequence, message.log_time}));
  for (const BatchItem& item : batch)
    items.push_back({message.channel_id, item.order, item.time_ns, item.bytes});
  return {};
}

Status add_items(std::span<const std::byte> records, const ChannelUses& uses, std::vector<ChunkItem>& items) {
  while (!records.empty()) {
    ASSIGN_OR_RETURN(const mcap::Record record, mcap::read_record(records));
    records = records.subspan(record.size_bytes);
    if (record.opcode != mcap::Opcode::Message) continue;
    ASSIGN_OR_RETURN(const mcap::Message message, mcap::read_message(record.content));
    RETURN_IF_ERROR(add_message(message, uses, items));
  }
  return {};
}

}  // namespace

ChannelUse channel_use(const std::string& topic) {
  if (topic == kAssetTopic) return {ChannelRole::Asset};
  if (topic == kKeyframeTopic) return {ChannelRole::Keyframe};
  if (topic == kDeltaTopic) return {ChannelRole::Delta, 0, true};
  const auto kinds = recorded_kinds();
  const auto found =
      std::find_if(kinds.begin(), kinds.end(), [&](const RecordedKind& kind) { return topic == kind.topic; });
  if (found == kinds.end()) return {};
  return {ChannelRole::Message, static_cast<size_t>(found - kinds.begin()), found->has_many_in_one};
}

bool is_media(ChannelRole role) {
  return role == ChannelRole::Asset || role == ChannelRole::Keyframe || role == ChannelRole::Delta;
}

void ChannelUses::add(uint16_t channel, const std::string& topic) {
  uses_.emplace_back(channel, channel_use(topic));
}

ChannelUse ChannelUses::of(uint16_t channel) const {
  const auto found =
      std::find_if(uses_.begin(), uses_.end(), [&](const auto& use) { return use.first == channel; });
  return found != uses_.end() ? found->second : ChannelUse{};
}

ChunkItems items_of(std::span<const std::byte> records, const ChannelUses& uses) {
  ChunkItems found;
  if (const Status added = add_items(records, uses, found.items); !added) found.error = added.error();
  if (found.items.empty()) return found;
  const uint32_t first = found.items.front().order;
  std::stable_sort(found.items.begin(), found.items.end(), [first](const ChunkItem& a, const ChunkItem& b) {
    return static_cast<int32_t>(a.order - first) < static_cast<int32_t>(b.order - first);
  });
  return found;
}

}  // namespace strandcast
