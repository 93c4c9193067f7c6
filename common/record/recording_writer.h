// RecordingWriter: writes the events of a server into the chunks of a recording. Frequent events share a
// message, and chunks are compressed where that takes fewer bytes. A keyframe is an uncompressed chunk of its
// own, so that a reader finds it without reading others. One thread.
#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include "common/record/mcap_writer.h"
#include "common/record/recording_layout.h"
#include "common/strands/frame_header.h"
#include "common/strands/zstd_block.h"
#include "common/wire/recording_messages.h"

namespace strandcast {

class RecordingWriter {
 public:
  /// Writes the beginning; `sink` outlives it. `asset`: the Asset message.
  RecordingWriter(mcap::ByteSink& sink, RecordingStart start, const EncodedFrame& asset);

  /// `time_ns`: server clock; never decreasing. `sim_time_ns`: of the newest state.
  void add(int64_t time_ns, int64_t sim_time_ns, const RecordedMessage& message);
  /// A keyframe or delta.
  void add(int64_t time_ns, const EncodedFrame& frame);
  /// All that was added is given to the sink, as far as it takes it.
  void flush();
  /// Does what flush() does, then writes start and asset again, since damage to the first ones would cost the
  /// whole file, and the index. Nothing can be added after it.
  void finish();

  uint64_t size_bytes() const { return file_.size_bytes(); }
  /// Sets what was lost since the start before it could be added.
  void note_lost(const RecordedLoss& outside) { lost_outside_ = outside; }
  /// Returns what was lost before it was added, and what the sink refused.
  RecordedLoss lost() const;

 private:
  /// What becomes a chunk.
  struct Part {
    mcap::ChunkBody body;
    std::map<uint16_t, RecordBatch> batches;  // by channel: of what comes often
    int64_t first_sim_ns = 0;                 // of what is in them
    uint64_t item_count = 0;
    size_t size_bytes = 0;
  };
  struct Item {
    uint16_t channel = 0;
    int64_t time_ns = 0;
    int64_t sim_time_ns = 0;
  };

  uint64_t log_time(int64_t time_ns) const;
  void put(Part& part, const Item& item, const mcap::Bytes& message);
  bool close(Part& part, bool is_vital);
  void close_frames();
  void close_messages();
  void put_what_it_is_of(int64_t sim_time_ns);

  const RecordingStart start_;
  const mcap::Bytes asset_;  // as a message
  mcap::McapWriter file_;
  Part frames_;
  Part messages_;
  ZstdCompressor compressor_;
  RecordedLoss lost_outside_;
  RecordedLoss lost_here_;
  RecordedLoss told_;   // of what was lost, in the file
  uint32_t order_ = 0;  // of the newest item
  int64_t newest_ns_ = 0;
  int64_t newest_sim_ns_ = 0;
};

}  // namespace strandcast
