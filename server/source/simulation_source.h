// The simulation as a source of states: loads the scene, then steps it on its own thread (SimLoop).
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "server/source/sim_loop.h"
#include "server/stream/state_source.h"

namespace strandcast {

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
