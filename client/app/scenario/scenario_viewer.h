// ScenarioViewer: a viewer of a scenario on its own thread: decodes everything it receives, reconnects after
// the server was away, and measures. Its link may be artificially slow (common/chaos).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/app/live_connection.h"
#include "client/app/viewer_session.h"
#include "common/chaos/chaos_relay.h"
#include "common/client/viewer_client.h"
#include "common/math/coherence.h"
#include "common/scene/scenario.h"

namespace strandcast {

/// Totals since it joined; subtract two to get those of an interval.
struct ViewerCounts {
  uint64_t frames = 0;  // decoded, strands and pictures
  uint64_t strand_frames = 0;
  uint64_t strand_bytes = 0;
  uint64_t received_bytes = 0;  // of all messages
  uint64_t rejected_frames = 0;
};

/// Segment and state in which something was seen.
struct StretchPlace {
  size_t strand = 0;
  uint32_t vertex = 0;  // at the segment's root end
  double time_s = 0.0;  // simulated
  uint64_t tick = 0;
};

/// Coherence of the first state with the one before, and so on every tenth of a second.
struct SeenCoherence {
  Coherence all;  // summed, as strandcast-report coherence sums its moments
  uint32_t moment_count = 0;
  double worst_share = 0.0, worst_share_s = 0.0;  // of a moment, and when, simulated
  double least_order = 1.0, least_order_s = 0.0;  // likewise
};

/// State of the viewer at one moment.
struct ViewerLook {
  ViewerCounts counts;
  bool is_connected = false;
  std::string trouble;  // why not
  StreamMode mode = StreamMode::Strands;
  std::string mode_reason;
  uint64_t tick = 0;  // of the newest decoded state of strands
  uint32_t rate_divisor = 1;
  uint32_t vertices = 0;          // of a state of strands
  double largest_stretch = 0.0;   // since begin_measure()
  StretchPlace stretch_place;     // of it
  double stretch_grain = 0.0;     // no finer than this is seen, through the bound of the stream
  double bound_m = 0.0;           // that bound
  double largest_head_mps = 0.0;  // likewise, between two states; infinite for what is no number
  SeenCoherence coherence;        // likewise, where the task says so
  std::string codec;
  int64_t back_ns = 0;  // when it was back after begin_absence(), now_ns(); 0 = it is away
};

/// Data from which a picture is drawn.
struct ViewerPicture {
  std::shared_ptr<const SceneAsset> asset;
  std::shared_ptr<const Snapshot> state;  // of strands
  std::shared_ptr<const Image> image;     // of the server
  LookChange look;
  StreamMode mode = StreamMode::Strands;
  int64_t image_sim_time_ns = 0;
  int64_t image_seen_ns = 0;    // when it came, now_ns()
  bool is_image_still = false;  // none finer comes of that state
};

/// What the rest of the scenario asks of a viewer.
struct ViewerTask {
  bool has_changing_link = false;
  bool measures_coherence = false;
};

class ScenarioViewer {
 public:
  /// Connects, through a relay if the link is limited or changes; errors as
  /// ViewerSession::open().
  static Result<std::unique_ptr<ScenarioViewer>> join(const ScenarioView& view, ClientConfig config,
                                                      ViewerTask task);
  ~ScenarioViewer();
  ScenarioViewer(const ScenarioViewer&) = delete;
  ScenarioViewer& operator=(const ScenarioViewer&) = delete;

  // From any thread.
  const ScenarioView& view() const { return view_; }
  ViewerLook look() const;
  ViewerPicture picture() const;
  /// Restarts the measurement of stretch, speed and coherence.
  void begin_measure();
  /// From now on the viewer is away until it is connected and has decoded another frame.
  void begin_absence();
  /// Puts another line in the place of the one that it has. The viewer must have joined with
  /// a changing link.
  void change_link(const ScenarioLink& link);

 private:
  ScenarioViewer(ScenarioView view, ViewerTask task, std::unique_ptr<chaos::ChaosRelay> relay)
      : view_(std::move(view)), task_(task), relay_(std::move(relay)) {}
  void run(LiveConnection& live);
  void watch(ViewerSession& session);
  ViewerCounts counts_of(ViewerSession& session) const;
  void note(LiveConnection& live);
  void note_return();
  void take(ViewerSession& session, const std::shared_ptr<const Snapshot>& state);
  double head_mps(const Snapshot& state);
  void measure_moment(const std::shared_ptr<const Snapshot>& state);
  void measure_rest(const std::shared_ptr<const SceneAsset>& asset);

  const ScenarioView view_;
  const ViewerTask task_;
  const std::unique_ptr<chaos::ChaosRelay> relay_;  // null: straight to the server

  // Of the thread.
  ViewerCounts earlier_;  // of sessions that broke
  std::shared_ptr<const SceneAsset> measured_asset_;
  std::vector<float> rest_length_m_;  // (vertex_count - 1 x strand_count)
  Pose last_world_from_head_;
  int64_t last_sim_time_ns_ = 0;  // 0 = none
  std::shared_ptr<const Snapshot> last_state_;

  mutable std::mutex mutex_;    // guards the block below
  int64_t next_moment_ns_ = 0;  // simulated
  uint64_t frames_before_ = 0;  // back_ns is when there are more
  bool awaits_loss_ = false;    // its line was cut, and it has not noticed
  ViewerLook look_;
  ViewerPicture picture_;
  std::atomic<bool> is_leaving_{false};
  std::thread thread_;
};

}  // namespace strandcast
