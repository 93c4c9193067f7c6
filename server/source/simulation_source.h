// The simulation as a source of states: loads the scene and owns it while it runs. Looks go from here to the
// sink; what the simulation needs is posted to its thread (SimLoop).
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "server/source/sim_loop.h"
#include "server/stream/state_source.h"

namespace strandcast {

/// Shortest time between two reports of a new look; only the newest is reported.
inline constexpr int64_t kLookChangeNs = 100'000'000;

struct SimulationConfig {
  SceneDesc scene;
  ExecutorConfig device;        // what simulates
  SnapshotObserver on_publish;  // may be empty
  // As SimLoopConfig has them.
  StepTap* tap = nullptr;
  StepScript* script = nullptr;
  bool is_lockstep = false;  // simulated time goes on by commands only
  SharedSlot* shared = nullptr;
};

/// Checks and loads the scene; start() opens the executor. `inputs` must outlive the source.
Result<std::unique_ptr<StateSource>> make_simulation(SimulationConfig config, InputHub& inputs);

}  // namespace strandcast
