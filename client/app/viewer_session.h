// ViewerSession: a connection with the data that a viewer keeps of it: asset, strand replay, newest picture
// and newest status. It has no window or GL, so the window, the headless viewer and the checks share it. One
// thread.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/app/frame_trace.h"
#include "client/app/mode_control.h"
#include "client/app/notice_list.h"
#include "client/app/picture_latency.h"
#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/client/reconnect_policy.h"
#include "common/client/viewer_client.h"
#include "common/pictures/picture_decoder.h"
#include "common/replay/strand_replay.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Receives every decoded snapshot, in order.
using SnapshotListener = std::function<void(const std::shared_ptr<const Snapshot>&)>;

/// Time after which a call of pump() handles no further event, so that the caller can check clocks and stop
/// flags.
inline constexpr std::chrono::milliseconds kPumpSlice{20};

struct PictureStats {  // frames mode
  uint64_t received_frames = 0;
  uint64_t received_bytes = 0;
  uint64_t rejected_frames = 0;
  uint64_t missed_frames = 0;
  uint64_t whole_frames = 0;  // that needed no other
};

/// What sessions have counted, added up.
struct SessionTotals {
  uint64_t decoded_frames = 0;
  uint64_t received_frames = 0;  // strands and pictures
  uint64_t received_bytes = 0;   // of those
  uint64_t keyframes = 0;
  uint64_t gaps = 0;
  uint64_t missed_frames = 0;
  uint64_t rejected_frames = 0;
  uint64_t keyframe_requests = 0;
  uint64_t dropped_by_client = 0;
  uint64_t dropped_by_server = 0;
  uint64_t blank_pictures = 0;
  uint64_t whole_pictures = 0;
  uint64_t mode_changes = 0;
  uint64_t look_changes = 0;
  uint64_t quality_changes = 0;
  uint64_t motion_samples = 0;

  SessionTotals& operator+=(const SessionTotals& other);
};

class ViewerSession;
SessionTotals totals_of(ViewerSession& session);

class ViewerSession {
 public:
  /// Connects and prepares to decode. Returns the errors of ViewerClient::connect, and an error for an
  /// unknown codec.
  static Result<std::unique_ptr<ViewerSession>> open(const ClientConfig& config);

  /// Handles received events, waiting up to `timeout` for one. Handles all of them, or as many as fit in
  /// kPumpSlice and at least one frame. An error says why the connection ended; received data stays readable.
  Status pump(std::chrono::milliseconds timeout);

  /// Returns the server's Welcome; the strand codec and its reason are the present ones.
  const Welcome& welcome() const { return welcome_; }
  ViewerClient& client() { return *client_; }
  /// Returns the connection for other threads that send.
  std::shared_ptr<ViewerClient> shared_client() const { return client_; }
  StrandReplay& replay() { return *replay_; }
  const StrandReplay& replay() const { return *replay_; }

  /// Returns the asset; null until it arrived.
  const SceneAsset* asset() const { return asset_.get(); }
  std::shared_ptr<const SceneAsset> shared_asset() const { return asset_; }
  /// Returns the mode to show: strands or the server's pictures, whichever was decoded last. Before the first
  /// frame it is the Welcome's. So a change of mode takes effect only once there is something to show.
  StreamMode mode() const { return modes_->shown(); }
  /// Returns the reason of the mode for a person.
  std::string mode_reason() const { return modes_->look().reason; }
  uint64_t mode_changes() const { return modes_->look().changes; }
  /// Requests another mode, or leaves the choice to the server. The server carries out the newest request, at
  /// most one a second.
  void request_mode(StreamMode mode);
  /// Makes `modes` the owner of the mode; it begins a session there.
  void follow(std::shared_ptr<ModeControl> modes);

  /// Returns true once there is something to show: asset and snapshot, or a picture.
  bool has_picture() const;
  /// Counts frames of one single colour, and moments without anything to show after the first frame; it must
  /// be 0.
  uint64_t blank_pictures() const { return blank_pictures_; }
  /// Returns the server's newest decoded picture, null before the first.
  const Image* image() const { return image_.get(); }
  std::shared_ptr<const Image> shared_image() const { return image_; }
  uint64_t image_count() const { return image_count_; }
  /// Returns the simulation time of the newest picture, ns.
  int64_t image_sim_time_ns() const { return image_header_.sim_time_ns; }
  /// Returns true if no finer picture of that state will come.
  bool is_image_still() const { return (image_header_.flags & kStillPicture) != 0; }

  /// Returns how the server codes strands for this viewer; it changes with the link.
  const StreamQuality& quality() const { return quality_; }
  uint64_t quality_changes() const { return quality_changes_; }

  /// Returns the scene's present look and camera, from the Welcome or a later LookChange.
  const LookChange& look() const { return look_; }
  uint64_t look_changes() const { return look_changes_; }
  /// Returns the camera that a controller last gave this viewer; empty if none did.
  const std::optional<CameraDesc>& moved_camera() const { return moved_camera_; }
  uint64_t camera_moves() const { return camera_moves_; }
  /// Returns the camera given by a controller, else the scene's own.
  const CameraDesc& camera() const { return moved_camera_ ? *moved_camera_ : look_.camera; }
  /// Returns the present values of the server's parameters that were requested last; null before the first
  /// request.
  std::shared_ptr<const std::vector<ParameterInfo>> parameters() const { return parameters_; }
  /// Returns the answer to the last SceneRequest once, then empty.
  std::optional<SceneText> take_scene() { return std::exchange(scene_, std::nullopt); }

  /// Returns how the server makes pictures for this viewer; empty before it said so.
  const std::optional<FrameQuality>& frame_quality() const { return frame_quality_; }

  const ServerStatus& status() const { return status_; }
  bool has_status() const { return has_status_; }
  Heard heard() const { return {client_->heard_ns(), heard_.away_since_ns}; }
  /// Returns the server's last message about slow motion; empty if there was none.
  const std::string& last_slow_motion() const { return last_slow_motion_; }
  /// Returns the notices since the last call, at most the newest kMaxWaitingNotices.
  std::vector<Notice> take_notices() { return notices_.take(); }
  const PictureStats& picture_stats() const { return picture_stats_; }
  const StageTimer& picture_decode_timer() const { return picture_decode_timer_; }
  /// Times from a motion sample's arrival at the server to the decoded frame that shows it, in the present
  /// mode, ms.
  const StageTimer& motion_latency_timer() const {
    return mode() == StreamMode::Frames ? picture_latency_.timer() : replay_->motion_latency_timer();
  }
  /// Returns the number of decoded frames, strands and pictures.
  uint64_t decoded_frames() const;
  double connected_s() const;

  void set_snapshot_listener(SnapshotListener listener) { listener_ = std::move(listener); }
  /// Sets the trace that records every decoded frame, strands and pictures, from now on.
  void set_trace(std::shared_ptr<FrameTrace> trace);

 private:
  explicit ViewerSession(std::shared_ptr<ViewerClient> client);
  Status handle(ClientEvent& event);
  Status handle(const MediaEvent& event);
  Status take_asset(const MediaEvent& event);
  void take_picture(const MediaEvent& event);
  Status take_quality(StreamQuality quality);
  void take_quality(FrameQuality quality);
  void ask_for_states();
  void tell_times(const MediaEvent& event, const Snapshot* snapshot);
  void acknowledge(const MediaEvent& event, int64_t decode_begin_ns);
  void take_mode(ModeChange change);
  void take_look(const LookChange& look);
  void take_parameters(const ParameterList& list);
  void show(StreamMode mode);

  std::shared_ptr<ViewerClient> client_;
  Welcome welcome_;
  std::unique_ptr<StrandReplay> replay_;
  std::shared_ptr<const SceneAsset> asset_;
  PictureDecoder pictures_;
  std::shared_ptr<const Image> image_;        // a copy: others may still show it when the next one is decoded
  StreamMode asked_mode_ = StreamMode::Auto;  // in the Hello
  std::shared_ptr<ModeControl> modes_;
  bool was_shown_ = false;
  uint64_t blank_pictures_ = 0;
  uint64_t image_count_ = 0;
  FrameHeader image_header_;  // sequence 0 before the first
  std::optional<FrameQuality> frame_quality_;
  StreamQuality quality_;
  uint64_t quality_changes_ = 0;
  LookChange look_;
  uint64_t look_changes_ = 0;
  std::optional<CameraDesc> moved_camera_;
  uint64_t camera_moves_ = 0;
  std::shared_ptr<const std::vector<ParameterInfo>> parameters_;
  std::optional<SceneText> scene_;
  ServerStatus status_;
  bool has_status_ = false;
  Heard heard_;  // of the relay's server
  std::string last_slow_motion_;
  NoticeList notices_;
  LineBudget log_lines_;  // that the server's messages cause
  PictureStats picture_stats_;
  StageTimer picture_decode_timer_;
  PictureLatency picture_latency_;
  SnapshotListener listener_;
  std::shared_ptr<FrameTrace> trace_;  // null: none
  bool has_asked_states_ = false;      // the server is to tell of its states
  bool acknowledges_ = true;
  int64_t opened_ns_ = 0;
};

}  // namespace strandcast
