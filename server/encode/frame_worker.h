// FrameWorker: a thread that decodes the strand stream like a client, draws it for viewers of pictures and
// encodes the pictures. It draws once per camera and size and encodes once per picture class. Each view gets
// a fair share of the time (picture_turns.h). It sleeps while there are no views, and nothing waits for it.
// All functions from any thread.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/pictures/picture.h"
#include "common/strands/frame_header.h"
#include "common/strands/strand_codec.h"
#include "server/encode/picture_encoder.h"
#include "server/encode/picture_painter.h"
#include "server/encode/picture_turns.h"
#include "server/encode/picture_views.h"

namespace strandcast {

/// Totals since start; medians cover the last kStageWindow frames.
struct FrameCounters {
  uint64_t frames = 0;             // encoded
  uint64_t bytes = 0;              // of those, header and payload
  uint64_t paints = 0;             // drawings
  uint64_t unchanged = 0;          // not sent: nothing to be seen had changed
  uint64_t stills = 0;             // encoded once more, finely, after standing still
  uint64_t wholes = 0;             // given again, whole, because a viewer asked
  uint64_t decoded = 0;            // strand frames
  uint64_t chain_losses = 0;       // times the decoder had to wait for a keyframe
  uint64_t left_out_strands = 0;   // of the newest drawing, for lack of memory
  uint64_t unusable_segments = 0;  // likewise, with a position that is no number
  double paint_median_ms = 0.0;    // draw and read back
  double encode_median_ms = 0.0;
};

/// Number of periods without change after which a picture is sent once more at the finest quality.
inline constexpr uint32_t kStillPeriods = 5;

/// Time for which a painter without views is kept for a viewer who looks away, and sees the next picture at
/// once.
inline constexpr int64_t kPainterRestNs = 300'000'000'000;

struct FrameWorkerConfig {
  double rate_hz = 15.0;                   // at most so many frames of each view in a second
  uint32_t still_periods = kStillPeriods;  // 0 = no stills
};

class FrameWorker {
 public:
  struct Hooks {
    /// Receives the frames of all picture classes (PictureViews), on the worker's thread.
    std::function<void(uint32_t picture_class, PicturePtr picture)> sink;
    /// Requests a keyframe from the strand encoder, on any thread.
    std::function<void()> request_keyframe;
    /// Requests one more state, the newest at this time (now_ns()); the next drawing begins when it has come.
    /// If empty, the encoder sends all states.
    std::function<void(int64_t not_before_ns)> request_state;
    /// Reports, on the worker's thread, that one class cannot be drawn; it is left out until its view
    /// changes. May be empty.
    std::function<void(uint32_t picture_class, const Error& error)> on_refused;
    /// Reports, on the worker's thread, that a class keeps its look because the newest cannot be drawn. May
    /// be empty.
    std::function<void(uint32_t picture_class, const Error& error)> on_look_refused;
    /// Reports once, on the worker's thread, that no frames can be drawn any more, for example without GL.
    /// May be empty.
    std::function<void(const Error& error)> on_failure;
  };

  /// Starts the thread.
  FrameWorker(std::unique_ptr<StrandDecoder> decoder, MakePicturePainter make_painter,
              FrameWorkerConfig config, Hooks hooks);
  /// Ends the thread after the current frame.
  ~FrameWorker();
  FrameWorker(const FrameWorker&) = delete;
  FrameWorker& operator=(const FrameWorker&) = delete;

  /// Offers every strand frame, in the order of the chain. Returns at once; frames are dropped while there
  /// are no views.
  void offer(EncodedFramePtr strand_frame);
  /// Sets what is drawn from now on, by picture class. Without views the painter is destroyed after
  /// `painter_rest_ns`, and strand frames are not needed.
  void set_views(std::map<uint32_t, PictureView> views, int64_t painter_rest_ns = 0);
  /// Sets the look from now on and redraws current pictures. Before the first call it is that of the painter.
  void set_look(const LookDesc& look);
  /// Sends the newest picture of a class again, for viewers that have none; for video, at the next permitted
  /// keyframe. Ignored for unknown classes and before the first picture.
  void request_whole(uint32_t picture_class);
  /// Redraws current pictures without a new strand frame, because something else has changed.
  void redraw();
  /// Returns true while strand frames must be offered.
  bool has_views() const;

  /// Returns why no frames can be drawn; empty while they can.
  std::optional<Error> failure() const;
  FrameCounters counters() const;
  /// Returns the states drawn since the last call that hold a newer motion sample than the one before; at
  /// most the newest kMaxPictureMotions.
  std::vector<PictureMotion> take_motions();
  /// Returns the passes of the thread with their times; empty while there is nothing to draw.
  gl::PassReports passes() const;

 private:
  /// Progress of one class.
  struct Drawn {
    PictureView view;
    std::unique_ptr<PictureEncoder> encoder;  // null until the first picture of this size and codec
    uint32_t last_sequence = 0;               // of the encoders before it
    uint64_t decode_count = 0;                // when last drawn, 0 = never with this view
    int64_t sim_time_ns = 0;                  // of the state that was drawn
    PictureSchedule schedule;
    int64_t change_ns = 0;     // when the picture last changed
    double cost_ms = 0.0;      // smoothed, of drawing and encoding this view; 0 = not known
    int64_t spacing_ns = 0;    // between the beginnings of two drawings
    bool is_blocking = false;  // as in PictureTurn
    bool is_still = false;     // and was sent finely since
    bool is_whole_wanted = false;
    bool is_refused = false;  // this view cannot be drawn
  };
  /// Work that other threads have left for the worker.
  struct Job {
    std::deque<EncodedFramePtr> strand_frames;
    std::map<uint32_t, PictureView> views;
    int64_t painter_rest_ns = 0;
    bool has_gap = false;
    std::set<uint32_t> wholes;
    std::optional<LookDesc> look;
    bool is_redrawn = false;
    bool is_stopping = false;
  };
  enum class Task { Paint, Whole, Still };
  struct Due {
    uint32_t picture_class = 0;
    Task task = Task::Paint;
    PictureWait wait;
  };

  void run();
  Job wait_for_job();
  bool can_draw() const { return !views_.empty() && !failure_; }  // mutex_ is held
  void begin();
  void rest(int64_t painter_rest_ns);
  void take_look(LookDesc look);
  void update_views(const std::map<uint32_t, PictureView>& views);
  void decode(const std::deque<EncodedFramePtr>& strand_frames);
  void request_state(int64_t free_ns);
  void note_arrival(const EncodedFrame& frame, double decode_ms);
  void share_time();
  void note_cost(const std::vector<uint32_t>& classes, double cost_ms);
  std::optional<Due> next_due() const;
  std::optional<Due> next_due_of(uint32_t picture_class, const Drawn& drawn) const;
  int64_t period_ns(const Drawn& drawn) const { return drawn.view.rate_divisor * frame_interval_ns_; }
  int64_t paint_due_ns(const Drawn& drawn) const;
  void serve(const Due& due);
  void paint_alike(const PictureView& view);
  Result<Image> paint(const PictureView& view);
  void follow_look();
  void note_motion();
  void note_left_out();
  Status encode(uint32_t picture_class, const Image& image);
  Status resend(const Due& due);
  PictureStamp stamp(uint32_t picture_class, bool is_still) const;
  void give(uint32_t picture_class, const PicturePtr& picture);
  void refuse(uint32_t picture_class, const Error& error);
  void fail(const Error& error);

  std::unique_ptr<StrandDecoder> decoder_;
  MakePicturePainter make_painter_;
  const FrameWorkerConfig config_;
  const int64_t frame_interval_ns_;
  Hooks hooks_;

  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable changed_;
  std::deque<EncodedFramePtr> pending_;
  size_t pending_bytes_ = 0;
  std::map<uint32_t, PictureView> views_;
  int64_t painter_rest_ns_ = 0;
  bool has_new_views_ = false;
  bool has_gap_ = false;  // strand frames came by while nobody watched
  std::set<uint32_t> wanted_wholes_;
  std::optional<LookDesc> new_look_;
  bool is_redraw_wanted_ = false;
  bool is_stopping_ = false;
  std::optional<Error> failure_;
  FrameCounters counters_;
  StageTimer paint_timer_;
  StageTimer encode_timer_;
  PictureTimers timers_;
  std::deque<PictureMotion> motions_;
  gl::PassReports painted_;  // by the painter, with its times; empty without one

  // Of the worker's thread.
  bool is_active_ = false;
  int64_t resting_since_ns_ = 0;  // while it is not
  std::unique_ptr<PicturePainter> painter_;
  std::optional<LookDesc> look_;         // of the pictures; nothing = as painters are made
  std::optional<LookDesc> wanted_look_;  // not yet tried
  std::shared_ptr<const Snapshot> snapshot_;
  uint64_t decode_count_ = 0;
  int64_t motion_time_ns_ = 0;  // of the newest drawing
  bool was_left_out_ = false;   // of a drawing, and told
  bool is_chain_lost_ = true;   // until a keyframe comes
  std::map<uint32_t, Drawn> drawn_;
  double ms_per_pixel_ = 0.0;     // of the newest drawing: the guess for views that were never drawn
  int64_t blocking_rest_ns_ = 0;  // until then no blocking view is drawn
  int64_t asked_ns_ = 0;          // when the state that was asked for may be taken; 0 = none is awaited
  double lead_ms_ = 0.0;          // smoothed, from then until it is decoded

  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace strandcast
