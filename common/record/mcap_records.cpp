#include "common/record/mcap_records.h"

#include <algorithm>
#include <cstring>

#include "common/base/check.h"
#include "common/strands/byte_io.h"

namespace strandcast::mcap {
namespace {

constexpr const char* kEncoding = "protobuf";

/// Appends one record; its length is known in the end.
class RecordWriter {
 public:
  RecordWriter(Opcode opcode, Bytes& bytes) : bytes_(bytes), writer_(bytes) {
    writer_.put(static_cast<uint8_t>(opcode));
    length_at_ = bytes_.size();
    writer_.put(uint64_t{0});
  }
  ~RecordWriter() {
    const uint64_t length = bytes_.size() - length_at_ - sizeof(uint64_t);
    std::memcpy(bytes_.data() + length_at_, &length, sizeof(length));
  }
  RecordWriter(const RecordWriter&) = delete;
  RecordWriter& operator=(const RecordWriter&) = delete;

  template <class T>
  void put(T value) {
    writer_.put(value);
  }
  void put_text(const std::string& text) {
    put(static_cast<uint32_t>(text.size()));
    put_bytes(std::as_bytes(std::span(text)));
  }
  void put_bytes(std::span<const std::byte> bytes) { writer_.put_bytes(bytes); }
  void put_map(const std::map<uint16_t, uint64_t>& map) {
    put(static_cast<uint32_t>(map.size() * (sizeof(uint16_t) + sizeof(uint64_t))));
    for (const auto& [key, value] : map) {
      put(key);
      put(value);
    }
  }

 private:
  Bytes& bytes_;
  ByteWriter writer_;
  size_t length_at_ = 0;
};

std::string take_text(ByteReader& reader) {
  const auto bytes = reader.take_bytes(reader.take<uint32_t>());
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::map<uint16_t, uint64_t> take_map(ByteReader& reader) {
  ByteReader entries(reader.take_bytes(reader.take<uint32_t>()));
  std::map<uint16_t, uint64_t> map;
  while (!entries.rest().empty() && entries.ok()) {
    const auto key = entries.take<uint16_t>();
    const auto value = entries.take<uint64_t>();
    if (entries.ok()) map[key] = value;
  }
  return map;
}

template <class T>
Result<T> checked(const ByteReader& reader, T record, const char* name) {
  if (reader.ok()) return record;
  return make_error(ErrorCode::BadInput, "a {} is too short for what it says it holds", name);
}

}  // namespace

void append_magic(Bytes& bytes) {
  const auto magic = std::as_bytes(std::span(kMagic));
  bytes.insert(bytes.end(), magic.begin(), magic.end());
}

void append(const Header& record, Bytes& bytes) {
  RecordWriter writer(Opcode::Header, bytes);
  writer.put_text(record.profile);
  writer.put_text(record.library);
}

void append(const Schema& record, Bytes& bytes) {
  RecordWriter writer(Opcode::Schema, bytes);
  writer.put(record.id);
  writer.put_text(record.name);
  writer.put_text(kEncoding);
  writer.put(static_cast<uint32_t>(record.data.size()));
  writer.put_bytes(record.data);
}

void append(const Channel& record, Bytes& bytes) {
  RecordWriter writer(Opcode::Channel, bytes);
  writer.put(record.id);
  writer.put(record.schema_id);
  writer.put_text(record.topic);
  writer.put_text(kEncoding);
  writer.put(uint32_t{0});  // no metadata
}

void append(const Message& record, Bytes& bytes) {
  RecordWriter writer(Opcode::Message, bytes);
  writer.put(record.channel_id);
  writer.put(record.sequence);
  writer.put(record.log_time);
  writer.put(record.publish_time);
  writer.put_bytes(record.data);
}

void append(const Chunk& record, Bytes& bytes) {
  RecordWriter writer(Opcode::Chunk, bytes);
  writer.put(record.message_start_time);
  writer.put(record.message_end_time);
  writer.put(record.uncompressed_size);
  writer.put(record.uncompressed_crc);
  writer.put_text(record.compression);
  writer.put(static_cast<uint64_t>(record.records.size()));
  writer.put_bytes(record.records);
}

void append(const MessageIndex& record, Bytes& bytes) {
  RecordWriter writer(Opcode::MessageIndex, bytes);
  writer.put(record.channel_id);
  writer.put(static_cast<uint32_t>(record.records.size() * sizeof(IndexEntry)));
  for (const IndexEntry& entry : record.records) {
    writer.put(entry.log_time);
    writer.put(entry.offset);
  }
}

void append(const ChunkIndex& record, Bytes& bytes) {
  RecordWriter writer(Opcode::ChunkIndex, bytes);
  writer.put(record.message_start_time);
  writer.put(record.message_end_time);
  writer.put(record.chunk_start_offset);
  writer.put(record.chunk_length);
  writer.put_map(record.message_index_offsets);
  writer.put(record.message_index_length);
  writer.put_text(record.compression);
  writer.put(record.compressed_size);
  writer.put(record.uncompressed_size);
}

void append(const Statistics& record, Bytes& bytes) {
  RecordWriter writer(Opcode::Statistics, bytes);
  writer.put(record.message_count);
  writer.put(record.schema_count);
  writer.put(record.channel_count);
  writer.put(uint32_t{0});  // attachments
  writer.put(uint32_t{0});  // metadata
  writer.put(record.chunk_count);
  writer.put(record.message_start_time);
  writer.put(record.message_end_time);
  writer.put_map(record.channel_message_counts);
}

void append(const SummaryOffset& record, Bytes& bytes) {
  RecordWriter writer(Opcode::SummaryOffset, bytes);
  writer.put(static_cast<uint8_t>(record.group_opcode));
  writer.put(record.group_start);
  writer.put(record.group_length);
}

void append_data_end(uint32_t data_section_crc, Bytes& bytes) {
  RecordWriter writer(Opcode::DataEnd, bytes);
  writer.put(data_section_crc);
}

void append(const Footer& record, Bytes& bytes) {
  RecordWriter writer(Opcode::Footer, bytes);
  writer.put(record.summary_start);
  writer.put(record.summary_offset_start);
  writer.put(record.summary_crc);
}

void put_footer_crc(uint32_t crc, Bytes& bytes) {
  CHECK(bytes.size() >= sizeof(crc));
  std::memcpy(bytes.data() + bytes.size() - sizeof(crc), &crc, sizeof(crc));
}

RecordHead read_head(std::span<const std::byte, kRecordHeadBytes> bytes) {
  ByteReader reader(bytes);
  RecordHead head;
  head.opcode = static_cast<Opcode>(reader.take<uint8_t>());
  head.content_bytes = reader.take<uint64_t>();
  return head;
}

Result<Record> read_record(std::span<const std::byte> bytes) {
  if (bytes.size() < kRecordHeadBytes)
    return make_error(ErrorCode::BadInput, "{} bytes are left, which are no record", bytes.size());
  const RecordHead head = read_head(bytes.first<kRecordHeadBytes>());
  const auto rest = bytes.subspan(kRecordHeadBytes);
  if (head.content_bytes > rest.size())
    return make_error(ErrorCode::BadInput, "a record says that it has {} bytes, and {} are left",
                      head.content_bytes, rest.size());
  const auto size = static_cast<size_t>(head.content_bytes);
  return Record{head.opcode, rest.first(size), kRecordHeadBytes + size};
}

bool is_magic(std::span<const std::byte> bytes) {
  const auto magic = std::as_bytes(std::span(kMagic));
  return std::equal(bytes.begin(), bytes.end(), magic.begin(), magic.end());
}

Result<Header> read_header(std::span<const std::byte> content) {
  ByteReader reader(content);
  Header record;
  record.profile = take_text(reader);
  record.library = take_text(reader);
  return checked(reader, std::move(record), "header");
}

Result<Channel> read_channel(std::span<const std::byte> content) {
  ByteReader reader(content);
  Channel record;
  record.id = reader.take<uint16_t>();
  record.schema_id = reader.take<uint16_t>();
  record.topic = take_text(reader);
  return checked(reader, std::move(record), "channel");
}

Result<Message> read_message(std::span<const std::byte> content) {
  ByteReader reader(content);
  Message record;
  record.channel_id = reader.take<uint16_t>();
  record.sequence = reader.take<uint32_t>();
  record.log_time = reader.take<uint64_t>();
  record.publish_time = reader.take<uint64_t>();
  record.data = reader.rest();
  return checked(reader, record, "message");
}

Result<Chunk> read_chunk(std::span<const std::byte> content, uint64_t content_bytes) {
  ByteReader reader(content);
  Chunk record;
  record.message_start_time = reader.take<uint64_t>();
  record.message_end_time = reader.take<uint64_t>();
  record.uncompressed_size = reader.take<uint64_t>();
  record.uncompressed_crc = reader.take<uint32_t>();
  record.compression = take_text(reader);
  record.records_size = reader.take<uint64_t>();
  if (!reader.ok()) return make_error(ErrorCode::BadInput, "a chunk is too short for what it says it holds");
  const uint64_t head_bytes = content.size() - reader.rest().size();
  if (record.records_size != content_bytes - head_bytes)
    return make_error(ErrorCode::BadInput, "a chunk says that its records have {} bytes, and there are {}",
                      record.records_size, content_bytes - head_bytes);
  if (reader.rest().size() >= record.records_size)
    record.records = reader.take_bytes(static_cast<size_t>(record.records_size));
  return record;
}

Result<ChunkIndex> read_chunk_index(std::span<const std::byte> content) {
  ByteReader reader(content);
  ChunkIndex record;
  record.message_start_time = reader.take<uint64_t>();
  record.message_end_time = reader.take<uint64_t>();
  record.chunk_start_offset = reader.take<uint64_t>();
  record.chunk_length = reader.take<uint64_t>();
  record.message_index_offsets = take_map(reader);
  record.message_index_length = reader.take<uint64_t>();
  record.compression = take_text(reader);
  record.compressed_size = reader.take<uint64_t>();
  record.uncompressed_size = reader.take<uint64_t>();
  return checked(reader, std::move(record), "chunk index");
}

Result<Statistics> read_statistics(std::span<const std::byte> content) {
  ByteReader reader(content);
  Statistics record;
  record.message_count = reader.take<uint64_t>();
  record.schema_count = reader.take<uint16_t>();
  record.channel_count = reader.take<uint32_t>();
  reader.take_bytes(2 * sizeof(uint32_t));  // attachments, metadata
  record.chunk_count = reader.take<uint32_t>();
  record.message_start_time = reader.take<uint64_t>();
  record.message_end_time = reader.take<uint64_t>();
  record.channel_message_counts = take_map(reader);
  return checked(reader, std::move(record), "record of statistics");
}

Result<Footer> read_footer(std::span<const std::byte> content) {
  ByteReader reader(content);
  Footer record;
  record.summary_start = reader.take<uint64_t>();
  record.summary_offset_start = reader.take<uint64_t>();
  record.summary_crc = reader.take<uint32_t>();
  return checked(reader, record, "footer");
}

}  // namespace strandcast::mcap
