// Texts in the window about the connection, the view and the measurements. Pure text, one thread.
#pragma once

#include <string>

#include "client/app/draw_plan.h"
#include "client/app/viewer_thread.h"
#include "client/window/hud.h"
#include "common/render/renderer.h"

namespace strandcast {

/// Simulated time per real time below which, for this long, slow motion is reported.
inline constexpr double kSlowMotion = 0.95;
inline constexpr int64_t kSlowMotionNs = 2'000'000'000;

/// Counts per second, averaged over two seconds.
class Rate {
 public:
  /// Updates with a running total, which may restart from 0.
  void update(uint64_t total, int64_t time_ns);
  double per_s() const { return per_s_; }

 private:
  uint64_t begin_total_ = 0;
  int64_t begin_ns_ = 0;
  double per_s_ = 0.0;
};

/// Facts that the window knows besides the viewer's state.
struct ViewFacts {
  Address address;
  Playout playout = Playout::LowLatency;
  Interpolation interpolation = Interpolation::None;  // of the newest picture of strands
  std::string own_reason;                             // why this machine needs frames
  std::string message;                                // the newest notice
  bool has_own_look = false;                          // not the scene's
  bool is_starting = false;                           // OpenGL
  size_t draw_step = 0;
  double draw_ms = 0.0;    // median
  std::string drawn_by;    // empty: not known yet
  gl::PassReports passes;  // of what draws strands
  uint64_t renderer_bytes = 0;
  RenderProfile profile;  // of the newest picture of strands
  DebugView debug_view = DebugView::None;
  double answer_ms = 0.0;    // median, from waking up to the picture on the display
  uint64_t shown_count = 0;  // different pictures
  std::vector<WayPart> way;  // of what was shown in the last second
  // Names of the heads that are drawn; none where there is one. What is said of the scene is of the first.
  std::vector<std::string> heads;
  std::vector<std::string> stale_heads;  // of those behind the first: nothing moves them
};

class HudWriter {
 public:
  HudState write(const ViewerState& now, const ViewFacts& facts, int64_t time_ns);
  double shown_hz() const { return shown_.per_s(); }

 private:
  std::vector<std::string> warnings(const ViewerState& now, const ViewFacts& facts, int64_t time_ns);
  std::vector<HudRow> rows(const ViewerState& now, const ViewFacts& facts, int64_t time_ns) const;

  Rate shown_, bytes_, received_;
  int64_t real_time_ns_ = 0;  // when the server last kept up
};

}  // namespace strandcast
