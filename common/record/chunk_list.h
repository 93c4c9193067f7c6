// ChunkList: where the chunks of a recording are: out of its index, or found by walking over its records.
// Input is untrusted. One thread.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/record/byte_source.h"
#include "common/record/mcap_writer.h"

namespace strandcast {

inline constexpr uint16_t kUnknownChannel = 0;  // a file that was cut off behind the chunk does not say
inline constexpr uint16_t kSeveralChannels = 0xffff;

struct ChunkPlace {
  uint64_t offset = 0;                 // of its record
  uint64_t size_bytes = 0;             // of the record with its head; all of it lies in the file
  uint64_t start_time = 0;             // log_time of its first message
  uint16_t channel = kUnknownChannel;  // of its messages
};

struct ChunkList {
  mcap::Header header;
  std::map<uint16_t, std::string> topics;       // of channels, by id
  std::vector<ChunkPlace> chunks;               // in the order of the file
  std::map<uint16_t, uint64_t> message_counts;  // by channel, of MCAP's messages
  bool is_indexed = false;
  std::string index_trouble;  // why an index that is there was not used
  uint64_t cut_bytes = 0;     // at the end, of a record that is not whole
  bool has_end = false;       // a walk came to the end of the data
  uint64_t data_end = 0;      // offset behind the last record before that
  uint32_t data_crc = 0;      // as said there; 0 = not
};

/// Whether it begins with the magic and a header of ours, or BadInput.
Status check_is_recording(ByteSource& source);
/// Begins with the magic and a header of ours, or BadInput.
Result<ChunkList> list_chunks(ByteSource& source);
/// Lists the chunks by walking over the records, never by the index.
Result<ChunkList> walk_chunks(ByteSource& source);

/// A chunk in memory, its CRC checked.
struct LoadedChunk {
  mcap::Bytes records;      // decompressed
  std::string compression;  // of the file: "" or "zstd"
  mcap::Bytes stored;       // as they are there; empty where they are not compressed
};
Result<LoadedChunk> load_chunk(ByteSource& source, const ChunkPlace& place);
/// Where the messages of such records begin, so that they can be written again. BadInput for records without
/// any, or on a channel that recordings do not have.
Result<mcap::ChunkBody> chunk_body_of(mcap::Bytes records);

}  // namespace strandcast
