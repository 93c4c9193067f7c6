// ViewerThread: receives, decodes and acknowledges frames on its own thread. So slow drawing does not delay
// acknowledgements, and slow decoding does not delay pictures. It publishes the newest state, which is
// immutable and whose size a ViewerSession bounds. All functions from one other thread.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "client/app/live_connection.h"
#include "client/app/view_report.h"
#include "common/replay/strand_replay.h"

namespace strandcast {

/// State of the viewer at one moment, to be shown and reported.
struct ViewerState {
  uint64_t session_number = 0;  // 0 = there has been none; another one after every new connection
  bool is_connected = false;
  std::string trouble;               // why not; empty also before the first attempt has failed
  std::string help;                  // what a person can do about it
  std::string doing;                 // what is being done about it
  std::optional<Error> final_error;  // trying again cannot help
  Welcome welcome;
  std::shared_ptr<const SceneAsset> asset;  // null until it came
  ModeView mode;
  SnapshotTimeline timeline;           // strands
  std::shared_ptr<const Image> image;  // the server's newest picture
  uint64_t image_count = 0;
  int64_t image_sim_time_ns = 0;
  StreamQuality quality;
  uint64_t quality_changes = 0;
  LookChange look;  // of the scene
  uint64_t look_changes = 0;
  std::shared_ptr<const std::vector<ParameterInfo>> parameters;  // asked for; null: none yet
  std::optional<CameraDesc> moved_camera;                        // by somebody who controls
  uint64_t camera_moves = 0;
  ServerStatus status;
  bool has_status = false;
  ConnectionCounters net;
  uint64_t decoded_frames = 0;
  double exact_share = 0.0;  // of the strand frames: without corrections
  uint64_t missed_frames = 0;
  uint64_t wrong_states = 0;
  double strand_decode_ms = 0.0;  // medians
  double picture_decode_ms = 0.0;
  double motion_to_decoded_ms = 0.0;
  double playout_delay_ms = 0.0;
  double round_trip_ms = 0.0;
  std::optional<int64_t> server_clock_offset_ns;  // less this machine's
  double state_age_ms = 0.0;                      // when this was made
  int64_t made_ns = 0;
};

/// Receives each new state immediately, on the receiving thread.
using NewsListener = std::function<void(const std::shared_ptr<const ViewerState>&)>;

class ViewerThread {
 public:
  /// Starts the thread; `live` need not have a session yet.
  explicit ViewerThread(std::unique_ptr<LiveConnection> live, NewsListener listener = {});
  /// Ends the thread.
  ~ViewerThread();
  ViewerThread(const ViewerThread&) = delete;
  ViewerThread& operator=(const ViewerThread&) = delete;

  /// Returns the newest state; never null.
  std::shared_ptr<const ViewerState> look() const;
  /// Returns the notices since the last call, at most the newest kMaxWaitingNotices.
  std::vector<Notice> take_notices();
  /// Returns the answer to the last SceneRequest once, then empty.
  std::optional<SceneText> take_scene();
  /// Sends a message on the current connection like ViewerClient::send; Unavailable before the first
  /// connection.
  Status send(const ClientMessage& message);
  void set_playout(Playout playout) { playout_ = playout; }
  /// Requests this mode from the server, immediately and in later sessions.
  void request_mode(StreamMode mode);
  StreamMode wanted_mode() const { return modes_->look().wanted; }
  /// Ends the thread and returns its measurements; empty if there was no session.
  std::optional<ViewReport> stop_and_report();

 private:
  void run();
  void receive();
  void fail(const std::string& what);
  void stop();
  void publish();
  void describe(ViewerState& state);
  std::shared_ptr<ViewerClient> client() const;

  std::unique_ptr<LiveConnection> live_;  // of the thread while it runs
  const std::shared_ptr<ModeControl> modes_;
  const NewsListener listener_;
  uint64_t session_number_ = 0;
  std::atomic<bool> is_stopping_{false};
  std::atomic<Playout> playout_{Playout::LowLatency};

  mutable std::mutex mutex_;  // guards the block below
  std::shared_ptr<const ViewerState> state_;
  std::shared_ptr<ViewerClient> client_;
  NoticeList notices_;
  std::optional<SceneText> scene_;

  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace strandcast
