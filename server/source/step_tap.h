// What a simulation's steps are made of, told as they are taken (StepTap) and given again (StepScript): with
// the scene it decides every bit of what is published.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "common/scene/scene_desc.h"
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

/// A command or assignment after the step `tick`.
struct PostedChange {
  uint64_t tick = 0;
  std::variant<ControlCommand, SetParameter> what;
  std::string who;  // asked for it; empty = nobody said
};

/// From now on states are published on another lattice; the present one is published again.
struct LatticeChange {
  uint64_t tick = 0;
  StreamDesc stream;
};

/// Hears of all that on the simulation thread, each before the states that come of it; returns quickly.
class StepTap {
 public:
  virtual ~StepTap() = default;
  virtual void on_step(const TakenStep& step) = 0;
  virtual void on_change(const PostedChange& change) = 0;
  /// To that change, once it is carried out.
  virtual void on_answer(const Notice& answer) = 0;
  virtual void on_lattice(const LatticeChange& change) = 0;
};

/// What a simulation does instead of going by clock, inputs and commands.
class StepScript {
 public:
  struct End {};
  using Next = std::variant<End, TakenStep, PostedChange, LatticeChange>;

  virtual ~StepScript() = default;
  /// On the simulation thread; after End nothing is asked any more.
  virtual Next next() = 0;
};

}  // namespace strandcast
