// Inputs and changes of a simulation's steps: reported while they are used (StepTap), or replayed
// (StepScript). Together with the scene they determine every published bit.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "common/scene/scene_desc.h"
#include "common/strands/shared_strands.h"
#include "common/wire/messages.h"
#include "server/input/input_frame.h"

namespace strandcast {

/// Inputs of the step that ends in state `tick`.
struct TakenStep {
  uint64_t tick = 0;
  int64_t time_ns = 0;      // server clock that the step stands for
  double input_rate = 1.0;  // InputClock::rate()
  InputFrame input;
};

/// A command or assignment after step `tick`.
struct PostedChange {
  uint64_t tick = 0;
  std::variant<ControlCommand, SetParameter> what;
  std::string who;  // asked for it; empty = nobody said
};

/// Change of the lattice of published states; the present state is published again on it.
struct LatticeChange {
  uint64_t tick = 0;
  StreamDesc stream;
};

/// After step `tick`, strands go on from those that a keyframe told viewers, and repeat the steps since then.
struct HandOver {
  uint64_t tick = 0;
  SharedUpdate update;
};

/// Observer of steps and changes on the simulation thread; called before the states that result from them.
/// Must return quickly.
class StepTap {
 public:
  virtual ~StepTap() = default;
  virtual void on_step(const TakenStep& step) = 0;
  virtual void on_change(const PostedChange& change) = 0;
  /// Reports the answer to the preceding change, after it was carried out.
  virtual void on_answer(const Notice& answer) = 0;
  virtual void on_lattice(const LatticeChange& change) = 0;
  virtual void on_hand_over(const HandOver& hand_over) = 0;
};

/// Drives a simulation by a script instead of clock, inputs and commands.
class StepScript {
 public:
  struct End {};
  using Next = std::variant<End, TakenStep, PostedChange, LatticeChange, HandOver>;

  virtual ~StepScript() = default;
  /// Returns the next item; called on the simulation thread, and not again after End.
  virtual Next next() = 0;
};

}  // namespace strandcast
