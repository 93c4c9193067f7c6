// RecordedStates: decodes the states of a recording in order, from any moment on. One thread.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/export/export_source.h"
#include "common/record/recording_reader.h"
#include "common/replay/strand_replay.h"
#include "common/wire/messages.h"

namespace strandcast {

class RecordedStates : public ExportSource {
 public:
  /// Opens a recording. Returns the errors of RecordingReader::open(), and errors for an unknown scene or
  /// codec.
  static Result<std::unique_ptr<RecordedStates>> open(const std::filesystem::path& path);

  const ExportScene& scene() const override { return scene_; }
  const TimecodeTrack& timecodes() const override { return timecodes_; }
  Result<std::optional<int64_t>> skip_to(double from_s) override;
  /// Returns the next state, null at the end. Damaged parts are skipped and counted.
  Result<std::shared_ptr<const Snapshot>> next() override;
  std::vector<std::string> remarks() const override;

  /// Moves to the last keyframe at or before this time, or to the first one; next() continues there.
  Status seek(int64_t sim_time_ns);
  /// Returns the scene that was recorded, as it began.
  const SceneDesc& simulated() const { return simulated_; }
  int64_t first_ns() const { return reader_->info().first_sim_time_ns; }
  int64_t last_ns() const { return reader_->info().last_sim_time_ns; }
  /// Returns look and camera at the newest state.
  const LookChange& look() const { return look_; }

 private:
  template <class What>
  struct Timed {
    int64_t time_ns = 0;  // server clock
    What what;
  };

  explicit RecordedStates(std::unique_ptr<RecordingReader> reader) : reader_(std::move(reader)) {}
  Status read_changes(const std::filesystem::path& path);
  Status follow(int64_t time_ns);

  std::unique_ptr<RecordingReader> reader_;  // of frames
  std::unique_ptr<StrandReplay> replay_;
  std::string codec_;  // of replay_
  ExportScene scene_;
  SceneDesc simulated_;
  LookChange look_;
  std::vector<Timed<LookChange>> looks_;    // in the order of time, the first from the start on
  std::vector<Timed<std::string>> codecs_;  // likewise
  TimecodeTrack timecodes_;
  uint64_t damaged_ = 0;   // parts that could not be read
  uint64_t rejected_ = 0;  // frames that could not be decoded
  uint64_t lost_ = 0;      // frames that the recorder had no room for
};

}  // namespace strandcast
