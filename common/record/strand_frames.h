// StrandFrames: the decoded strands of a recording, state by state. One thread.
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
  /// Starts decoding; `reader` must return frames and outlive this object.
  static Result<StrandFrames> begin(RecordingReader& reader);

  /// Returns the next state; empty at the end. An error concerns one frame or one damaged chunk.
  Result<std::shared_ptr<const Snapshot>> next();

 private:
  StrandFrames(RecordingReader& reader, std::unique_ptr<StrandDecoder> decoder)
      : reader_(&reader), decoder_(std::move(decoder)) {}

  RecordingReader* reader_;
  std::unique_ptr<StrandDecoder> decoder_;
};

/// Makes a decoder for the strands of a recording.
Result<std::unique_ptr<StrandDecoder>> make_recorded_decoder(const RecordingReader& reader);

}  // namespace strandcast
