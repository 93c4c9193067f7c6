// StateSource: origin of published states: a simulation, a replayed recording or another server. Each hub has
// exactly one.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/histogram.h"
#include "common/base/result.h"
#include "common/gl/pass_list.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"
#include "common/strands/snapshot.h"
#include "common/wire/messages.h"
#include "server/stream/demand_book.h"

namespace strandcast {

/// Totals since start and the present state. A source that does not simulate leaves most fields at their
/// defaults.
struct SimStats {
  uint64_t tick = 0;
  double step_median_ms = 0.0;  // solver, all substeps
  Histogram step_times;         // likewise
  double read_median_ms = 0.0;
  double quantise_median_ms = 0.0;
  gl::PassReports passes;  // of the source's thread; the medians above are of these
  double realtime_factor = 0.0;
  bool is_paused = false;
  bool is_motion_stale = true;
  uint64_t rejected_samples = 0;
  std::optional<Timecode> timecode = {};  // of the newest step
  uint64_t dropped_steps = 0;
  uint64_t published = 0;
  uint64_t quarantined = 0;                // strands put back to rest because they had no usable numbers
  uint64_t overstretched = 0;              // strands put back to rest because they had stretched too far
  DetailLevel detail = DetailLevel::Full;  // how much is simulated
  std::string detail_reason;               // of a level that is not Full
  uint32_t simulated_strands = 0;          // the others follow them; 0 = none: all go with the head
  uint64_t detail_changes = 0;
  uint64_t solver_builds = 0;
  int64_t built_ns = 0;  // server clock at the newest solver, or now while one is prepared; 0 = the first
  uint64_t solver_bytes = 0;
  double step_cost = 0.0;       // StepKernel::cost of the model; 0 = it has no kernel that others run
  std::string sim_device;       // what simulates: "gl", "lanes"; empty = nothing does
  std::string sim_device_name;  // for people
  std::string solver_name;
  std::string quality_reason;   // of what runs where the scene leaves its quality to the machine
  uint32_t substeps = 0;        // of now; 0 = nothing is simulated
  double strand_rate_hz = 0.0;  // of now; 0 = every step
  int64_t last_step_ns = 0;     // server clock at the end of the newest step; 0 = none yet
  int64_t busy_ns = 0;          // that its thread has been at one turn of its loop; 0 = it waits
};

/// Receiver of a source's output. Any thread; the source never waits for readers.
class StateSink {
 public:
  virtual ~StateSink() = default;
  /// Takes a state, which is on the lattice of the newest change_stream() call, or of the scene.
  virtual void put(std::shared_ptr<const Snapshot> state) = 0;
  /// Changes the stream's coding; called before its first state.
  virtual void change_stream(const StreamDesc& stream) = 0;
  /// Changes the look from now on; before the first call it is that of the start.
  virtual void change_look(const LookChange& look) = 0;
  /// Changes the rest shape from the next state on; the number of strands stays.
  virtual void change_shape(std::shared_ptr<const SceneAsset> asset) = 0;
};

class StepTap;

class StateSource {
 public:
  /// Receives the answer to a command, on any thread.
  using Reply = std::function<void(Notice)>;
  /// Receives the step from which on a tap is in use, or no longer in use.
  using OnTapped = std::function<void(uint64_t tick)>;

  virtual ~StateSource() = default;
  /// Returns the rest shape and other data that viewers draw, as of the newest change_shape(). Any thread.
  virtual std::shared_ptr<const SceneAsset> asset() const = 0;
  /// Starts the source. Returns after the first state was put, or with an error. States are on the lattice of
  /// `stream`. `sink` must outlive the source. Call it once.
  virtual Status start(StateSink& sink, const StreamDesc& stream) = 0;
  /// Stops the source; after the return nothing is put any more.
  virtual void stop() = 0;

  // From any thread; return at once. Only post() may call the sink, with a new look.
  virtual void set_demand(const SourceDemand& demand) = 0;
  // `who` asked for it, for people who look at a recording.
  virtual void post(const ControlCommand& command, Reply reply, const std::string& who) = 0;
  virtual void post(const SetParameter& parameter, Reply reply, const std::string& who) = 0;
  /// Ends the counted steps of a session that left, and drops its commands that still wait.
  virtual void leave(const std::string& /*who*/) {}
  /// Replaces the tap that hears of every step (null: none). `on_tapped` is called on any thread, but never
  /// after the source has stopped or failed. A source without steps only calls `on_tapped`.
  virtual void set_tap(StepTap* /*tap*/, OnTapped on_tapped) { on_tapped(stats().tick); }
  virtual SimStats stats() const = 0;
  /// Returns the mean wind at the head in the newest step, world; empty if it is not known.
  virtual std::optional<glm::vec3> wind_mps() const { return std::nullopt; }
  /// Returns the scene as it runs, so that it can be run elsewhere on this machine; empty if there is none.
  virtual std::optional<SceneDesc> scene() const { return std::nullopt; }
  /// Returns why the source ended by itself; empty while it runs.
  virtual std::optional<Error> failure() const = 0;
};

}  // namespace strandcast
