// McapWriter: an MCAP file record by record: schemas and channels first, then chunks, each with the indexes
// of its messages after it, and the index of all chunks at the end. Without that end it is a file that
// readers of streams can read. One thread; the sink may write the bytes on another.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/record/mcap_records.h"

namespace strandcast::mcap {

/// Takes the bytes of a file, in order.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// False when there is no room for them: then the file goes on without them. `is_vital`: of all that is
  /// dropped, these last.
  virtual bool take(Bytes bytes, bool is_vital) = 0;
};

/// What becomes a chunk: whole records of messages, and where each message begins.
struct ChunkBody {
  Bytes records;
  uint64_t message_start_time = 0;
  uint64_t message_end_time = 0;
  std::map<uint16_t, std::vector<IndexEntry>> index;  // by channel

  bool is_empty() const { return index.empty(); }
  void add(const Message& message);
};

class McapWriter {
 public:
  /// `sink` outlives it. Writes the header, schemas and channels, whatever room there is.
  McapWriter(ByteSink& sink, const Header& header, std::vector<Schema> schemas,
             std::vector<Channel> channels);

  /// Returns false if there was no room; then nothing of it is in the file. `records` are those of `body` in
  /// the form that the file gets, compressed by `compression`: "" or "zstd".
  bool write(const ChunkBody& body, std::span<const std::byte> records, const std::string& compression,
             bool is_vital);
  /// The end: with it the file is whole. Nothing can be written after.
  void finish();

  /// Bytes given to the sink so far.
  uint64_t size_bytes() const { return size_bytes_; }

 private:
  bool give(Bytes bytes, bool is_vital);

  ByteSink& sink_;
  const std::vector<Schema> schemas_;
  const std::vector<Channel> channels_;
  std::vector<ChunkIndex> chunks_;
  Statistics statistics_;
  uint64_t size_bytes_ = 0;
  uint32_t crc_ = 0;  // of all of them
};

}  // namespace strandcast::mcap
