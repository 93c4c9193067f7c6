// RecordedStates: the states of a recording, decoded one after the other, from any moment on. One thread.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/export/export_source.h"
#include "common/record/recording_reader.h"
#include "common/replay/strand_replay.h"
#include "common/wire/messages.h"

namespace strandcast {

class RecordedStates : public ExportSource {
 public:
  /// The errors of RecordingReader::open(), and of a scene or codec that this program does not know.
  static Result<std::unique_ptr<RecordedStates>> open(const std::filesystem::path& path);

  const ExportScene& scene() const override { return scene_; }
  Result<std::optional<int64_t>> skip_to(double from_s) override;
  /// The next state, null at the end. Damaged parts are left out and counted.
  Result<std::shared_ptr<const Snapshot>> next() override;
  std::vector<std::string> remarks() const override;

  /// The next state is then the last keyframe's at or before this time, or the first one.
  Status seek(int64_t sim_time_ns);
  int64_t first_ns() const { return reader_->info().first_sim_time_ns; }
  int64_t last_ns() const { return reader_->info().last_sim_time_ns; }
  /// Look and camera as they were with the newest state.
  const LookChange& look() const { return look_; }

 private:
  RecordedStates(std::unique_ptr<RecordingReader> reader, std::unique_ptr<StrandReplay> replay);
  void take(const RecordedMessage& message);

  std::unique_ptr<RecordingReader> reader_;
  std::unique_ptr<StrandReplay> replay_;
  ExportScene scene_;
  LookChange look_;
  uint64_t damaged_ = 0;  // parts that could not be read
  uint64_t lost_ = 0;     // frames that the recorder had no room for
};

}  // namespace strandcast
