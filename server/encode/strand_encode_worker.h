// StrandEncodeWorker: a thread that encodes the newest snapshot once for all viewers of strands, and
// keyframes for those who join. Nothing is encoded while nobody listens. All functions from any thread.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "common/base/profile.h"
#include "common/gl/pass_list.h"
#include "common/strands/frame_header.h"
#include "common/strands/strand_codec.h"
#include "server/publish/shared_slot.h"
#include "server/publish/snapshot_slot.h"

namespace strandcast {

/// Totals since start; the median covers the last kStageWindow encodes.
struct StrandEncodeCounters {
  uint64_t encodes = 0;      // states appended to the chain
  uint64_t keyframes = 0;    // keyframes made (not: handed out again)
  uint64_t too_large = 0;    // snapshots that did not fit into one message
  uint64_t delta_bytes = 0;  // header and payload
  uint64_t keyframe_bytes = 0;
  uint64_t exact = 0;  // deltas without corrections
  double encode_median_ms = 0.0;
  double keyframe_median_ms = 0.0;
};

/// How one strand class encodes the published states.
struct StrandEncodeConfig {
  uint16_t stream_id = 0;     // of its frames
  uint32_t rate_divisor = 1;  // at most one state per so many simulation steps
  uint32_t coarsening = 1;    // lattice steps per step of the published lattice
  float strand_share = 1.0f;  // in (0, 1]: the first strands only
  float quantum_m = 0.0f;     // states on another published lattice are left out; 0 = all are taken
};

/// Time after which the newest state is encoded even if its turn has not come, because the simulation is
/// paused.
inline constexpr std::chrono::milliseconds kLongestStateWait{250};

/// Returns the snapshot on a lattice that is `factor` times coarser; the error grows by at most `factor`
/// times the present one.
Snapshot coarsen(const Snapshot& snapshot, uint32_t factor);

/// Which readers the frames of a class have.
enum class StrandListeners {
  None,       // nothing is encoded
  OnRequest,  // whoever draws pictures: a state when it asks for one (request_state)
  All,        // every state of the class's rate
};

/// Returns the report line: "encode/strands" for the first class, "encode/strands_3" for stream 3.
gl::PassReport strand_encode_report(uint16_t stream_id, bool has_listeners, const StageTimer& timer);

class StrandEncodeWorker {
 public:
  /// Receives frames on the worker's thread, in the order of the chain, with send_time_ns set. The keyframe
  /// of sequence s comes after delta s and before delta s + 1, so a decoder continues from it with delta s +
  /// 1. A state that is encoded again for joiners while nothing moves gets a new sequence number.
  using Sink = std::function<void(EncodedFramePtr)>;

  /// Starts the thread. `slot` must outlive the worker, and so must `shared`, which gets the strands that
  /// viewers have (null: nobody).
  StrandEncodeWorker(SnapshotSlot& slot, std::unique_ptr<StrandEncoder> encoder, Sink sink,
                     StrandEncodeConfig config = {}, SharedSlot* shared = nullptr);
  /// Ends the thread after the current encode.
  ~StrandEncodeWorker();
  StrandEncodeWorker(const StrandEncodeWorker&) = delete;
  StrandEncodeWorker& operator=(const StrandEncodeWorker&) = delete;

  /// Sets the readers. When the first readers come, the chain continues with a keyframe of the newest
  /// snapshot.
  void set_listeners(StrandListeners listeners);
  /// Changes the coding from the next state on; stream_id stays. States of the old lattice are skipped from
  /// then on.
  void change(const StrandEncodeConfig& config);
  /// Requests a keyframe and returns at once. It comes with the next state, or with the present one if no
  /// other is published soon. Requests made before it share it; later requests for the same state get the
  /// same frame. After one whose state everybody takes over the next comes half a second later.
  void request_keyframe();
  /// Requests one state newer than the last one: the newest from `not_before_ns` (now_ns()) on. Of several
  /// requests the earliest counts. Has no effect for listeners of all states.
  void request_state(int64_t not_before_ns);

  StrandEncodeCounters counters() const;
  /// Returns the report line of the encoder's work.
  gl::PassReport pass() const;

 private:
  enum class Audience { Followers, Joiners };

  void run();
  void say_followed() const;
  bool has_work(const SnapshotSlot::View& view) const;
  bool is_due(const SnapshotSlot::View& view) const;
  bool has_request() const { return state_requests_ != answered_requests_; }
  bool has_listeners() const { return listeners_ != StrandListeners::None; }
  StrandEncodeConfig config() const;
  SnapshotSlot::View wait_for_work() const;
  void serve(const SnapshotSlot::View& view, const StrandEncodeConfig& config);
  JoinFrames encode(const Snapshot& published, const StrandEncodeConfig& config, Audience audience);
  void count(const JoinFrames& frames, double encode_ms, Audience audience);
  void give(const EncodedFramePtr& frame);

  SnapshotSlot& slot_;
  std::unique_ptr<StrandEncoder> encoder_;
  Sink sink_;
  SharedSlot* const shared_;
  const uint16_t stream_id_;

  mutable std::mutex config_mutex_;
  StrandEncodeConfig config_;

  std::atomic<bool> is_stopping_{false};
  std::atomic<StrandListeners> listeners_{StrandListeners::None};
  std::atomic<uint64_t> state_requests_{0};
  std::atomic<uint64_t> answered_requests_{0};
  std::atomic<int64_t> state_wanted_ns_{0};  // of the earliest that is not answered
  std::atomic<bool> is_keyframe_wanted_{false};
  std::atomic<bool> is_restarting_{false};    // nobody has the chain's last frame
  std::atomic<uint64_t> restart_version_{0};  // of the state that was the newest then

  // Of the worker's thread.
  uint64_t encoded_version_ = 0;
  uint64_t encoded_tick_ = 0;
  EncodedFramePtr keyframe_;        // of the chain's present state, once one was made
  std::optional<int64_t> told_ns_;  // simulated time of the last keyframe whose state everybody took over

  mutable std::mutex counters_mutex_;
  StrandEncodeCounters counters_;
  StageTimer encode_timer_;
  StageTimer keyframe_timer_;

  std::thread thread_;  // last: starts when everything else is there
};

}  // namespace strandcast
