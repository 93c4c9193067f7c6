// StepReader: what a decoder of "tangent" asks of steps where its codec is "step". An interface: a program
// that decodes only "tangent" links no solver. Private to common/strands; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/math/pose.h"
#include "common/strands/byte_io.h"
#include "common/strands/tangent/motion.h"

namespace strandcast::step {

// Of a delta, beside that of anchors.
inline constexpr uint8_t kStepFlag = 2;     // predicted by steps, whose ticks follow
inline constexpr uint8_t kSceneFlag = 4;    // a scene follows
inline constexpr uint8_t kModelFlag = 8;    // a model follows, from the next frame on; not with kStepFlag
inline constexpr uint8_t kSparseFlag = 16;  // with kStepFlag: without weights, in sparse_symbols.h's order
/// Predicted by motion; ticks follow, and steps are corrected by what is decoded. Not with kStepFlag.
inline constexpr uint8_t kFollowFlag = 32;
inline constexpr uint8_t kTellingFlags = kStepFlag | kSceneFlag | kModelFlag | kFollowFlag;  // bytes follow
inline constexpr uint8_t kFlags = kTellingFlags | kSparseFlag;

/// A frame of which something is predicted.
struct Moment {
  uint64_t tick = 0;
  int64_t sim_time_ns = 0;
  Pose world_from_head;
};

class StepReader {
 public:
  virtual ~StepReader() = default;
  /// Forgets everything.
  virtual void restart(std::span<const glm::vec3> rest_in_head_m) = 0;
  /// Reads what follows the flags of a delta and, for a frame of steps, takes them. Nothing has changed after
  /// an error.
  virtual Status begin(uint8_t flags, const Moment& now, const tangent::Layout& layout, ByteReader& body,
                       tangent::History& history) = 0;
  /// The frame failed its checks: all is as before begin().
  virtual void abandon(tangent::History& history) = 0;
  virtual void finish(const Moment& now, const tangent::Frame& frame, const tangent::History& history) = 0;
  /// After an anchor: goes on with what joiners are told.
  virtual void settle(const tangent::History& history) = 0;
  /// What a keyframe says of steps, all but where strands are; kept for take_over().
  virtual Status read_state(ByteReader& body, const Moment& now, const tangent::Layout& layout) = 0;
  /// The keyframe has become history.
  virtual void take_over(const Moment& now, const tangent::History& history) = 0;
};

}  // namespace strandcast::step
