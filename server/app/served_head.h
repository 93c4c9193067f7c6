// ServedHead: one head of a server: its scene, inputs, source of states, the hub of its stream, and what the
// application does with its sessions. A server has one to kMaxHeads behind one port; none knows of the
// others. Threads as in ARCHITECTURE.md; functions from the server's own thread unless said otherwise.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/app/frame_stages.h"
#include "server/app/heads_painter.h"
#include "server/app/live_desk.h"
#include "server/app/server.h"
#include "server/app/session_desk.h"
#include "server/app/slow_motion.h"

namespace strandcast {

class ServedHead {
 public:
  /// Asked once pictures are wanted, of what else they show.
  using OtherHeads = std::function<std::vector<PaintedHead>()>;
  /// Loads the scene of `config`, which has one head. `number`: among those of the server; `others`: empty
  /// where there are none.
  static Result<std::unique_ptr<ServedHead>> load(const ServerConfig& config, size_t number,
                                                  OtherHeads others);
  /// stop(), if it was not called.
  ~ServedHead();
  ServedHead(const ServedHead&) = delete;
  ServedHead& operator=(const ServedHead&) = delete;

  /// Null where nothing is recorded, nor can be.
  RecordDesk* records() { return records_.get(); }
  /// What its live inputs move.
  LiveDesk::Target live_target();
  /// What the server knows that its heads do not.
  struct Whole {
    LiveDesk* live = nullptr;                         // null: no head has live inputs
    std::vector<std::string> heads;                   // names of all where there are several
    std::function<std::optional<SceneDesc>()> scene;  // with all heads, as it runs; from any thread
    std::function<std::string()> metrics;             // likewise
    const RecordDesks* records = nullptr;             // of all heads, where there are several that record
  };
  /// Makes what its sessions speak to.
  NetHead admit(Whole whole);
  /// Lets the simulation run, for sessions of `net`, which outlives stop().
  Status start(NetServer& net);
  /// Behind the network and the live inputs.
  void stop();
  /// Twice a second, by one thread: says to its viewers how it runs.
  void tell_status();

  // From any thread once it was admitted.
  const std::string& name() const { return config_.scene.name; }
  StreamHub& hub() { return *hub_; }
  PaintedHead painted() { return {hub_.get(), source_->asset()}; }
  /// As it runs; nothing where it is no scene.
  std::optional<SceneDesc> scene() const;
  /// All but those of the network.
  ServerCounters counters() const;
  gl::PassReports passes() const;
  std::string stage_metrics() const { return stages_.metrics(); }
  std::optional<Error> failure() const { return source_->failure(); }
  bool is_shut_down_wanted() const { return desk_->is_shut_down_wanted(); }

 private:
  ServedHead(const ServerConfig& config, size_t number) : config_(config), number_(number) {}
  Status load(OtherHeads others);
  MakePicturePainter make_painter(const PainterConfig& painter, OtherHeads others);
  Status choose_stream();
  Status choose_codecs();
  RecordingStart describe_recording() const;
  void watch_speed(const ServerCounters& now);
  void lower_quality();
  void count_strands(ServerCounters& counters) const;
  gl::PassReports idle_picture_passes() const;

  ServerConfig config_;
  const size_t number_;
  bool is_drawn_by_processors_ = true;  // pictures, whatever simulates
  InputHub inputs_;
  std::unique_ptr<RecordDesk> records_;  // null: nothing is recorded, nor can be
  FrameStages stages_;
  std::vector<StrandCodecInfo> codecs_;  // that strands are served by, the scene's first
  EncodedFramePtr asset_frame_;          // at first
  RenderDeviceConfig painting_;
  LiveDesk* live_ = nullptr;
  NetServer* net_ = nullptr;
  // In the order in which each is used by those below it.
  std::unique_ptr<StreamHub> hub_;
  std::optional<StageSink> stage_sink_;
  std::unique_ptr<StateSource> source_;
  std::unique_ptr<SessionDesk> desk_;

  mutable std::mutex idle_passes_mutex_;  // guards the two below
  mutable LookDesc idle_look_;
  mutable gl::PassReports idle_picture_passes_;  // what the frame thread would run for that look

  // Of who tells the status, but for the two that metrics read.
  SlowMotionWatch slow_watch_;
  std::string slow_motion_;  // what viewers are told; empty = real time
  std::atomic<bool> is_slow_{false};
  bool has_lowered_quality_ = false;
  std::atomic<uint64_t> slow_motions_{0};
};

}  // namespace strandcast
