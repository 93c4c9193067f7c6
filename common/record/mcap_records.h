// The records of MCAP, version 0 of the format, as far as recordings use them: their bytes and back. Names
// are those of the specification (mcap.dev/spec). Reading is of untrusted bytes. Pure functions, any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace strandcast::mcap {

inline constexpr std::array<uint8_t, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
inline constexpr size_t kRecordHeadBytes = 9;  // opcode, length
inline constexpr size_t kFooterBytes = kRecordHeadBytes + 20;

enum class Opcode : uint8_t {
  Header = 0x01,
  Footer = 0x02,
  Schema = 0x03,
  Channel = 0x04,
  Message = 0x05,
  Chunk = 0x06,
  MessageIndex = 0x07,
  ChunkIndex = 0x08,
  Statistics = 0x0b,
  SummaryOffset = 0x0e,
  DataEnd = 0x0f,
};

struct Header {
  std::string profile;
  std::string library;
};
struct Schema {
  uint16_t id = 0;
  std::string name;
  std::vector<std::byte> data;  // of the encoding "protobuf"
};
struct Channel {
  uint16_t id = 0;
  uint16_t schema_id = 0;
  std::string topic;  // of messages in the encoding "protobuf"
};
struct Message {
  uint16_t channel_id = 0;
  uint32_t sequence = 0;
  uint64_t log_time = 0;
  uint64_t publish_time = 0;
  std::span<const std::byte> data;
};
/// A chunk, or the head of one: `records` may be left out.
struct Chunk {
  uint64_t message_start_time = 0;
  uint64_t message_end_time = 0;
  uint64_t uncompressed_size = 0;
  uint32_t uncompressed_crc = 0;
  std::string compression;  // "" or "zstd"
  uint64_t records_size = 0;
  std::span<const std::byte> records;
};
struct IndexEntry {
  uint64_t log_time = 0;
  uint64_t offset = 0;  // in the uncompressed records
};
struct MessageIndex {
  uint16_t channel_id = 0;
  std::vector<IndexEntry> records;
};
struct ChunkIndex {
  uint64_t message_start_time = 0;
  uint64_t message_end_time = 0;
  uint64_t chunk_start_offset = 0;
  uint64_t chunk_length = 0;  // with its head
  std::map<uint16_t, uint64_t> message_index_offsets;
  uint64_t message_index_length = 0;
  std::string compression;
  uint64_t compressed_size = 0;
  uint64_t uncompressed_size = 0;
};
struct Statistics {
  uint64_t message_count = 0;
  uint16_t schema_count = 0;
  uint32_t channel_count = 0;
  uint32_t chunk_count = 0;
  uint64_t message_start_time = 0;
  uint64_t message_end_time = 0;
  std::map<uint16_t, uint64_t> channel_message_counts;
};
struct SummaryOffset {
  Opcode group_opcode = Opcode::Schema;
  uint64_t group_start = 0;
  uint64_t group_length = 0;
};
struct Footer {
  uint64_t summary_start = 0;
  uint64_t summary_offset_start = 0;
  uint32_t summary_crc = 0;
};

using Bytes = std::vector<std::byte>;
void append_magic(Bytes& bytes);
void append(const Header& record, Bytes& bytes);
void append(const Schema& record, Bytes& bytes);
void append(const Channel& record, Bytes& bytes);
void append(const Message& record, Bytes& bytes);
/// Appends the chunk with its records.
void append(const Chunk& record, Bytes& bytes);
void append(const MessageIndex& record, Bytes& bytes);
void append(const ChunkIndex& record, Bytes& bytes);
void append(const Statistics& record, Bytes& bytes);
void append(const SummaryOffset& record, Bytes& bytes);
void append_data_end(uint32_t data_section_crc, Bytes& bytes);
/// Its CRC is left 0 and goes over these bytes too, but for the last four: put_footer_crc().
void append(const Footer& record, Bytes& bytes);
void put_footer_crc(uint32_t crc, Bytes& bytes);

/// One record in bytes that hold whole ones, and how long it is with its head.
struct Record {
  Opcode opcode = Opcode::Header;
  std::span<const std::byte> content;
  size_t size_bytes = 0;
};
/// Opcode and length of the head of a record; kRecordHeadBytes are there.
struct RecordHead {
  Opcode opcode = Opcode::Header;
  uint64_t content_bytes = 0;
};
RecordHead read_head(std::span<const std::byte, kRecordHeadBytes> bytes);
/// The first record of `bytes`; BadInput when it ends behind them.
Result<Record> read_record(std::span<const std::byte> bytes);

bool is_magic(std::span<const std::byte> bytes);
// Contents of records of a kind. BadInput where they are too short or a length in them points outside.
Result<Header> read_header(std::span<const std::byte> content);
Result<Channel> read_channel(std::span<const std::byte> content);
/// `data` points into the content.
Result<Message> read_message(std::span<const std::byte> content);
/// The head of a chunk whose record has `content_bytes`, from as many of its bytes as there are; the records
/// too when all are there.
Result<Chunk> read_chunk(std::span<const std::byte> content, uint64_t content_bytes);
Result<ChunkIndex> read_chunk_index(std::span<const std::byte> content);
Result<Statistics> read_statistics(std::span<const std::byte> content);
Result<Footer> read_footer(std::span<const std::byte> content);
/// Upper bound of the bytes of a chunk's head, by any known compression.
inline constexpr size_t kMostChunkHeadBytes = 64;

}  // namespace strandcast::mcap
