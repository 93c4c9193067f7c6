#include "common/record/recording_reader.h"

#include <algorithm>
#include <utility>

#include "common/base/hash.h"
#include "common/record/chunk_items.h"
#include "common/record/chunk_list.h"
#include "common/record/recording_layout.h"

namespace strandcast {
namespace {

/// More than the head of a message in front of its data.
constexpr size_t kMessageHeadBytes = mcap::kRecordHeadBytes + 22;

/// A chunk that is a keyframe.
struct KeyframePlace {
  size_t chunk = 0;  // of the lane
  int64_t sim_time_ns = 0;
  uint64_t log_time = 0;
  uint32_t order = 0;
};

/// Chunks of one sort, one after the other, and the one that is being read.
struct Lane {
  std::vector<ChunkPlace> chunks;
  size_t next_chunk = 0;
  mcap::Bytes records;
  ChunkItems found;  // in the records
  size_t next_item = 0;
  std::optional<RecordedItem> item;
  uint32_t order = 0;  // of the item

  void go_to(size_t chunk) {
    next_chunk = chunk;
    found = {};
    next_item = 0;
    item.reset();
  }
};

}  // namespace

class RecordingReader::State {
 public:
  State(std::unique_ptr<ByteSource> source, RecordedPart part) : source_(std::move(source)), part_(part) {}

  Status open();
  Result<std::optional<RecordedItem>> next();
  Status seek(int64_t sim_time_ns);
  RecordingContents contents() const;

  RecordingStart start;
  RecordingInfo info;
  EncodedFramePtr asset;

 private:
  Status sort_chunks(const ChunkList& list);
  Status read_start();
  Result<RecordingStart> start_in(const ChunkPlace& place);
  Status read_asset();
  Result<EncodedFramePtr> asset_in(const ChunkPlace& place);
  void find_last_time();
  Result<ChannelRole> find_role(const ChunkPlace& place);
  Status add_keyframe(const ChunkPlace& place);
  Result<std::optional<mcap::Message>> first_message(const ChunkPlace& place);
  Status fill(Lane& lane);
  void count(const ChunkPlace& place, RecordingContents& contents) const;
  Result<std::optional<RecordedItem>> item_of(const ChunkItem& item) const;
  Result<RecordedFrame> frame_of(const ChunkItem& item) const;
  int64_t server_time(uint64_t log_time) const;

  const std::unique_ptr<ByteSource> source_;
  const RecordedPart part_;
  ChannelUses uses_;
  std::map<uint16_t, std::string> topics_;
  mcap::Bytes first_bytes_;  // that first_message() looked at
  Lane frames_;
  Lane messages_;
  std::vector<KeyframePlace> keyframes_;
};

/// Hostile times may wrap around, and do no harm.
int64_t RecordingReader::State::server_time(uint64_t log_time) const {
  return static_cast<int64_t>(log_time - static_cast<uint64_t>(start.unix_time_ns) +
                              static_cast<uint64_t>(start.server_time_ns));
}

Status RecordingReader::State::open() {
  ASSIGN_OR_RETURN(const ChunkList list, list_chunks(*source_));
  info.file_bytes = source_->size_bytes();
  info.is_indexed = list.is_indexed;
  info.index_trouble = list.index_trouble;
  info.cut_bytes = list.cut_bytes;
  info.chunk_count = list.chunks.size();
  topics_ = list.topics;
  for (const auto& [id, topic] : topics_) uses_.add(id, topic);
  RETURN_IF_ERROR(sort_chunks(list));
  RETURN_IF_ERROR(read_start());
  // Who reads no strands needs no hair: inputs and steps of a file whose asset is damaged can be had.
  if (const Status read = read_asset(); !read && part_ != RecordedPart::Messages) return read;
  find_last_time();
  return seek(info.first_sim_time_ns);
}

/// Of a chunk that can be read.
Result<std::optional<mcap::Message>> RecordingReader::State::first_message(const ChunkPlace& place) {
  ASSIGN_OR_RETURN(LoadedChunk chunk, load_chunk(*source_, place));
  first_bytes_ = std::move(chunk.records);
  ASSIGN_OR_RETURN(const mcap::Record record, mcap::read_record(first_bytes_));
  if (record.opcode != mcap::Opcode::Message) return std::optional<mcap::Message>();
  ASSIGN_OR_RETURN(const mcap::Message message, mcap::read_message(record.content));
  return std::optional(message);
}

/// What a chunk is of; behind the last one of a file that was cut off nothing says so but itself.
Result<ChannelRole> RecordingReader::State::find_role(const ChunkPlace& place) {
  if (place.channel != kUnknownChannel) return uses_.of(place.channel).role;
  ASSIGN_OR_RETURN(const auto first, first_message(place));
  return first ? uses_.of(first->channel_id).role : ChannelRole::Unknown;
}

/// By its first bytes, where it is as it should be.
Status RecordingReader::State::add_keyframe(const ChunkPlace& place) {
  mcap::Bytes bytes(static_cast<size_t>(std::min<uint64_t>(
      place.size_bytes, mcap::kRecordHeadBytes + mcap::kMostChunkHeadBytes + kMessageHeadBytes)));
  RETURN_IF_ERROR(source_->read(place.offset, bytes));
  const auto content = std::span<const std::byte>(bytes).subspan(mcap::kRecordHeadBytes);
  const uint64_t content_bytes = place.size_bytes - mcap::kRecordHeadBytes;
  const auto chunk = mcap::read_chunk(content, content_bytes);
  if (!chunk || !chunk->compression.empty()) return {};
  const size_t head_bytes = static_cast<size_t>(content_bytes - chunk->records_size);
  const auto records = content.subspan(std::min(head_bytes, content.size()));
  if (records.size() < kMessageHeadBytes) return {};
  const auto first =
      mcap::read_message(records.subspan(mcap::kRecordHeadBytes, kMessageHeadBytes - mcap::kRecordHeadBytes));
  if (!first || uses_.of(first->channel_id).role != ChannelRole::Keyframe) return {};
  keyframes_.push_back(
      {frames_.chunks.size(), static_cast<int64_t>(first->publish_time), first->log_time, first->sequence});
  info.keyframe_sim_time_ns.push_back(keyframes_.back().sim_time_ns);
  return {};
}

/// A chunk that is damaged counts to the messages, where it is told.
Status RecordingReader::State::sort_chunks(const ChunkList& list) {
  for (const ChunkPlace& place : list.chunks) {
    const auto role = find_role(place);
    if (!role || !is_media(*role)) {
      messages_.chunks.push_back(place);
      continue;
    }
    if (*role == ChannelRole::Keyframe) RETURN_IF_ERROR(add_keyframe(place));
    frames_.chunks.push_back(place);
  }
  return {};
}

/// The first message of the first chunk; of one behind it, where that is damaged.
Status RecordingReader::State::read_start() {
  if (messages_.chunks.empty())
    return make_error(ErrorCode::BadInput, "the recording was cut off before anything was in it");
  auto found = start_in(messages_.chunks.front());
  for (size_t i = messages_.chunks.size(); !found && i-- > 1;)
    if (messages_.chunks[i].channel == messages_.chunks.front().channel)
      if (auto again = start_in(messages_.chunks[i])) found = std::move(again);
  if (!found) return found.error();
  start = std::move(found).value();
  if (start.version != kRecordingVersion)
    return make_error(ErrorCode::Unsupported,
                      "the recording has version {} of the format, and this program reads {}: take the "
                      "program of its server ({})",
                      start.version, kRecordingVersion, start.server_version);
  return {};
}

Result<RecordingStart> RecordingReader::State::start_in(const ChunkPlace& place) {
  ASSIGN_OR_RETURN(const auto message, first_message(place));
  if (!message) return make_error(ErrorCode::BadInput, "the recording was cut off before anything was in it");
  const ChannelUse found = uses_.of(message->channel_id);
  if (found.role != ChannelRole::Message || found.kind != 0)
    return make_error(ErrorCode::BadInput, "the recording does not begin with what it is of");
  ASSIGN_OR_RETURN(RecordedMessage first, decode_recorded(found.kind, message->data));
  return std::get<RecordingStart>(std::move(first));
}

/// The first chunk of strands; the last one, where that is damaged.
Status RecordingReader::State::read_asset() {
  if (frames_.chunks.empty())
    return make_error(ErrorCode::BadInput, "the recording was cut off before its hair was in it");
  auto found = asset_in(frames_.chunks.front());
  if (!found) {
    if (auto again = asset_in(frames_.chunks.back())) found = std::move(again);
  }
  if (!found) return found.error();
  asset = std::move(found).value();
  return {};
}

Result<EncodedFramePtr> RecordingReader::State::asset_in(const ChunkPlace& place) {
  const Error missing =
      make_error(ErrorCode::BadInput, "the recording was cut off before its hair was in it");
  ASSIGN_OR_RETURN(const auto message, first_message(place));
  if (!message || uses_.of(message->channel_id).role != ChannelRole::Asset) return missing;
  ASSIGN_OR_RETURN(const auto media, decode_media(message->data));
  ASSIGN_OR_RETURN(const FrameHeader header, unpack_frame_header(media));
  if (header.opcode != strandcast::Opcode::Asset) return missing;
  if (hash_bytes(media.subspan(kFrameHeaderBytes)) != start.asset_hash)
    return make_error(ErrorCode::BadInput, "the hair in the recording is not what its beginning says");
  return EncodedFramePtr(std::make_shared<const EncodedFrame>(
      EncodedFrame{header, std::vector<std::byte>(media.begin(), media.end())}));
}

Result<RecordedFrame> RecordingReader::State::frame_of(const ChunkItem& item) const {
  auto media = item.bytes;
  if (!uses_.of(item.channel).has_many_in_one) {
    ASSIGN_OR_RETURN(media, decode_media(item.bytes));
  }
  ASSIGN_OR_RETURN(const FrameHeader header, unpack_frame_header(media));
  const bool is_keyframe = header.opcode == strandcast::Opcode::StrandKeyframe;
  if (!is_keyframe && header.opcode != strandcast::Opcode::StrandDelta)
    return make_error(ErrorCode::BadInput, "a frame has the opcode 0x{:02x}, it is none of strands",
                      static_cast<int>(header.opcode));
  return RecordedFrame{std::make_shared<const EncodedFrame>(
      EncodedFrame{header, std::vector<std::byte>(media.begin(), media.end())})};
}

/// Of the last frame that can be read, as far as the last chunk says.
void RecordingReader::State::find_last_time() {
  if (!keyframes_.empty()) info.first_sim_time_ns = keyframes_.front().sim_time_ns;
  info.last_sim_time_ns = keyframes_.empty() ? 0 : keyframes_.back().sim_time_ns;
  // Behind the last frames stands the asset once more.
  for (size_t i = frames_.chunks.size(); i-- > 1;) {
    const auto chunk = load_chunk(*source_, frames_.chunks[i]);
    if (!chunk) return;
    const ChunkItems found = items_of(chunk->records, uses_);
    bool has_frames = false;
    for (const ChunkItem& item : found.items) {
      const auto last = frame_of(item);
      has_frames = has_frames || last;
      if (last) info.last_sim_time_ns = std::max(info.last_sim_time_ns, last->frame->header.sim_time_ns);
    }
    if (has_frames) return;
  }
}

void RecordingReader::State::count(const ChunkPlace& place, RecordingContents& contents) const {
  const auto chunk = load_chunk(*source_, place);
  if (!chunk) return;
  const ChunkItems found = items_of(chunk->records, uses_);
  double all_bytes = 0.0;
  for (const ChunkItem& item : found.items) all_bytes += static_cast<double>(item.bytes.size());
  std::map<uint16_t, RecordedTopic> plain;
  for (const ChunkItem& item : found.items) {
    ++plain[item.channel].items;
    plain[item.channel].bytes += item.bytes.size();
  }
  for (const auto& [channel, part] : plain) {
    const auto topic = topics_.find(channel);
    RecordedTopic& counted = contents[topic != topics_.end() ? topic->second : "?"];
    counted.items += part.items;
    const double share = static_cast<double>(part.bytes) / std::max(1.0, all_bytes);
    counted.bytes += static_cast<uint64_t>(share * static_cast<double>(place.size_bytes));
  }
}

RecordingContents RecordingReader::State::contents() const {
  RecordingContents contents;
  for (const ChunkPlace& place : frames_.chunks) count(place, contents);
  for (const ChunkPlace& place : messages_.chunks) count(place, contents);
  return contents;
}

Result<std::optional<RecordedItem>> RecordingReader::State::item_of(const ChunkItem& item) const {
  const ChannelUse found = uses_.of(item.channel);
  const int64_t time_ns = server_time(item.log_time);
  if (found.role == ChannelRole::Message) {
    if (part_ == RecordedPart::Frames || found.kind == 0) return std::optional<RecordedItem>();
    ASSIGN_OR_RETURN(RecordedMessage decoded, decode_recorded(found.kind, item.bytes));
    return std::optional(RecordedItem{time_ns, std::move(decoded)});
  }
  if (part_ == RecordedPart::Messages || !is_media(found.role) || found.role == ChannelRole::Asset)
    return std::optional<RecordedItem>();
  ASSIGN_OR_RETURN(RecordedFrame frame, frame_of(item));
  return std::optional(RecordedItem{time_ns, std::move(frame)});
}

/// The next item of a lane, if one is left. After an error it goes on behind what is damaged.
Status RecordingReader::State::fill(Lane& lane) {
  while (!lane.item) {
    if (lane.next_item < lane.found.items.size()) {
      const ChunkItem& item = lane.found.items[lane.next_item++];
      lane.order = item.order;
      ASSIGN_OR_RETURN(lane.item, item_of(item));
      continue;
    }
    if (lane.found.error) return *std::exchange(lane.found.error, std::nullopt);
    if (lane.next_chunk >= lane.chunks.size()) return {};
    lane.found = {};
    lane.next_item = 0;
    ASSIGN_OR_RETURN(LoadedChunk chunk, load_chunk(*source_, lane.chunks[lane.next_chunk++]));
    lane.records = std::move(chunk.records);
    lane.found = items_of(lane.records, uses_);
  }
  return {};
}

Result<std::optional<RecordedItem>> RecordingReader::State::next() {
  if (part_ != RecordedPart::Messages) RETURN_IF_ERROR(fill(frames_));
  if (part_ != RecordedPart::Frames) RETURN_IF_ERROR(fill(messages_));
  if (!frames_.item && !messages_.item) return std::optional<RecordedItem>();
  const bool is_message = messages_.item && (!frames_.item || is_before(messages_.order, frames_.order));
  return std::exchange((is_message ? messages_ : frames_).item, std::nullopt);
}

Status RecordingReader::State::seek(int64_t sim_time_ns) {
  const KeyframePlace* place = nullptr;
  for (const KeyframePlace& keyframe : keyframes_)
    if (place == nullptr || keyframe.sim_time_ns <= sim_time_ns) place = &keyframe;
  if (place == nullptr) {  // there are no strands
    frames_.go_to(0);
    messages_.go_to(0);
    return {};
  }
  // A state that stands still may be in it several times: from its first keyframe on all is read.
  if (place->sim_time_ns == keyframes_.front().sim_time_ns) place = &keyframes_.front();
  frames_.go_to(place->chunk);
  // Messages are in chunks that begin before; what of them is older than the keyframe is passed over.
  size_t chunk = 0;
  for (size_t i = 0; i < messages_.chunks.size(); ++i)
    if (messages_.chunks[i].start_time <= place->log_time) chunk = i;
  const bool is_beginning = place == &keyframes_.front();
  messages_.go_to(is_beginning ? 0 : chunk);
  if (is_beginning || part_ == RecordedPart::Frames) return {};
  while (true) {
    // What is damaged is passed over.
    if (!fill(messages_) || !messages_.item) return {};
    if (!is_before(messages_.order, place->order)) return {};
    messages_.item.reset();
  }
}

RecordingReader::RecordingReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingReader::~RecordingReader() = default;

Result<std::unique_ptr<RecordingReader>> RecordingReader::open(std::unique_ptr<ByteSource> source,
                                                               RecordedPart part) {
  auto state = std::make_unique<State>(std::move(source), part);
  RETURN_IF_ERROR(state->open());
  return std::unique_ptr<RecordingReader>(new RecordingReader(std::move(state)));
}

Result<std::unique_ptr<RecordingReader>> RecordingReader::open(const std::filesystem::path& path,
                                                               RecordedPart part) {
  ASSIGN_OR_RETURN(auto source, open_byte_source(path));
  auto reader = open(std::move(source), part);
  if (!reader) return at(path.string(), reader.error());
  return reader;
}

const RecordingStart& RecordingReader::start() const {
  return state_->start;
}
const RecordingInfo& RecordingReader::info() const {
  return state_->info;
}
const EncodedFramePtr& RecordingReader::asset_frame() const {
  return state_->asset;
}
Result<SceneAsset> RecordingReader::asset() const {
  if (state_->asset == nullptr) return make_error(ErrorCode::BadInput, "the recording's hair is damaged");
  return decode_scene_asset(std::span<const std::byte>(state_->asset->message).subspan(kFrameHeaderBytes));
}
RecordingContents RecordingReader::contents() const {
  return state_->contents();
}
Result<std::optional<RecordedItem>> RecordingReader::next() {
  return state_->next();
}
Status RecordingReader::seek(int64_t sim_time_ns) {
  return state_->seek(sim_time_ns);
}

std::optional<uint64_t> first_recorded_tick(const std::filesystem::path& path) {
  const auto reader = RecordingReader::open(path, RecordedPart::Messages);
  if (!reader) return std::nullopt;
  // What is damaged before it says nothing.
  for (auto item = (*reader)->next(); item && *item; item = (*reader)->next())
    if (const auto* state = std::get_if<RecordedState>(&std::get<RecordedMessage>((*item)->what)))
      return state->tick;
  return std::nullopt;
}

}  // namespace strandcast
