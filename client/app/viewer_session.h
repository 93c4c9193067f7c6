// ViewerSession: a connection plus what a viewer keeps of it: the asset, the strand replay, the newest
// picture and the newest status. Without window or GL, so the window, the headless viewer and the checks
// share it. One thread.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/app/frame_trace.h"
#include "client/app/line_budget.h"
#include "client/app/mode_control.h"
#include "client/app/notice_list.h"
#include "client/app/picture_latency.h"
#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/client/viewer_client.h"
#include "common/pictures/picture_decoder.h"
#include "common/replay/strand_replay.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Called for every decoded snapshot, in order.
using SnapshotListener = std::function<void(const std::shared_ptr<const Snapshot>&)>;

/// A call of pump() handles no further event after so long: between two calls others look at clocks and
/// stops.
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
  /// Connects and prepares to decode; the errors of ViewerClient::connect and of an unknown codec.
  static Result<std::unique_ptr<ViewerSession>> open(const ClientConfig& config);

  /// Handles what arrived, waiting up to `timeout` for something: all of it, or as much as kPumpSlice allows
  /// and at least one frame. The error is why the connection ended; what was received stays readable.
  Status pump(std::chrono::milliseconds timeout);

  /// As the server said it, but for the codec of strands and its reason, which are those of now.
  const Welcome& welcome() const { return welcome_; }
  ViewerClient& client() { return *client_; }
  /// For other threads that send.
  std::shared_ptr<ViewerClient> shared_client() const { return client_; }
  StrandReplay& replay() { return *replay_; }
  const StrandReplay& replay() const { return *replay_; }

  /// Null until it arrived.
  const SceneAsset* asset() const { return asset_.get(); }
  std::shared_ptr<const SceneAsset> shared_asset() const { return asset_; }
  /// What is to be shown: strands or the server's pictures, whichever was decoded last; before the first,
  /// what the Welcome says. A change of mode thus shows only once there is something to show.
  StreamMode mode() const { return modes_->shown(); }
  /// Why, for a person.
  std::string mode_reason() const { return modes_->look().reason; }
  uint64_t mode_changes() const { return modes_->look().changes; }
  /// Asks for another mode, or leaves the choice to the server, which carries out one request a second, the
  /// newest.
  void request_mode(StreamMode mode);
  /// From now on `modes` is what knows the mode: it begins with this session.
  void follow(std::shared_ptr<ModeControl> modes);

  /// True once there is something to show: asset and snapshot, or a picture.
  bool has_picture() const;
  /// Frames of one colour only, and moments without anything to show after the first frame: must be 0.
  uint64_t blank_pictures() const { return blank_pictures_; }
  /// The newest decoded picture of the server, null before the first.
  const Image* image() const { return image_.get(); }
  std::shared_ptr<const Image> shared_image() const { return image_; }
  uint64_t image_count() const { return image_count_; }
  /// Of the newest picture.
  int64_t image_sim_time_ns() const { return image_sim_time_ns_; }

  /// How the server codes strands for this viewer; changes with the link.
  const StreamQuality& quality() const { return quality_; }
  uint64_t quality_changes() const { return quality_changes_; }

  /// What the scene looks like now, and its own camera: as the Welcome said, or a LookChange since.
  const LookChange& look() const { return look_; }
  uint64_t look_changes() const { return look_changes_; }
  /// Where somebody who controls had this viewer look from last; nothing: nobody did.
  const std::optional<CameraDesc>& moved_camera() const { return moved_camera_; }
  uint64_t camera_moves() const { return camera_moves_; }
  /// That, else the scene's own.
  const CameraDesc& camera() const { return moved_camera_ ? *moved_camera_ : look_.camera; }
  /// Of the server's parameters those that were asked for last, as they are now; null: nobody has asked yet.
  std::shared_ptr<const std::vector<ParameterInfo>> parameters() const { return parameters_; }
  /// The answer to the last SceneRequest, once.
  std::optional<SceneText> take_scene() { return std::exchange(scene_, std::nullopt); }

  /// How the server makes pictures for this viewer; nothing before it said so.
  const std::optional<FrameQuality>& frame_quality() const { return frame_quality_; }

  const ServerStatus& status() const { return status_; }
  bool has_status() const { return has_status_; }
  /// What the server said when it last ran in slow motion; empty if it never did.
  const std::string& last_slow_motion() const { return last_slow_motion_; }
  /// Notices since the last call, the newest kMaxWaitingNotices.
  std::vector<Notice> take_notices() { return notices_.take(); }
  const PictureStats& picture_stats() const { return picture_stats_; }
  const StageTimer& picture_decode_timer() const { return picture_decode_timer_; }
  /// From the arrival of a motion sample at the server to what was decoded and shows it, in this mode, ms.
  const StageTimer& motion_latency_timer() const {
    return mode() == StreamMode::Frames ? picture_latency_.timer() : replay_->motion_latency_timer();
  }
  /// Frames decoded so far, strands and pictures.
  uint64_t decoded_frames() const;
  double connected_s() const;

  void set_snapshot_listener(SnapshotListener listener) { listener_ = std::move(listener); }
  /// Every decoded frame, strands and pictures, goes into it with its times, from now on.
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
  int64_t image_sim_time_ns_ = 0;
  uint32_t last_picture_sequence_ = 0;
  uint16_t last_picture_stream_ = 0;
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
  std::string last_slow_motion_;
  NoticeList notices_;
  LineBudget log_lines_;  // that the server's messages cause
  PictureStats picture_stats_;
  StageTimer picture_decode_timer_;
  PictureLatency picture_latency_;
  SnapshotListener listener_;
  std::shared_ptr<FrameTrace> trace_;  // null: none
  bool has_asked_states_ = false;      // the server is to tell of its states
  int64_t opened_ns_ = 0;
};

}  // namespace strandcast
