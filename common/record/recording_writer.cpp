#include "common/record/recording_writer.h"

#include <algorithm>
#include <utility>

#include "common/base/version.h"

namespace strandcast {
namespace {

constexpr int kCompressionLevel = 3;
/// Of messages, where a second of them is little: an eighth fewer bytes, for a millisecond or two.
constexpr int kMessageLevel = 15;
constexpr size_t kFewBytes = 64u << 10;

std::string topic_of(uint16_t channel) {
  if (channel == kAssetChannel) return kAssetTopic;
  if (channel == kKeyframeChannel) return kKeyframeTopic;
  if (channel == kDeltaChannel) return kDeltaTopic;
  return recorded_kinds()[channel - 1].topic;
}

}  // namespace

bool has_many_in_one(uint16_t channel) {
  if (channel == 0 || channel >= kAssetChannel) return channel == kDeltaChannel;
  return recorded_kinds()[channel - 1].has_many_in_one;
}

/// Asset and keyframes share a schema, and deltas have one of their own.
std::vector<mcap::Channel> recording_channels() {
  std::vector<mcap::Channel> channels;
  for (uint16_t id = 1; id <= kDeltaChannel; ++id) {
    const uint16_t schema = id == kDeltaChannel ? kKeyframeChannel : std::min(id, kAssetChannel);
    channels.push_back({id, schema, topic_of(id)});
  }
  return channels;
}

std::vector<mcap::Schema> recording_schemas() {
  std::vector<mcap::Schema> schemas;
  const auto add = [&](const std::string& name) {
    schemas.push_back({static_cast<uint16_t>(schemas.size() + 1), name, message_descriptors(name)});
  };
  for (const RecordedKind& kind : recorded_kinds()) add(kind.schema);
  add(kMediaSchema);
  add(kManyMediaSchema);
  return schemas;
}

RecordingWriter::RecordingWriter(mcap::ByteSink& sink, RecordingStart start, const EncodedFrame& asset)
    : start_(std::move(start)),
      asset_(encode_media(asset.message)),
      file_(sink, {kRecordingProfile, fmt::format("strandcast {}", version())}, recording_schemas(),
            recording_channels()),
      newest_ns_(start_.server_time_ns) {
  put_what_it_is_of(0);
}

/// What no frame and no step can do without, in chunks of its own.
void RecordingWriter::put_what_it_is_of(int64_t sim_time_ns) {
  add(newest_ns_, sim_time_ns, start_);
  close_messages();
  put(frames_, {kAssetChannel, newest_ns_, sim_time_ns}, asset_);
  close_frames();
}

/// Of MCAP: time since 1970.
uint64_t RecordingWriter::log_time(int64_t time_ns) const {
  return static_cast<uint64_t>(time_ns) - static_cast<uint64_t>(start_.server_time_ns) +
         static_cast<uint64_t>(start_.unix_time_ns);
}

void RecordingWriter::put(Part& part, const Item& item, const mcap::Bytes& message) {
  newest_ns_ = std::max(newest_ns_, item.time_ns);
  const uint64_t time_ns = log_time(newest_ns_);
  ++part.item_count;
  part.size_bytes += message.size();
  ++order_;
  if (!has_many_in_one(item.channel))
    return part.body.add({item.channel, order_, time_ns, static_cast<uint64_t>(item.sim_time_ns), message});
  if (part.batches.empty()) part.first_sim_ns = item.sim_time_ns;
  part.batches[item.channel].add(message, order_, time_ns);
}

/// False when there was no room.
bool RecordingWriter::close(Part& part, bool is_vital) {
  mcap::ChunkBody& body = part.body;
  for (const auto& [channel, batch] : part.batches) {
    const mcap::Bytes bytes = batch.encode();
    body.add({channel, batch.first_order(), batch.first_time_ns(), static_cast<uint64_t>(part.first_sim_ns),
              bytes});
  }
  mcap::Bytes compressed;
  // Asset and keyframes are as small as they get; of deltas it takes what all of them say alike.
  const bool is_coded_already = part.batches.empty() && !is_vital;
  const bool is_small = is_vital && body.records.size() <= kFewBytes;
  const int level = is_small ? kMessageLevel : kCompressionLevel;
  if (!is_coded_already) compressor_.append(body.records, level, compressed);
  const bool is_smaller = !is_coded_already && compressed.size() < body.records.size();
  return file_.write(body, is_smaller ? compressed : body.records, is_smaller ? "zstd" : "", is_vital);
}

void RecordingWriter::add(int64_t time_ns, int64_t sim_time_ns, const RecordedMessage& message) {
  newest_sim_ns_ = std::max(newest_sim_ns_, sim_time_ns);
  put(messages_, {static_cast<uint16_t>(message.index() + 1), time_ns, sim_time_ns}, encode(message));
  if (messages_.size_bytes >= kChunkBytes || messages_.item_count == kMaxBatchItems) close_messages();
}

void RecordingWriter::add(int64_t time_ns, const EncodedFrame& frame) {
  const bool is_keyframe = frame.header.opcode == Opcode::StrandKeyframe;
  if (is_keyframe) {
    close_frames();
    put(frames_, {kKeyframeChannel, time_ns, frame.header.sim_time_ns}, encode_media(frame.message));
    return close_frames();
  }
  put(frames_, {kDeltaChannel, time_ns, frame.header.sim_time_ns}, frame.message);
  if (frames_.size_bytes >= kChunkBytes || frames_.item_count == kMaxBatchItems) close_frames();
}

void RecordingWriter::close_frames() {
  Part part = std::exchange(frames_, {});
  if (part.item_count == 0 || close(part, false)) return;
  lost_here_.frames += part.item_count;
  lost_here_.bytes += part.size_bytes;
}

void RecordingWriter::close_messages() {
  const RecordedLoss told_before = told_;
  // What was lost is said where it is missing.
  if (const RecordedLoss all = lost(); all != told_) {
    const RecordedLoss since{all.frames - told_.frames, all.messages - told_.messages,
                             all.bytes - told_.bytes};
    told_ = all;
    const RecordedMessage message = since;
    put(messages_, {static_cast<uint16_t>(message.index() + 1), newest_ns_, newest_sim_ns_}, encode(message));
  }
  Part part = std::exchange(messages_, {});
  if (part.item_count == 0 || close(part, true)) return;
  told_ = told_before;
  lost_here_.messages += part.item_count;
  lost_here_.bytes += part.size_bytes;
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
  put_what_it_is_of(newest_sim_ns_);
  file_.finish();
}

}  // namespace strandcast
