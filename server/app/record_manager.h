// RecordManager: the recordings of one head: the one that --record starts with it, and takes that controllers
// start and stop in the folder of --record-dir, one at a time, beside it or without it. Work that may wait
// for the disk runs on a thread of its own, which exists only with such a folder.
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
#include <vector>

#include "common/base/result.h"
#include "server/record/recorder.h"
#include "server/stream/state_source.h"
#include "server/stream/stream_hub.h"

namespace strandcast {

/// Free disk space that a recording by command needs to begin; it ends when half of that is left.
inline constexpr uint64_t kMinFreeRecordBytes = 1u << 30;
/// Largest number of recordings in the folder.
inline constexpr size_t kMaxRecordings = 1000;
inline constexpr size_t kMaxRecordingNameChars = 60;

inline constexpr const char* kNoRecordings =
    "Nobody begins or ends recordings on this server: start it with --record-dir DIR.";

/// Returns the free bytes on the disk of this folder; empty if unknown.
std::optional<uint64_t> free_bytes_of(const std::filesystem::path& folder);

/// Folder of recordings by command. Heads of one server have copies and begin their files in turn, so that
/// they keep its limits together.
struct RecordFolder {
  std::filesystem::path path;
  std::function<std::optional<uint64_t>(const std::filesystem::path&)> free_bytes = free_bytes_of;
  std::string file_ending = {};  // behind the name that somebody gave: head_file_endings()
  std::shared_ptr<std::mutex> beginning = std::make_shared<std::mutex>();
};

/// Returns the file name of a recording: its name plus .mcap. A name may contain letters, digits, space and .
/// _ - + as every file system accepts them; BadInput explains this.
Result<std::string> recording_file_name(const std::string& name);
/// Returns the name that a command gives its recording: its own, else of slate and take ("12A-T03"), else
/// none.
std::string recording_name(const RecordCommand& command);
/// Returns the file name of an unnamed recording, for example "builtin-20261126T151259Z.mcap".
std::string recording_file_name(const std::string& scene, int64_t unix_time_s);

class RecordManager {
 public:
  using Reply = StateSource::Reply;
  /// Parts of the head that are recorded; all of them must outlive stop().
  struct Stream {
    StreamHub& hub;
    StateSource& source;
    std::function<RecordingStart()> describe;  // as it runs; any thread
    std::function<EncodedFramePtr()> asset;    // message of the newest
    std::string scene_name;
    bool is_shared = false;  // the simulation goes on from what keyframes tell
  };

  /// Makes the manager, and the file of a recording that starts with the server. Returns the errors of
  /// Recorder::make(), or NotFound if the folder is missing.
  static Result<std::unique_ptr<RecordManager>> make(const std::optional<RecordConfig>& first,
                                                     const std::optional<RecordFolder>& folder);
  /// Calls stop() if it was not called.
  ~RecordManager();
  RecordManager(const RecordManager&) = delete;
  RecordManager& operator=(const RecordManager&) = delete;

  /// Returns the tap of the recording that starts with the server; null without one.
  StepTap* first_tap() { return whole_.get(); }
  /// Connects the manager to the stream; call it before the source starts.
  Status attach(Stream stream);
  /// Begins recording; call it after the source has started.
  void begin();
  /// Ends all recordings. The source must have stopped already.
  void stop();

  // From any thread; return at once.
  /// Starts or stops a take; without one, stops the recording that began with the server. The reply comes on
  /// another thread, unless the command is refused at once.
  void obey(const RecordCommand& command, Reply reply);
  /// Returns whether a recording is under way that a command began.
  bool has_take() const;
  /// Describes the recordings for a person: "take 5.mcap: 12.5 s, 3.2 MB", or why they ended; empty = nothing
  /// is recorded.
  std::string text() const;
  /// Returns slate and take of what is recorded, in one word; empty text without a slate, empty = nothing is.
  std::optional<std::string> slate() const;
  void add(const ServerStatus& status);
  /// Returns the counters of the recordings together, else of the one that began with the server and ended by
  /// itself; empty if nothing is recorded.
  std::optional<RecordCounters> counters() const;
  /// Why a recording in hand, or the one that began with the server, is not whole; nothing while all is well,
  /// or without one. Any thread.
  std::optional<Error> failure() const;

 private:
  struct Order {
    RecordCommand command;
    Reply reply;
  };

  explicit RecordManager(std::optional<RecordFolder> folder) : folder_(std::move(folder)) {}
  void run();
  void answer(const Order& order);
  Notice carry_out(const RecordCommand& command);
  Result<std::string> start_recording(const RecordCommand& command);
  Result<std::filesystem::path> choose_path(const RecordCommand& command) const;
  Result<std::unique_ptr<Recorder>> make_recorder(const RecordCommand& command) const;
  Status check_room() const;
  Result<uint64_t> change_tap(StepTap* tap, std::function<void()> at_change = {});
  std::string reason_to_end(const Recorder& recorder) const;
  void watch();
  std::string end(const std::shared_ptr<Recorder>& recorder);
  /// Returns those in hand, the one that began with the server first.
  std::vector<std::shared_ptr<Recorder>> recorders() const;

  const std::optional<RecordFolder> folder_;
  std::optional<Stream> stream_;

  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable changed_;
  std::shared_ptr<Recorder> whole_;  // of --record; null: none
  std::shared_ptr<Recorder> take_;   // of a command; likewise
  std::string take_slate_;           // of that one, as slate() has it
  std::unique_ptr<StepTap> both_;    // tells them both, while there are two
  std::string ended_;                // how the last one ended by itself; until somebody asks for another
  std::optional<Error> lost_;        // why the one of --record is not whole, once it was ended
  RecordCounters lost_counters_;     // of that one
  std::optional<Order> order_;       // that is carried out, or waits for it
  bool is_stopping_ = false;

  std::thread thread_;
};

/// The recordings of all heads of a server together. Any thread.
class RecordManagers {
 public:
  struct Of {
    std::string head;
    RecordManager* manager;  // outlives this
  };

  /// Makes the group from the managers of several heads.
  explicit RecordManagers(std::vector<Of> all) : all_(std::move(all)) {}

  /// Starts or stops recording on every head. Replies once, with the answers of all managers; an error if one
  /// manager failed.
  void obey(const RecordCommand& command, const RecordManager::Reply& reply) const;
  /// Describes the recordings of all heads like RecordManager::text(); names the heads that are not recorded
  /// if some are.
  std::string text() const;

 private:
  std::vector<Of> all_;
};

}  // namespace strandcast
