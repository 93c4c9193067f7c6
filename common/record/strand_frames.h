// StrandFrames: the decoded strands of a recording, one state after the other. One thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "common/base/result.h"
#include "common/record/recording_reader.h"
#include "common/strands/strand_codec.h"

namespace strandcast {

class StrandFrames {
 public:
  /// `reader` gives frames at least, and outlives it.
  static Result<StrandFrames> begin(RecordingReader& reader);

  /// The next state; nothing at the end. An error is that of one frame, or of one damaged chunk.
  Result<std::shared_ptr<const Snapshot>> next();

 private:
  StrandFrames(RecordingReader& reader, std::unique_ptr<StrandDecoder> decoder)
      : reader_(&reader), decoder_(std::move(decoder)) {}

  RecordingReader* reader_;
  std::unique_ptr<StrandDecoder> decoder_;
};

/// A decoder for the strands of a recording.
Result<std::unique_ptr<StrandDecoder>> make_recorded_decoder(const RecordingReader& reader);

}  // namespace strandcast
