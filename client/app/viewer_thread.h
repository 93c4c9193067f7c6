// ViewerThread: receives, decodes and acknowledges on a thread of its own, so that slow drawing delays no
// acknowledgement and slow decoding no picture. It hands over one immutable state, the newest; its size is
// bounded by what a ViewerSession keeps. All functions from one other thread.
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
#include "common/replay/snapshot_timeline.h"

namespace strandcast {

/// What there is to show and to tell, as of one moment.
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
  uint64_t missed_frames = 0;
  double strand_decode_ms = 0.0;  // medians
  double picture_decode_ms = 0.0;
  double motion_to_decoded_ms = 0.0;
  double playout_delay_ms = 0.0;
  double round_trip_ms = 0.0;
  std::optional<int64_t> server_clock_offset_ns;  // less this machine's
  double state_age_ms = 0.0;                      // when this was made
  int64_t made_ns = 0;
};

/// Told on the receiving thread of each new state, at once.
using NewsListener = std::function<void(const std::shared_ptr<const ViewerState>&)>;

class ViewerThread {
 public:
  /// `live` need not have a session yet.
  explicit ViewerThread(std::unique_ptr<LiveConnection> live, NewsListener listener = {});
  /// Ends the thread.
  ~ViewerThread();
  ViewerThread(const ViewerThread&) = delete;
  ViewerThread& operator=(const ViewerThread&) = delete;

  /// The newest state; never null.
  std::shared_ptr<const ViewerState> look() const;
  /// Notices since the last call, the newest kMaxWaitingNotices.
  std::vector<Notice> take_notices();
  /// The answer to the last SceneRequest, once.
  std::optional<SceneText> take_scene();
  /// As ViewerClient::send, to the running connection; Unavailable before the first.
  Status send(const ClientMessage& message);
  void set_playout(Playout playout) { playout_ = playout; }
  /// Asks the server for this mode, at once, and in later sessions too.
  void request_mode(StreamMode mode);
  StreamMode wanted_mode() const { return modes_->look().wanted; }
  /// Ends the thread; what it measured. Nothing when there was no session.
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
