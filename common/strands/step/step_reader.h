// StepReader: interface through which the "tangent" decoder reads the additions of the "step" codec. A
// program that decodes only "tangent" then links no solver. Private to common/strands; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/math/bust.h"
#include "common/math/pose.h"
#include "common/strands/byte_io.h"
#include "common/strands/tangent/motion.h"

namespace strandcast::step {

// Of a delta, beside that of anchors.
inline constexpr uint8_t kStepFlag = 2;     // predicted by steps, whose ticks follow
inline constexpr uint8_t kSceneFlag = 4;    // a scene follows
inline constexpr uint8_t kModelFlag = 8;    // a model follows, from the next frame on; not with kStepFlag
inline constexpr uint8_t kSparseFlag = 16;  // with kStepFlag: without weights, in sparse_symbols.h's order
/// Flag: the delta is predicted by motion, ticks follow, and decoded positions correct the steps. Excludes
/// kStepFlag.
inline constexpr uint8_t kFollowFlag = 32;
inline constexpr uint8_t kTellingFlags = kStepFlag | kSceneFlag | kModelFlag | kFollowFlag;  // bytes follow
/// Flag of an anchor that steps foretell: its positions and the state are rounded finely.
inline constexpr uint8_t kFineFlag = 64;
inline constexpr uint8_t kFlags = kTellingFlags | kSparseFlag | kFineFlag;

/// Rounding of what joiners receive: finely so that nobody sees it. Those of numbers 13, 14 (neighbours of the
/// slice) and 15 (velocities beside those of neighbours that are not turned) are only read.
enum class Rounding { Coarse, FirstFine, SecondFine, ThirdFine, Fine };

/// What strands are expected beside.
inline tangent::Neighbours tangent::Layout::*beside_of(Rounding rounding) {
  return rounding >= Rounding::ThirdFine ? &tangent::Layout::alike : &tangent::Layout::neighbour;
}

/// Tick and pose of a frame that is predicted.
struct Moment {
  uint64_t tick = 0;
  int64_t sim_time_ns = 0;
  Pose world_from_head;
  BustCode bust = kRigidBust;
};

/// How a delta begins.
struct Beginning {
  uint8_t flags = 0;
  size_t head_bytes = 0;           // after the check, which covers them: of an exact frame (exact_head.h)
  Rounding fine = Rounding::Fine;  // what kFineFlag means
};

class StepReader {
 public:
  virtual ~StepReader() = default;
  /// Forgets the whole state.
  virtual void restart(std::span<const glm::vec3> rest_in_head_m) = 0;
  /// Reads the bytes after a delta's flags and, if the frame is predicted by steps, simulates them. After an
  /// error nothing has changed.
  virtual Status begin(const Beginning& beginning, const Moment& now, const tangent::Layout& layout,
                       ByteReader& body, tangent::History& history) = 0;
  /// Returns the pose of the chest after the newest step.
  virtual BustCode chest() const = 0;
  /// Restores the state before begin(), because the frame failed its checks.
  virtual void abandon(tangent::History& history) = 0;
  virtual void finish(const Moment& now, const tangent::Frame& frame, const tangent::History& history) = 0;
  /// As finish(), for a frame that is where the steps led.
  virtual void finish_exact(const Moment& now) = 0;
  /// After an anchor: rounds the state to the one that joiners receive.
  virtual void settle(const tangent::History& history) = 0;
  /// Reads a keyframe's state except the positions; it is kept until take_over().
  /// Returns how everything of the keyframe is rounded; `fine`: where it says finely.
  virtual Result<Rounding> read_state(ByteReader& body, const Moment& now, const tangent::Layout& layout,
                                      Rounding fine) = 0;
  /// Completes read_state() after the keyframe's positions have become history.
  virtual void take_over(const Moment& now, const tangent::History& history) = 0;
};

}  // namespace strandcast::step
