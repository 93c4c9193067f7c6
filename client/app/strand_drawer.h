// StrandDrawer: draws strands of one or several heads on its own device and thread, so that a window never
// waits for hair. DrawPlan decides when and how finely. Only the newest inputs and the newest picture are
// kept. All functions from any thread.
#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "client/app/draw_plan.h"
#include "client/app/viewer_thread.h"
#include "common/base/profile.h"
#include "common/render/render_device.h"

namespace strandcast {

/// View of the strands: camera and size of the window.
struct DrawView {
  CameraDesc camera;
  RenderSize size;  // of the window
  DebugView debug_view = DebugView::None;
};

/// Newest results of drawing.
struct DrawnState {
  std::optional<Result<RenderDeviceInfo>> device;  // nothing while it is opened
  std::optional<Error> trouble;                    // why the newest scene cannot be drawn
  std::optional<Error> look_trouble;               // why the look of before is drawn, not the newest
  std::shared_ptr<const Image> image;              // null before the first
  size_t step = 0;                                 // of image
  int64_t sim_time_ns = 0;                         // the simulated moment that it is of
  RenderProfile profile;                           // likewise
  gl::PassReports passes;                          // of the renderer
  uint64_t renderer_bytes = 0;
  Interpolation interpolation = Interpolation::None;  // what image shows between states
  uint64_t linear_count = 0;                          // of pictures that were made so
  uint64_t cubic_count = 0;
  uint64_t count = 0;        // of pictures
  uint64_t asked_whole = 0;  // the last ask_whole() that image answers
  StageTimer draw_timer;     // of the whole run
  double fair_ms = 0.0;      // DrawPlan::fair_ms
};

class StrandDrawer {
 public:
  struct Config {
    RenderDeviceConfig device;
    std::function<void()> on_news;  // called by the drawing thread; must not block
  };
  explicit StrandDrawer(Config config);
  /// Ends the thread and abandons a picture in progress.
  ~StrandDrawer();
  StrandDrawer(const StrandDrawer&) = delete;
  StrandDrawer& operator=(const StrandDrawer&) = delete;

  /// Sets the number of heads, initially one. Input about other heads is ignored.
  void set_head_count(size_t count);
  /// Sets the server's state of one head; that of the first head also supplies what concerns all.
  void set_state(std::shared_ptr<const ViewerState> state, size_t head = 0);
  /// Sets the view; empty: no picture is wanted.
  void set_view(const std::optional<DrawView>& view);
  /// Sets a look for the first head instead of that of the server's scene; empty: the scene's look.
  void set_own_look(const std::optional<LookDesc>& look);
  /// Requests that the next picture has the finest level, whatever moves. Returns the request's number, which
  /// DrawnState reports when the picture is ready.
  uint64_t ask_whole();
  DrawnState look() const;

 private:
  struct Job {
    // By head; null: nothing is known of it.
    std::vector<std::shared_ptr<const ViewerState>> states{1};
    std::optional<DrawView> view;
    std::optional<LookDesc> own_look;
    uint64_t view_number = 0;  // of the view and the look
    uint64_t asked_whole = 0;

    const LookDesc& look(size_t head) const {
      return head == 0 && own_look ? *own_look : states[head]->look.look;
    }
  };
  /// Renderer and data of one head.
  struct Head {
    std::shared_ptr<const SceneAsset> asset;  // that renderer is made for, or could not be
    std::unique_ptr<Renderer> renderer;
    LookDesc look;  // that was wanted of it last
    TimelinePlayer player;
  };
  /// Pose and positions of one head's strands for a picture.
  struct HeadStrands {
    size_t head = 0;
    PosedStrands strands;
  };
  /// Inputs that determine the pixels of the newest picture.
  struct Drawn {
    std::vector<HeadStrands> heads;
    DrawView view;
    size_t step = 0;
    uint64_t asked_whole = 0;
    uint64_t look_count = 0;
  };

  void run();
  void draw_until_stopped(RenderDevice& device);
  std::optional<Job> wait_for_job();
  bool prepare(RenderDevice& device, const Job& job);
  bool prepare(RenderDevice& device, const Job& job, size_t index);
  void follow_look(Head& head, const LookDesc& look);
  void turn(const Job& job);
  static bool has_moved(const Drawn& from, const std::vector<HeadStrands>& to, const DrawView& view);
  std::vector<HeadStrands> strands_at(const Job& job, int64_t time_ns);
  Status draw(const Job& job, std::vector<HeadStrands> strands, size_t step);
  void fail(const Error& error);

  const Config config_;

  // Of the thread.
  std::vector<Head> heads_;
  uint64_t look_count_ = 0;  // of the looks that were
  DrawPlan plan_{0};
  std::optional<Drawn> drawn_;
  bool is_first_draw_ = true;      // it compiles and uploads
  std::optional<int64_t> due_ns_;  // to look again, though nobody told anything
  uint64_t done_version_ = 0;

  std::atomic<bool> is_stopping_{false};
  std::atomic<uint64_t> view_number_{0};

  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable changed_;
  uint64_t version_ = 0;  // of job_
  Job job_;
  DrawnState newest_;

  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace strandcast
