// What of a recording its writer and its reader both go by: channels, and limits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/record/mcap_records.h"
#include "common/strands/frame_header.h"
#include "common/wire/recording_messages.h"

namespace strandcast {

inline constexpr const char* kRecordingProfile = "strandcast";
// Channels: 1 + the index of the kind of RecordedMessage, then what viewers get.
inline constexpr uint16_t kAssetChannel = 1 + std::variant_size_v<RecordedMessage>;
inline constexpr uint16_t kKeyframeChannel = kAssetChannel + 1;
inline constexpr uint16_t kDeltaChannel = kKeyframeChannel + 1;
inline constexpr const char* kAssetTopic = "/asset";
inline constexpr const char* kKeyframeTopic = "/strands/keyframes";
inline constexpr const char* kDeltaTopic = "/strands/deltas";

/// Whether a message of this channel is a RecordBatch.
bool has_many_in_one(uint16_t channel);

/// A chunk is closed at this size, if it was not sooner.
inline constexpr size_t kChunkBytes = 1u << 20;
/// One chunk, compressed or not: the largest message of a stream, and what was before it.
inline constexpr uint64_t kMaxChunkBytes = kMaxMediaPayloadBytes + 4 * uint64_t{kChunkBytes};
inline constexpr uint64_t kMaxSummaryBytes = 256u << 20;
inline constexpr size_t kMaxChunks = 1u << 21;  // more than a week
inline constexpr size_t kMaxRecordingHeaderBytes = 64u << 10;
inline constexpr size_t kMaxChannels = 1024;

/// In the order of their ids, from 1.
std::vector<mcap::Channel> recording_channels();
std::vector<mcap::Schema> recording_schemas();

}  // namespace strandcast
