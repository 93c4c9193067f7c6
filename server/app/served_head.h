// ServedHead: one head of a server: its scene, inputs, source of states, stream hub, and the application's
// part of its sessions. A server has one to kMaxHeads behind one port, and no head knows of the others.
// Threads as in ARCHITECTURE.md; functions are called on the server's own thread unless stated otherwise.
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
#include "server/app/live_manager.h"
#include "server/app/server.h"
#include "server/app/session_manager.h"
#include "server/app/slow_motion.h"

namespace strandcast {

class ServedHead {
 public:
  /// Returns the other heads that pictures show; called once pictures are wanted.
  using OtherHeads = std::function<std::vector<PaintedHead>()>;
  /// Loads the scene of `config`, which has one head. `number`: the head's index in the server; `others`:
  /// empty if there are none.
  static Result<std::unique_ptr<ServedHead>> load(const ServerConfig& config, size_t number,
                                                  OtherHeads others);
  /// Calls stop() if it was not called.
  ~ServedHead();
  ServedHead(const ServedHead&) = delete;
  ServedHead& operator=(const ServedHead&) = delete;

  /// Returns the recordings; null if recording is not possible.
  RecordManager* records() { return records_.get(); }
  /// Returns the inputs that live sources drive.
  LiveManager::Target live_target();
  /// Parts of the server that heads share.
  struct Whole {
    LiveManager* live = nullptr;                      // null: no head has live inputs
    std::vector<std::string> heads;                   // names of all where there are several
    std::function<std::optional<SceneDesc>()> scene;  // with all heads, as it runs; from any thread
    std::function<std::string()> metrics;             // likewise
    const RecordManagers* records = nullptr;          // of all heads, where there are several that record
    std::vector<StateSource*> sources = {};           // of all heads, where there are several
  };
  /// Makes the handler of this head's sessions.
  NetHead admit(Whole whole);
  /// Starts the simulation for the sessions of `net`, which must outlive stop().
  Status start(NetServer& net);
  /// Ends the head; call it after the network and the live inputs have stopped.
  void stop();
  /// Sends the status to the head's viewers; called twice a second by one thread.
  void tell_status();

  // From any thread once it was admitted.
  const std::string& name() const { return config_.scene.name; }
  StreamHub& hub() { return *hub_; }
  StateSource& source() { return *source_; }
  PaintedHead painted() { return {hub_.get(), source_->asset()}; }
  /// Returns the scene as it runs; empty if the source has no scene.
  std::optional<SceneDesc> scene() const;
  /// Returns all counters except those of the network.
  ServerCounters counters() const;
  gl::PassReports passes() const;
  std::string stage_metrics() const { return stages_.metrics(); }
  std::optional<Error> failure() const { return source_->failure(); }
  bool is_shut_down_wanted() const { return manager_->is_shut_down_wanted(); }

 private:
  ServedHead(const ServerConfig& config, size_t number) : config_(config), number_(number) {}
  Status load(OtherHeads others);
  MakePicturePainter make_painter(const PainterConfig& painter, OtherHeads others);
  Status choose_stream();
  Status choose_codecs();
  RecordingStart describe_recording() const;
  HeadTold told() const;
  void count_by_the_clock();
  void watch_speed(const ServerCounters& now);
  void lower_quality();
  std::string quality_reason() const;
  void count_strands(ServerCounters& counters) const;
  gl::PassReports idle_picture_passes() const;

  ServerConfig config_;
  const size_t number_;
  bool is_drawn_by_processors_ = true;  // pictures, whatever simulates
  InputHub inputs_;
  std::unique_ptr<RecordManager> records_;  // null: nothing is recorded, nor can be
  FrameStages stages_;
  std::vector<StrandCodecInfo> codecs_;  // that strands are served by, the scene's first
  EncodedFramePtr asset_frame_;          // at first
  RenderDeviceConfig painting_;
  LiveManager* live_ = nullptr;
  NetServer* net_ = nullptr;
  // In the order in which each is used by those below it.
  SharedSlot shared_;  // outlives who uses it
  std::unique_ptr<HeadSender> sender_;
  std::unique_ptr<StreamHub> hub_;
  std::unique_ptr<StateSource> source_;
  std::unique_ptr<SessionManager> manager_;

  mutable std::mutex idle_passes_mutex_;  // guards the two below
  mutable LookDesc idle_look_;
  mutable gl::PassReports idle_picture_passes_;  // what the frame thread would run for that look

  // Of who tells the status, but for the two that metrics read.
  SlowMotionWatch slow_watch_;
  std::string slow_motion_;  // what viewers are told; empty = real time
  std::atomic<bool> is_slow_{false};
  bool has_lowered_quality_ = false;
  std::atomic<bool> is_too_slow_{false};  // for full
  std::atomic<uint64_t> slow_motions_{0};
};

}  // namespace strandcast
