#include "common/record/chunk_list.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "common/base/crc32.h"
#include "common/record/recording_layout.h"
#include "common/strands/byte_io.h"
#include "common/strands/zstd_block.h"

namespace strandcast {
namespace {

constexpr size_t kMagicBytes = mcap::kMagic.size();
constexpr size_t kMessageIndexHeadBytes = sizeof(uint16_t) + sizeof(uint32_t);

/// As many bytes as there are from `offset` on, at most `bytes`.
Result<mcap::Bytes> read_some(ByteSource& source, uint64_t offset, uint64_t bytes) {
  const uint64_t left = source.size_bytes() - std::min(offset, source.size_bytes());
  mcap::Bytes result(static_cast<size_t>(std::min(bytes, left)));
  RETURN_IF_ERROR(source.read(offset, result));
  return result;
}

/// The head of the record at `offset`, where one fits before `end`.
Result<mcap::RecordHead> head_at(ByteSource& source, uint64_t offset, uint64_t end) {
  std::array<std::byte, mcap::kRecordHeadBytes> head;
  if (offset > end || end - offset < head.size())
    return make_error(ErrorCode::BadInput, "no record begins at {}", offset);
  RETURN_IF_ERROR(source.read(offset, head));
  const mcap::RecordHead result = mcap::read_head(head);
  if (result.content_bytes > end - offset - head.size())
    return make_error(ErrorCode::BadInput, "the record at {} says that it has {} bytes, and {} are left",
                      offset, result.content_bytes, end - offset - head.size());
  return result;
}

/// Magic and header; where the records behind them begin.
Result<uint64_t> read_beginning(ByteSource& source, ChunkList& list) {
  ASSIGN_OR_RETURN(const mcap::Bytes magic, read_some(source, 0, kMagicBytes));
  if (!mcap::is_magic(magic)) return make_error(ErrorCode::BadInput, "this is no MCAP file");
  ASSIGN_OR_RETURN(const mcap::RecordHead head, head_at(source, kMagicBytes, source.size_bytes()));
  if (head.opcode != mcap::Opcode::Header || head.content_bytes > kMaxRecordingHeaderBytes)
    return make_error(ErrorCode::BadInput, "this MCAP file does not begin with a header");
  const uint64_t begin = kMagicBytes + mcap::kRecordHeadBytes;
  ASSIGN_OR_RETURN(const mcap::Bytes content, read_some(source, begin, head.content_bytes));
  ASSIGN_OR_RETURN(list.header, mcap::read_header(content));
  if (list.header.profile != kRecordingProfile)
    return make_error(ErrorCode::BadInput, "this MCAP file has the profile '{}', it is no recording of {}",
                      list.header.profile, kRecordingProfile);
  return begin + head.content_bytes;
}

Status add_channel(std::span<const std::byte> content, ChunkList& list) {
  ASSIGN_OR_RETURN(mcap::Channel channel, mcap::read_channel(content));
  list.topics[channel.id] = std::move(channel.topic);
  if (list.topics.size() > kMaxChannels)
    return make_error(ErrorCode::LimitExceeded, "there are more than {} channels", kMaxChannels);
  return {};
}

Status add_chunk(const ChunkPlace& place, ChunkList& list) {
  if (list.chunks.size() >= kMaxChunks)
    return make_error(ErrorCode::LimitExceeded, "there are more than {} chunks", kMaxChunks);
  list.chunks.push_back(place);
  return {};
}

/// Reads the footer of a file that was closed; NotFound for any other.
Result<mcap::Footer> read_footer_at_end(ByteSource& source, uint64_t data_begin) {
  constexpr uint64_t kEndBytes = mcap::kFooterBytes + kMagicBytes;
  const uint64_t size = source.size_bytes();
  if (size < data_begin + kEndBytes) return make_error(ErrorCode::NotFound, "it was not closed");
  ASSIGN_OR_RETURN(const mcap::Bytes bytes, read_some(source, size - kEndBytes, kEndBytes));
  const auto end = std::span<const std::byte>(bytes);
  if (!mcap::is_magic(end.last(kMagicBytes))) return make_error(ErrorCode::NotFound, "it was not closed");
  ASSIGN_OR_RETURN(const mcap::Record record, mcap::read_record(end.first(mcap::kFooterBytes)));
  if (record.opcode != mcap::Opcode::Footer)
    return make_error(ErrorCode::BadInput, "there is no footer before its end");
  return mcap::read_footer(record.content);
}

Status check_footer(const mcap::Footer& footer, uint64_t data_begin, uint64_t footer_at) {
  if (footer.summary_start == 0) return make_error(ErrorCode::NotFound, "it has no index");
  if (footer.summary_start < data_begin || footer.summary_start > footer_at)
    return make_error(ErrorCode::BadInput, "the footer's index lies at {}, outside of {} .. {}",
                      footer.summary_start, data_begin, footer_at);
  if (footer_at - footer.summary_start > kMaxSummaryBytes)
    return make_error(ErrorCode::LimitExceeded, "the index has {} bytes, the limit is {}",
                      footer_at - footer.summary_start, kMaxSummaryBytes);
  return {};
}

/// What an index is about.
struct IndexedData {
  uint64_t begin = 0;
  uint64_t end = 0;
  bool is_index_checked = false;  // by its CRC
};

/// A chunk that the index names, if there is one. An index with a CRC is believed where the head of a chunk
/// says otherwise.
Status add_indexed(ByteSource& source, const mcap::ChunkIndex& index, const IndexedData& data,
                   ChunkList& list) {
  const uint64_t offset = index.chunk_start_offset;
  if (offset < data.begin || offset > data.end || index.chunk_length > data.end - offset ||
      index.chunk_length < mcap::kRecordHeadBytes)
    return make_error(ErrorCode::BadInput, "the index names a chunk of {} bytes at {}, outside of {} .. {}",
                      index.chunk_length, offset, data.begin, data.end);
  if (!list.chunks.empty() && offset < list.chunks.back().offset + list.chunks.back().size_bytes)
    return make_error(ErrorCode::BadInput, "the index names a chunk at {} that overlaps the one before",
                      offset);
  const auto head = head_at(source, offset, data.end);
  const bool is_there = head && head->opcode == mcap::Opcode::Chunk &&
                        head->content_bytes + mcap::kRecordHeadBytes == index.chunk_length;
  if (!is_there && !data.is_index_checked)
    return make_error(ErrorCode::BadInput, "the index names a chunk at {}, where there is none", offset);
  const auto& channels = index.message_index_offsets;
  const uint16_t channel = channels.empty()       ? kUnknownChannel
                           : channels.size() == 1 ? channels.begin()->first
                                                  : kSeveralChannels;
  return add_chunk({offset, index.chunk_length, index.message_start_time, channel}, list);
}

/// By the index; NotFound where there is none.
Status read_index(ByteSource& source, uint64_t data_begin, ChunkList& list) {
  ASSIGN_OR_RETURN(const mcap::Footer footer, read_footer_at_end(source, data_begin));
  const uint64_t footer_at = source.size_bytes() - kMagicBytes - mcap::kFooterBytes;
  RETURN_IF_ERROR(check_footer(footer, data_begin, footer_at));
  const uint64_t crc_at = footer_at + mcap::kFooterBytes - sizeof(uint32_t);
  ASSIGN_OR_RETURN(const mcap::Bytes bytes,
                   read_some(source, footer.summary_start, crc_at - footer.summary_start));
  if (footer.summary_crc != 0 && crc32(bytes) != footer.summary_crc)
    return make_error(ErrorCode::BadInput, "the CRC of the index is {:08x}, and {:08x} was written",
                      crc32(bytes), footer.summary_crc);
  auto rest = std::span<const std::byte>(bytes).first(static_cast<size_t>(footer_at - footer.summary_start));
  const IndexedData data{data_begin, footer.summary_start, footer.summary_crc != 0};
  while (!rest.empty()) {
    ASSIGN_OR_RETURN(const mcap::Record record, mcap::read_record(rest));
    rest = rest.subspan(record.size_bytes);
    if (record.opcode == mcap::Opcode::Channel) RETURN_IF_ERROR(add_channel(record.content, list));
    if (record.opcode == mcap::Opcode::Statistics) {
      ASSIGN_OR_RETURN(mcap::Statistics statistics, mcap::read_statistics(record.content));
      list.message_counts = std::move(statistics.channel_message_counts);
    }
    if (record.opcode == mcap::Opcode::ChunkIndex) {
      ASSIGN_OR_RETURN(const mcap::ChunkIndex index, mcap::read_chunk_index(record.content));
      RETURN_IF_ERROR(add_indexed(source, index, data, list));
    }
  }
  list.is_indexed = true;
  return {};
}

/// One record of a walk.
Status walk_record(ByteSource& source, uint64_t offset, const mcap::RecordHead& head, ChunkList& list) {
  const uint64_t content_at = offset + mcap::kRecordHeadBytes;
  if (head.opcode == mcap::Opcode::Chunk) {
    ASSIGN_OR_RETURN(const mcap::Bytes time, read_some(source, content_at, sizeof(uint64_t)));
    return add_chunk({offset, mcap::kRecordHeadBytes + head.content_bytes, ByteReader(time).take<uint64_t>(),
                      kUnknownChannel},
                     list);
  }
  if (head.opcode == mcap::Opcode::Channel) {
    if (head.content_bytes > kMaxRecordingHeaderBytes)
      return make_error(ErrorCode::LimitExceeded, "a channel has {} bytes, the limit is {}",
                        head.content_bytes, kMaxRecordingHeaderBytes);
    ASSIGN_OR_RETURN(const mcap::Bytes content, read_some(source, content_at, head.content_bytes));
    return add_channel(content, list);
  }
  if (head.opcode == mcap::Opcode::MessageIndex && head.content_bytes >= kMessageIndexHeadBytes) {
    ASSIGN_OR_RETURN(const mcap::Bytes bytes, read_some(source, content_at, sizeof(uint16_t)));
    const auto channel = ByteReader(bytes).take<uint16_t>();
    list.message_counts[channel] += (head.content_bytes - kMessageIndexHeadBytes) / sizeof(mcap::IndexEntry);
    // The indexes of a chunk stand behind it.
    if (!list.chunks.empty()) {
      uint16_t& known = list.chunks.back().channel;
      known = known == kUnknownChannel || known == channel ? channel : kSeveralChannels;
    }
  }
  if (head.opcode == mcap::Opcode::DataEnd) {
    ASSIGN_OR_RETURN(const mcap::Bytes crc, read_some(source, content_at, sizeof(uint32_t)));
    list.data_crc = ByteReader(crc).take<uint32_t>();
    list.has_end = true;
  }
  return {};
}

Status walk(ByteSource& source, uint64_t data_begin, ChunkList& list) {
  uint64_t offset = data_begin;
  const uint64_t end = source.size_bytes();
  while (offset < end && !list.has_end) {
    const auto head = head_at(source, offset, end);
    const bool is_wrong_end =
        head && head->opcode == mcap::Opcode::DataEnd && head->content_bytes != sizeof(uint32_t);
    if (!head || is_wrong_end) {
      list.cut_bytes = end - offset;
      break;
    }
    list.data_end = offset;
    RETURN_IF_ERROR(walk_record(source, offset, *head, list));
    offset += mcap::kRecordHeadBytes + head->content_bytes;
  }
  if (!list.has_end) list.data_end = offset;
  return {};
}

}  // namespace

Status check_is_recording(ByteSource& source) {
  ChunkList list;
  ASSIGN_OR_RETURN([[maybe_unused]] const uint64_t data_begin, read_beginning(source, list));
  return {};
}

Result<ChunkList> walk_chunks(ByteSource& source) {
  ChunkList list;
  ASSIGN_OR_RETURN(const uint64_t data_begin, read_beginning(source, list));
  RETURN_IF_ERROR(walk(source, data_begin, list));
  return list;
}

Result<ChunkList> list_chunks(ByteSource& source) {
  ChunkList list;
  ASSIGN_OR_RETURN(const uint64_t data_begin, read_beginning(source, list));
  const Status indexed = read_index(source, data_begin, list);
  if (indexed) return list;
  ASSIGN_OR_RETURN(ChunkList walked, walk_chunks(source));
  if (indexed.error().code != ErrorCode::NotFound) walked.index_trouble = indexed.error().message;
  return walked;
}

Result<LoadedChunk> load_chunk(ByteSource& source, const ChunkPlace& place) {
  const uint64_t content_bytes = place.size_bytes - mcap::kRecordHeadBytes;
  if (content_bytes > kMaxChunkBytes)
    return make_error(ErrorCode::LimitExceeded, "the chunk at {} has {} bytes, the limit is {}", place.offset,
                      content_bytes, kMaxChunkBytes);
  ASSIGN_OR_RETURN(const mcap::Bytes content,
                   read_some(source, place.offset + mcap::kRecordHeadBytes, content_bytes));
  ASSIGN_OR_RETURN(const mcap::Chunk chunk, mcap::read_chunk(content, content_bytes));
  if (chunk.uncompressed_size > kMaxChunkBytes)
    return make_error(ErrorCode::LimitExceeded, "the chunk at {} has {} bytes uncompressed, the limit is {}",
                      place.offset, chunk.uncompressed_size, kMaxChunkBytes);
  LoadedChunk loaded;
  loaded.compression = chunk.compression;
  if (chunk.compression.empty()) {
    loaded.records.assign(chunk.records.begin(), chunk.records.end());
  } else if (chunk.compression == "zstd") {
    ASSIGN_OR_RETURN(const size_t bytes, zstd_content_bytes(chunk.records, kMaxChunkBytes));
    if (bytes != chunk.uncompressed_size)
      return make_error(ErrorCode::BadInput,
                        "the chunk at {} has {} bytes uncompressed, and {} were announced", place.offset,
                        bytes, chunk.uncompressed_size);
    loaded.records.resize(bytes);
    ZstdDecompressor decompressor;
    if (const Status filled = decompressor.fill(chunk.records, loaded.records); !filled)
      return at(fmt::format("the chunk at {}", place.offset), filled.error());
    loaded.stored.assign(chunk.records.begin(), chunk.records.end());
  } else {
    return make_error(ErrorCode::Unsupported, "the chunk at {} is compressed by '{}'", place.offset,
                      chunk.compression);
  }
  if (chunk.uncompressed_crc != 0 && crc32(loaded.records) != chunk.uncompressed_crc)
    return make_error(ErrorCode::BadInput, "the CRC of the chunk at {} is {:08x}, and {:08x} was written",
                      place.offset, crc32(loaded.records), chunk.uncompressed_crc);
  return loaded;
}

Result<mcap::ChunkBody> chunk_body_of(mcap::Bytes records) {
  mcap::ChunkBody body;
  for (size_t offset = 0; offset < records.size();) {
    ASSIGN_OR_RETURN(const mcap::Record record,
                     mcap::read_record(std::span<const std::byte>(records).subspan(offset)));
    if (record.opcode == mcap::Opcode::Message) {
      ASSIGN_OR_RETURN(const mcap::Message message, mcap::read_message(record.content));
      if (message.channel_id == 0 || message.channel_id > kDeltaChannel)
        return make_error(ErrorCode::BadInput, "a message is on channel {}, which is none",
                          message.channel_id);
      body.message_start_time =
          body.is_empty() ? message.log_time : std::min(body.message_start_time, message.log_time);
      body.message_end_time = std::max(body.message_end_time, message.log_time);
      body.index[message.channel_id].push_back({message.log_time, offset});
    }
    offset += record.size_bytes;
  }
  if (body.is_empty()) return make_error(ErrorCode::BadInput, "a chunk has no message");
  body.records = std::move(records);
  return body;
}

}  // namespace strandcast
