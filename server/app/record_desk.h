// RecordDesk: the recording of one head: the one that --record begins with it, and those that who controls
// begins and ends in the folder of --record-dir, one at a time. What may wait for the disk is done by a
// thread of its own, which is there with such a folder only.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/base/result.h"
#include "server/record/recorder.h"
#include "server/stream/state_source.h"
#include "server/stream/stream_hub.h"

namespace strandcast {

/// A recording by command begins where so much is free on the disk, and ends where half of it is left.
inline constexpr uint64_t kMinFreeRecordBytes = 1u << 30;
/// So many recordings may lie in the folder.
inline constexpr size_t kMaxRecordings = 1000;
inline constexpr size_t kMaxRecordingNameChars = 60;

inline constexpr const char* kNoRecordings =
    "Nobody begins or ends recordings on this server: start it with --record-dir DIR.";

/// On the disk of this folder; nothing where it cannot be said.
std::optional<uint64_t> free_bytes_of(const std::filesystem::path& folder);

/// Where recordings by command go. Heads of one server have copies, and begin their files one behind the
/// other, so that they keep its limits together.
struct RecordFolder {
  std::filesystem::path path;
  std::function<std::optional<uint64_t>(const std::filesystem::path&)> free_bytes = free_bytes_of;
  std::string file_ending = {};  // behind the name that somebody gave: head_file_endings()
  std::shared_ptr<std::mutex> beginning = std::make_shared<std::mutex>();
};

/// The file of a recording that is called so: letters, digits, space and . _ - + as they are on every system,
/// with .mcap behind; BadInput says what a name may be.
Result<std::string> recording_file_name(const std::string& name);
/// Of one that nobody has given a name: "builtin-20261126T151259Z.mcap".
std::string recording_file_name(const std::string& scene, int64_t unix_time_s);

class RecordDesk {
 public:
  using Reply = StateSource::Reply;
  /// What is recorded; all of it outlives stop().
  struct Stream {
    StreamHub& hub;
    StateSource& source;
    std::function<RecordingStart()> describe;  // as it runs; any thread
    std::function<EncodedFramePtr()> asset;    // message of the newest
    std::string scene_name;
  };

  /// Makes the file of the recording that begins with the server. The errors of Recorder::make(), or NotFound
  /// where there is no such folder.
  static Result<std::unique_ptr<RecordDesk>> make(const std::optional<RecordConfig>& first,
                                                  const std::optional<RecordFolder>& folder);
  /// stop(), if it was not called.
  ~RecordDesk();
  RecordDesk(const RecordDesk&) = delete;
  RecordDesk& operator=(const RecordDesk&) = delete;

  /// Of the recording that begins with the server; null without one.
  StepTap* first_tap() { return recorder_.get(); }
  /// Before the source starts.
  Status attach(Stream stream);
  /// Behind its start.
  void begin();
  /// Ends what is recorded. The source has stopped, so that nothing comes any more.
  void stop();

  // From any thread; return at once.
  /// The answer comes on another thread, unless it is refused at once.
  void obey(const RecordCommand& command, Reply reply);
  /// For people: "take 5.mcap: 12.5 s, 3.2 MB", or how it ended by itself; empty = nothing is recorded.
  std::string text() const;
  void add(const ServerStatus& status);
  /// Nothing while nothing is recorded.
  std::optional<RecordCounters> counters() const;

 private:
  struct Order {
    RecordCommand command;
    Reply reply;
  };

  explicit RecordDesk(std::optional<RecordFolder> folder) : folder_(std::move(folder)) {}
  void run();
  void answer(const Order& order);
  Notice carry_out(const RecordCommand& command);
  Result<std::string> start_recording(const std::string& name);
  Result<std::filesystem::path> choose_path(const std::string& name) const;
  Result<std::unique_ptr<Recorder>> make_recorder(const std::string& name) const;
  Status check_room() const;
  Result<uint64_t> change_tap(StepTap* tap, std::function<void()> at_change = {});
  std::string reason_to_end(const Recorder& recorder) const;
  void watch();
  std::string end();
  std::shared_ptr<Recorder> recorder() const;

  const std::optional<RecordFolder> folder_;
  std::optional<Stream> stream_;

  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable changed_;
  std::shared_ptr<Recorder> recorder_;  // null: nothing is recorded
  std::string ended_;                   // how the last one ended by itself; until somebody asks for another
  std::optional<Order> order_;          // that is carried out, or waits for it
  bool is_stopping_ = false;

  std::thread thread_;
};

}  // namespace strandcast
