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
  std::string codec;
};

/// Data from which a picture is drawn.
struct ViewerPicture {
  std::shared_ptr<const SceneAsset> asset;
  std::shared_ptr<const Snapshot> state;  // of strands
  std::shared_ptr<const Image> image;     // of the server
  LookChange look;
  StreamMode mode = StreamMode::Strands;
};

/// Whether a viewer's link is the same from the start to the end.
enum class LinkUse { Stays, Changes };

class ScenarioViewer {
 public:
  /// Connects, through a relay if the link is limited or changes; errors as
  /// ViewerSession::open().
  static Result<std::unique_ptr<ScenarioViewer>> join(const ScenarioView& view, ClientConfig config,
                                                      LinkUse use);
  ~ScenarioViewer();
  ScenarioViewer(const ScenarioViewer&) = delete;
  ScenarioViewer& operator=(const ScenarioViewer&) = delete;

  // From any thread.
  const ScenarioView& view() const { return view_; }
  ViewerLook look() const;
  ViewerPicture picture() const;
  /// Measures the last state with the one before; empty before there are two of one server.
  std::optional<Coherence> coherence() const;
  /// Restarts the measurement of the largest stretch and speed.
  void begin_measure();
  /// Puts another line in the place of the one that it has. The viewer must have joined with
  /// LinkUse::Changes.
  void change_link(const ScenarioLink& link);

 private:
  ScenarioViewer(ScenarioView view, std::unique_ptr<chaos::ChaosRelay> relay)
      : view_(std::move(view)), relay_(std::move(relay)) {}
  void run(LiveConnection& live);
  void watch(ViewerSession& session);
  ViewerCounts counts_of(ViewerSession& session) const;
  void note(LiveConnection& live);
  void take(ViewerSession& session, const std::shared_ptr<const Snapshot>& state);
  double head_mps(const Snapshot& state);
  void measure_rest(const std::shared_ptr<const SceneAsset>& asset);

  const ScenarioView view_;
  const std::unique_ptr<chaos::ChaosRelay> relay_;  // null: straight to the server

  // Of the thread.
  ViewerCounts earlier_;  // of sessions that broke
  std::shared_ptr<const SceneAsset> measured_asset_;
  std::vector<float> rest_length_m_;  // (vertex_count - 1 x strand_count)
  Pose last_world_from_head_;
  int64_t last_sim_time_ns_ = 0;  // 0 = none

  mutable std::mutex mutex_;  // guards the block below
  std::shared_ptr<const Snapshot> last_state_, state_before_;
  ViewerLook look_;
  ViewerPicture picture_;
  std::atomic<bool> is_leaving_{false};
  std::thread thread_;
};

}  // namespace strandcast
