#include "common/record/recording_writer.h"

#include <algorithm>
#include <utility>

#include "common/base/version.h"

namespace strandcast {
namespace {

constexpr int kCompressionLevel = 3;

std::string topic_of(uint16_t channel) {
  if (channel == kAssetChannel) return kAssetTopic;
  if (channel == kKeyframeChannel) return kKeyframeTopic;
  if (channel == kDeltaChannel) return kDeltaTopic;
  return recorded_kinds()[channel - 1].topic;
}

uint64_t count_messages(const mcap::ChunkBody& body) {
  uint64_t count = 0;
  for (const auto& [channel, entries] : body.index) count += entries.size();
  return count;
}

}  // namespace

std::vector<mcap::Channel> recording_channels() {
  std::vector<mcap::Channel> channels;
  for (uint16_t id = 1; id <= kDeltaChannel; ++id)
    channels.push_back({id, std::min(id, kAssetChannel), topic_of(id)});
  return channels;
}

/// One per kind of message, and one that asset, keyframes and deltas share.
std::vector<mcap::Schema> recording_schemas() {
  std::vector<mcap::Schema> schemas;
  for (const RecordedKind& kind : recorded_kinds())
    schemas.push_back(
        {static_cast<uint16_t>(schemas.size() + 1), kind.schema, message_descriptors(kind.schema)});
  schemas.push_back({kAssetChannel, kMediaSchema, message_descriptors(kMediaSchema)});
  return schemas;
}

RecordingWriter::RecordingWriter(mcap::ByteSink& sink, RecordingStart start, const EncodedFrame& asset)
    : start_(std::move(start)),
      file_(sink, {kRecordingProfile, fmt::format("strandcast {}", version())}, recording_schemas(),
            recording_channels()),
      sequences_(kDeltaChannel + 1, 0),
      newest_ns_(start_.server_time_ns) {
  add(start_.server_time_ns, 0, start_);
  close_messages();
  const mcap::Bytes media = encode_media(asset.message);
  put(frames_, {kAssetChannel, 0, log_time(start_.server_time_ns), 0, media});
  close_frames();
}

/// Of MCAP: time since 1970.
uint64_t RecordingWriter::log_time(int64_t time_ns) const {
  return static_cast<uint64_t>(time_ns) - static_cast<uint64_t>(start_.server_time_ns) +
         static_cast<uint64_t>(start_.unix_time_ns);
}

void RecordingWriter::put(mcap::ChunkBody& body, mcap::Message message) {
  message.sequence = ++sequences_[message.channel_id];
  body.add(message);
}

void RecordingWriter::add(int64_t time_ns, int64_t sim_time_ns, const RecordedMessage& message) {
  newest_ns_ = std::max(newest_ns_, time_ns);
  newest_sim_ns_ = std::max(newest_sim_ns_, sim_time_ns);
  const mcap::Bytes bytes = encode(message);
  put(messages_, {static_cast<uint16_t>(message.index() + 1), 0, log_time(newest_ns_),
                  static_cast<uint64_t>(sim_time_ns), bytes});
  if (messages_.records.size() >= kChunkBytes) close_messages();
}

void RecordingWriter::add(int64_t time_ns, const EncodedFrame& frame) {
  newest_ns_ = std::max(newest_ns_, time_ns);
  const bool is_keyframe = frame.header.opcode == Opcode::StrandKeyframe;
  if (is_keyframe) close_frames();
  const mcap::Bytes media = encode_media(frame.message);
  put(frames_, {is_keyframe ? kKeyframeChannel : kDeltaChannel, 0, log_time(newest_ns_),
                static_cast<uint64_t>(frame.header.sim_time_ns), media});
  if (frames_.records.size() >= kChunkBytes) close_frames();
}

void RecordingWriter::close_frames() {
  const mcap::ChunkBody body = std::exchange(frames_, {});
  if (body.is_empty() || file_.write(body, body.records, "", false)) return;
  lost_here_.frames += count_messages(body);
  lost_here_.bytes += body.records.size();
}

void RecordingWriter::close_messages() {
  const RecordedLoss told_before = told_;
  // What was lost is said where it is missing.
  if (const RecordedLoss all = lost(); all != told_) {
    const RecordedLoss since{all.frames - told_.frames, all.messages - told_.messages,
                             all.bytes - told_.bytes};
    told_ = all;
    add(newest_ns_, newest_sim_ns_, since);
  }
  const mcap::ChunkBody body = std::exchange(messages_, {});
  if (body.is_empty()) return;
  mcap::Bytes compressed;
  compressor_.append(body.records, kCompressionLevel, compressed);
  if (file_.write(body, compressed, "zstd", true)) return;
  told_ = told_before;
  lost_here_.messages += count_messages(body);
  lost_here_.bytes += body.records.size();
}

RecordedLoss RecordingWriter::lost() const {
  return {lost_outside_.frames + lost_here_.frames, lost_outside_.messages + lost_here_.messages,
          lost_outside_.bytes + lost_here_.bytes};
}

void RecordingWriter::flush() {
  close_frames();
  close_messages();
}

void RecordingWriter::finish() {
  flush();
  file_.finish();
}

}  // namespace strandcast
