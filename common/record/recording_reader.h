// RecordingReader: a recording of ours (MCAP, proto/RECORDING.md), whole or cut off where the server was
// killed. Its index is used where it has one and is made by walking over the chunks where not; one chunk at
// a time is in memory. Input is untrusted. One thread; reads a file that is still being written up to where
// it was flushed when it was opened.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "common/record/byte_source.h"
#include "common/strands/frame_header.h"
#include "common/strands/scene_asset.h"
#include "common/wire/recording_messages.h"

namespace strandcast {

/// A keyframe or delta of the recorded strands, in the form that StrandDecoder::decode() takes.
struct RecordedFrame {
  EncodedFramePtr frame;
  bool is_keyframe() const { return frame->header.opcode == Opcode::StrandKeyframe; }
};

/// Damaged items, one after the other, after which a recording is read no further.
inline constexpr uint32_t kMostDamagedInARow = 1'000;

struct RecordedItem {
  int64_t time_ns = 0;  // server clock, about when the recorder got it
  std::variant<RecordedFrame, RecordedMessage> what;
};

/// Kind of item that next() returns.
enum class RecordedPart {
  Frames,    // strands
  Messages,  // all else
  All,
};

/// Facts about the file that need no decoding of frames.
struct RecordingInfo {
  uint64_t file_bytes = 0;
  bool is_indexed = false;    // it was closed, or recovered
  uint64_t cut_bytes = 0;     // at the end, of a chunk that was not written whole
  std::string index_trouble;  // why an index that is there was not used; empty = all is well
  uint64_t chunk_count = 0;
  int64_t first_sim_time_ns = 0;
  int64_t last_sim_time_ns = 0;               // of the strands
  std::vector<int64_t> keyframe_sim_time_ns;  // in the order of the file; never decreasing in a sound one
};

/// Number of items of one channel in all readable chunks.
struct RecordedTopic {
  uint64_t items = 0;
  uint64_t bytes = 0;  // of the file; of a chunk with several topics by their share before it was compressed
};
using RecordingContents = std::map<std::string, RecordedTopic>;

class RecordingReader {
 public:
  /// NotFound, BadInput (no recording of ours, or nothing of it was flushed) or Unsupported (of a later
  /// version): one sentence that names the file.
  static Result<std::unique_ptr<RecordingReader>> open(const std::filesystem::path& path,
                                                       RecordedPart part = RecordedPart::All);
  static Result<std::unique_ptr<RecordingReader>> open(std::unique_ptr<ByteSource> source,
                                                       RecordedPart part = RecordedPart::All);
  ~RecordingReader();
  RecordingReader(const RecordingReader&) = delete;
  RecordingReader& operator=(const RecordingReader&) = delete;

  const RecordingStart& start() const;
  const RecordingInfo& info() const;
  /// What viewers got once: topology, strands at rest, the head. The Asset message whole, header in front.
  /// Null where it is damaged and Messages are read.
  const EncodedFramePtr& asset_frame() const;
  /// The same, decoded, or BadInput. Its payload's hash is checked against start().asset_hash.
  Result<SceneAsset> asset() const;

  /// Reads the whole file; next() then continues where it was.
  RecordingContents contents() const;

  /// Returns the next item in recorded order; empty at the end. RecordingStart and the asset are not among
  /// them. An error concerns one damaged chunk or message; the next call continues after it.
  Result<std::optional<RecordedItem>> next();

  /// Moves to the last keyframe at or before this simulated time, or the first one; messages continue from
  /// where it was written. Decode from there to the wanted frame.
  Status seek(int64_t sim_time_ns);

 private:
  class State;
  explicit RecordingReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Returns the step of a recording's first state: 0 if it began with the simulation, more otherwise; empty if
/// there is no state.
std::optional<uint64_t> first_recorded_tick(const std::filesystem::path& path);

}  // namespace strandcast
