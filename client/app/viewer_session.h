// ViewerSession: a connection plus what a viewer keeps of it: the asset, the strand replay, the newest
// picture and the newest status. Without window or GL, so the window, the headless viewer and the checks
// share it. One thread.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/net/viewer_client.h"
#include "client/replay/strand_replay.h"
#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/codec/image_codec.h"
#include "common/codec/scene_asset.h"

namespace strandcast {

/// Called for every decoded snapshot, in order.
using SnapshotListener = std::function<void(const std::shared_ptr<const Snapshot>&)>;

struct PictureStats {  // frames mode
  uint64_t received_frames = 0;
  uint64_t received_bytes = 0;
  uint64_t rejected_frames = 0;
  uint64_t missed_frames = 0;
};

class ViewerSession {
 public:
  /// Connects and prepares to decode; the errors of ViewerClient::connect and of an unknown codec.
  static Result<std::unique_ptr<ViewerSession>> open(const ClientConfig& config);

  /// Handles everything that arrived, waiting up to `timeout` for something. The error is why the connection
  /// ended; what was received stays readable.
  Status pump(std::chrono::milliseconds timeout);

  const Welcome& welcome() const { return client_->welcome(); }
  ViewerClient& client() { return *client_; }
  StrandReplay& replay() { return *replay_; }
  const StrandReplay& replay() const { return *replay_; }

  /// Null until it arrived.
  const SceneAsset* asset() const { return asset_ ? &*asset_ : nullptr; }
  /// True once there is something to show: asset and snapshot, or a picture.
  bool has_picture() const;
  /// Frames mode: the newest decoded picture, null before the first.
  const Image* image() const { return image_ ? &*image_ : nullptr; }
  uint64_t image_count() const { return image_count_; }

  /// How the server codes strands for this viewer; changes with the link.
  const StreamQuality& quality() const { return quality_; }
  uint64_t quality_changes() const { return quality_changes_; }

  const ServerStatus& status() const { return status_; }
  bool has_status() const { return has_status_; }
  /// Notices since the last call.
  std::vector<Notice> take_notices() { return std::exchange(notices_, {}); }
  const PictureStats& picture_stats() const { return picture_stats_; }
  const StageTimer& picture_decode_timer() const { return picture_decode_timer_; }
  /// Frames decoded so far in the mode chosen by the server.
  uint64_t decoded_frames() const;
  double connected_s() const;

  void set_snapshot_listener(SnapshotListener listener) { listener_ = std::move(listener); }

 private:
  ViewerSession(std::unique_ptr<ViewerClient> client);
  Status handle(MediaEvent& event);
  Status take_asset(const MediaEvent& event);
  void take_picture(const MediaEvent& event);
  void take_quality(StreamQuality quality);
  void acknowledge(const MediaEvent& event, int64_t decode_begin_ns);

  std::unique_ptr<ViewerClient> client_;
  std::unique_ptr<StrandReplay> replay_;
  std::optional<SceneAsset> asset_;
  std::optional<Image> image_;
  uint64_t image_count_ = 0;
  uint32_t last_picture_sequence_ = 0;
  StreamQuality quality_;
  uint64_t quality_changes_ = 0;
  ServerStatus status_;
  bool has_status_ = false;
  std::vector<Notice> notices_;
  PictureStats picture_stats_;
  StageTimer picture_decode_timer_;
  SnapshotListener listener_;
  int64_t opened_ns_ = 0;
};

}  // namespace strandcast
