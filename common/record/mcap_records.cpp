#include "common/record/mcap_records.h"

#include <algorithm>
#include <concepts>
#include <cstring>

#include "common/base/check.h"
#include "common/strands/byte_io.h"

namespace strandcast::mcap {
namespace {

constexpr const char* kEncoding = "protobuf";

// ---- the one list of the fields of each record, walked by Writer and Reader ----

/// A record to be written, which stays as it is, or one to be read.
template <class T, class Record>
concept Is = std::same_as<std::remove_const_t<T>, Record>;

template <class Visitor, Is<Header> Record>
void visit(Visitor& v, Record& r) {
  v.text(r.profile);
  v.text(r.library);
}

template <class Visitor, Is<Schema> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.id);
  v.text(r.name);
  v.known_text(kEncoding);
  v.bytes(r.data);
}

template <class Visitor, Is<Channel> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.id);
  v.value(r.schema_id);
  v.text(r.topic);
  v.known_text(kEncoding);
  v.template nothing<uint32_t>();  // metadata
}

template <class Visitor, Is<Message> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.channel_id);
  v.value(r.sequence);
  v.value(r.log_time);
  v.value(r.publish_time);
  v.rest(r.data);
}

/// All but the records themselves.
template <class Visitor, Is<Chunk> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.message_start_time);
  v.value(r.message_end_time);
  v.value(r.uncompressed_size);
  v.value(r.uncompressed_crc);
  v.text(r.compression);
  v.value(r.records_size);
}

template <class Visitor, Is<MessageIndex> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.channel_id);
  v.entries(r.records);
}

template <class Visitor, Is<ChunkIndex> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.message_start_time);
  v.value(r.message_end_time);
  v.value(r.chunk_start_offset);
  v.value(r.chunk_length);
  v.map(r.message_index_offsets);
  v.value(r.message_index_length);
  v.text(r.compression);
  v.value(r.compressed_size);
  v.value(r.uncompressed_size);
}

template <class Visitor, Is<Statistics> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.message_count);
  v.value(r.schema_count);
  v.value(r.channel_count);
  v.template nothing<uint32_t>();  // attachments
  v.template nothing<uint32_t>();  // metadata
  v.value(r.chunk_count);
  v.value(r.message_start_time);
  v.value(r.message_end_time);
  v.map(r.channel_message_counts);
}

template <class Visitor, Is<SummaryOffset> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.group_opcode);
  v.value(r.group_start);
  v.value(r.group_length);
}

template <class Visitor, Is<Footer> Record>
void visit(Visitor& v, Record& r) {
  v.value(r.summary_start);
  v.value(r.summary_offset_start);
  v.value(r.summary_crc);
}

/// Appends one record; its length is known in the end.
class Writer {
 public:
  Writer(Opcode opcode, Bytes& bytes) : bytes_(bytes), writer_(bytes) {
    value(opcode);
    length_at_ = bytes_.size();
    value(uint64_t{0});
  }
  ~Writer() {
    const uint64_t length = bytes_.size() - length_at_ - sizeof(uint64_t);
    std::memcpy(bytes_.data() + length_at_, &length, sizeof(length));
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  template <class T>
  void value(T number) {
    if constexpr (std::is_enum_v<T>)
      writer_.put(static_cast<std::underlying_type_t<T>>(number));
    else
      writer_.put(number);
  }
  template <class T>
  void nothing() {
    writer_.put(T{});
  }
  void text(std::string_view text) { bytes(std::as_bytes(std::span(text))); }
  void known_text(std::string_view known) { text(known); }
  void bytes(std::span<const std::byte> bytes) {
    value(static_cast<uint32_t>(bytes.size()));
    rest(bytes);
  }
  void rest(std::span<const std::byte> bytes) { writer_.put_bytes(bytes); }
  void map(const std::map<uint16_t, uint64_t>& map) {
    value(static_cast<uint32_t>(map.size() * (sizeof(uint16_t) + sizeof(uint64_t))));
    for (const auto& [key, number] : map) {
      value(key);
      value(number);
    }
  }
  void entries(const std::vector<IndexEntry>& entries) {
    value(static_cast<uint32_t>(entries.size() * sizeof(IndexEntry)));
    for (const IndexEntry& entry : entries) {
      value(entry.log_time);
      value(entry.offset);
    }
  }

 private:
  Bytes& bytes_;
  ByteWriter writer_;
  size_t length_at_ = 0;
};

/// Of the records that are read; those that are not have fields that it does not know.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> content) : reader_(content) {}

  template <class T>
  void value(T& number) {
    number = reader_.take<T>();
  }
  template <class T>
  void nothing() {
    reader_.take<T>();
  }
  void text(std::string& text) {
    const auto bytes = reader_.take_bytes(reader_.take<uint32_t>());
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  void known_text(std::string_view) { reader_.take_bytes(reader_.take<uint32_t>()); }
  void rest(std::span<const std::byte>& bytes) { bytes = reader_.rest(); }
  void map(std::map<uint16_t, uint64_t>& map) {
    ByteReader entries(reader_.take_bytes(reader_.take<uint32_t>()));
    while (!entries.rest().empty() && entries.ok()) {
      const auto key = entries.take<uint16_t>();
      const auto number = entries.take<uint64_t>();
      if (entries.ok()) map[key] = number;
    }
  }
  const ByteReader& reader() const { return reader_; }

 private:
  ByteReader reader_;
};

template <class Record>
void append_record(Opcode opcode, const Record& record, Bytes& bytes) {
  Writer writer(opcode, bytes);
  visit(writer, record);
}

template <class Record>
Result<Record> read(std::span<const std::byte> content, const char* name) {
  Reader reader(content);
  Record record;
  visit(reader, record);
  if (reader.reader().ok()) return record;
  return make_error(ErrorCode::BadInput, "a {} is too short for what it says it holds", name);
}

}  // namespace

void append_magic(Bytes& bytes) {
  const auto magic = std::as_bytes(std::span(kMagic));
  bytes.insert(bytes.end(), magic.begin(), magic.end());
}

void append(const Header& record, Bytes& bytes) {
  append_record(Opcode::Header, record, bytes);
}
void append(const Schema& record, Bytes& bytes) {
  append_record(Opcode::Schema, record, bytes);
}
void append(const Channel& record, Bytes& bytes) {
  append_record(Opcode::Channel, record, bytes);
}
void append(const Message& record, Bytes& bytes) {
  append_record(Opcode::Message, record, bytes);
}
void append(const Chunk& record, Bytes& bytes) {
  Chunk head = record;
  head.records_size = record.records.size();
  Writer writer(Opcode::Chunk, bytes);
  visit(writer, head);
  writer.rest(record.records);
}
void append(const MessageIndex& record, Bytes& bytes) {
  append_record(Opcode::MessageIndex, record, bytes);
}
void append(const ChunkIndex& record, Bytes& bytes) {
  append_record(Opcode::ChunkIndex, record, bytes);
}
void append(const Statistics& record, Bytes& bytes) {
  append_record(Opcode::Statistics, record, bytes);
}
void append(const SummaryOffset& record, Bytes& bytes) {
  append_record(Opcode::SummaryOffset, record, bytes);
}
void append_data_end(uint32_t data_section_crc, Bytes& bytes) {
  Writer(Opcode::DataEnd, bytes).value(data_section_crc);
}
void append(const Footer& record, Bytes& bytes) {
  append_record(Opcode::Footer, record, bytes);
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
  return read<Header>(content, "header");
}
Result<Channel> read_channel(std::span<const std::byte> content) {
  return read<Channel>(content, "channel");
}
Result<Message> read_message(std::span<const std::byte> content) {
  return read<Message>(content, "message");
}
Result<Chunk> read_chunk(std::span<const std::byte> content, uint64_t content_bytes) {
  Reader head(content);
  Chunk record;
  visit(head, record);
  ByteReader records = head.reader();
  if (!records.ok()) return make_error(ErrorCode::BadInput, "a chunk is too short for what it says it holds");
  const uint64_t head_bytes = content.size() - records.rest().size();
  if (record.records_size != content_bytes - head_bytes)
    return make_error(ErrorCode::BadInput, "a chunk says that its records have {} bytes, and there are {}",
                      record.records_size, content_bytes - head_bytes);
  if (records.rest().size() >= record.records_size)
    record.records = records.take_bytes(static_cast<size_t>(record.records_size));
  return record;
}
Result<ChunkIndex> read_chunk_index(std::span<const std::byte> content) {
  return read<ChunkIndex>(content, "chunk index");
}
Result<Statistics> read_statistics(std::span<const std::byte> content) {
  return read<Statistics>(content, "record of statistics");
}
Result<Footer> read_footer(std::span<const std::byte> content) {
  return read<Footer>(content, "footer");
}

}  // namespace strandcast::mcap
