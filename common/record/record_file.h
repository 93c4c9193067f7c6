// RecordFile: a new file that is written on a thread of its own. Its callers never wait for the disk: the
// bytes that wait are bounded, and bytes without room are refused.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "common/base/result.h"
#include "common/record/mcap_writer.h"

namespace strandcast {

/// Bytes that may wait for the disk, and further bytes that are kept for vital chunks.
inline constexpr uint64_t kMaxWaitingBytes = 64u << 20;
inline constexpr uint64_t kVitalBytes = 16u << 20;

enum class IfPresent { Refuse, Replace };

class RecordFile : public mcap::ByteSink {
 public:
  /// Makes the file, locked. BadInput where it is there and may not be replaced, is none of ours or another
  /// program writes it; NotFound or Unavailable where it cannot be written. An empty file is as good as none.
  /// What was there keeps its name until keep().
  static Result<std::unique_ptr<RecordFile>> make(const std::filesystem::path& path, IfPresent if_present);
  /// finish(); a file that was not kept is gone, and what was there is as it was.
  ~RecordFile() override;
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;

  /// From now on bytes are written. Call once, before take().
  void keep();
  bool take(mcap::Bytes bytes, bool is_vital) override;
  /// Waits until all is written, or cannot be.
  void finish();

  uint64_t waiting_bytes() const;
  uint64_t written_bytes() const;
  /// Why nothing is written any more; what was written whole before is in the file.
  std::optional<Error> failure() const;

 private:
  static constexpr int kNoFile = -1;
  struct Files {
    int written = kNoFile;
    int present = kNoFile;  // that is replaced; open so that nobody else replaces it too
  };
  RecordFile(Files files, std::filesystem::path path, std::filesystem::path first_path);
  void run();
  Status write(const mcap::Bytes& bytes);

  const int file_;
  const int present_;
  const std::filesystem::path path_;
  const std::filesystem::path first_path_;  // its name until keep()
  bool is_kept_ = false;

  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable changed_;
  std::deque<mcap::Bytes> waiting_;
  uint64_t waiting_bytes_ = 0;
  uint64_t written_bytes_ = 0;
  bool is_finishing_ = false;
  std::optional<Error> failure_;

  std::thread thread_;
};

}  // namespace strandcast
