#include "common/record/mcap_writer.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/base/crc32.h"

namespace strandcast::mcap {

void ChunkBody::add(const Message& message) {
  message_start_time = is_empty() ? message.log_time : std::min(message_start_time, message.log_time);
  message_end_time = std::max(message_end_time, message.log_time);
  index[message.channel_id].push_back({message.log_time, records.size()});
  append(message, records);
}

McapWriter::McapWriter(ByteSink& sink, const Header& header, std::vector<Schema> schemas,
                       std::vector<Channel> channels)
    : sink_(sink), schemas_(std::move(schemas)), channels_(std::move(channels)) {
  statistics_.schema_count = static_cast<uint16_t>(schemas_.size());
  statistics_.channel_count = static_cast<uint32_t>(channels_.size());
  Bytes bytes;
  append_magic(bytes);
  append(header, bytes);
  for (const Schema& schema : schemas_) append(schema, bytes);
  for (const Channel& channel : channels_) append(channel, bytes);
  give(std::move(bytes), true);
}

bool McapWriter::give(Bytes bytes, bool is_vital) {
  const size_t size = bytes.size();
  const uint32_t crc = crc32(bytes, crc_);
  if (!sink_.take(std::move(bytes), is_vital)) return false;
  size_bytes_ += size;
  crc_ = crc;
  return true;
}

bool McapWriter::write(const ChunkBody& body, std::span<const std::byte> records,
                       const std::string& compression, bool is_vital) {
  Chunk chunk;
  chunk.message_start_time = body.message_start_time;
  chunk.message_end_time = body.message_end_time;
  chunk.uncompressed_size = body.records.size();
  chunk.uncompressed_crc = crc32(body.records);
  chunk.compression = compression;
  chunk.records = records;
  Bytes bytes;
  bytes.reserve(records.size() + kRecordHeadBytes + kMostChunkHeadBytes);
  append(chunk, bytes);
  ChunkIndex index{
      chunk.message_start_time, chunk.message_end_time, size_bytes_, bytes.size(), {}, 0, compression,
      records.size(),           body.records.size()};
  for (const auto& [channel, entries] : body.index) {
    index.message_index_offsets[channel] = size_bytes_ + bytes.size();
    append(MessageIndex{channel, entries}, bytes);
  }
  index.message_index_length = bytes.size() - index.chunk_length;
  if (!give(std::move(bytes), is_vital)) return false;
  Statistics& all = statistics_;
  all.message_start_time =
      chunks_.empty() ? index.message_start_time : std::min(all.message_start_time, index.message_start_time);
  all.message_end_time = std::max(all.message_end_time, index.message_end_time);
  ++all.chunk_count;
  for (const auto& [channel, entries] : body.index) {
    all.message_count += entries.size();
    all.channel_message_counts[channel] += entries.size();
  }
  chunks_.push_back(std::move(index));
  return true;
}

void McapWriter::finish() {
  Bytes bytes;
  append_data_end(crc_, bytes);
  const size_t begin = bytes.size();
  const uint64_t summary_start = size_bytes_ + begin;
  std::vector<SummaryOffset> groups;
  const auto add_group = [&](Opcode opcode, const auto& records) {
    const size_t group_begin = bytes.size();
    for (const auto& record : records) append(record, bytes);
    if (bytes.size() > group_begin)
      groups.push_back({opcode, size_bytes_ + group_begin, bytes.size() - group_begin});
  };
  add_group(Opcode::Schema, schemas_);
  add_group(Opcode::Channel, channels_);
  add_group(Opcode::Statistics, std::span(&statistics_, 1));
  add_group(Opcode::ChunkIndex, chunks_);
  const uint64_t summary_offset_start = size_bytes_ + bytes.size();
  for (const SummaryOffset& group : groups) append(group, bytes);
  append(Footer{summary_start, summary_offset_start, 0}, bytes);
  const auto summary = std::span<const std::byte>(bytes).subspan(begin);
  put_footer_crc(crc32(summary.first(summary.size() - sizeof(uint32_t))), bytes);
  append_magic(bytes);
  give(std::move(bytes), true);
}

}  // namespace strandcast::mcap
