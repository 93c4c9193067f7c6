// The head of an exact frame: a frame of the "step" codec that steps foretell to the last vertex. It says
// only what nobody can foretell, beside the frame before. Layout in proto/WIRE.md. Private to common/strands.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/math/pose_lattice.h"
#include "common/strands/byte_io.h"
#include "common/strands/snapshot.h"
#include "common/strands/strand_payload.h"

namespace strandcast::step {

/// Bit of the codec's number that marks an exact frame.
inline constexpr uint8_t kExactBit = 128;

/// Frame of a chain that an exact one counts from.
class HeadBase {
 public:
  /// Takes a frame that everybody has. `is_joint`: joiners have no frame before it.
  void follow(const SnapshotInfo& frame, bool is_joint);

  /// Appends the numbers of the next frame.
  void write(const SnapshotInfo& frame, std::vector<std::byte>& bytes) const;
  /// Reads them from untrusted bytes; the message's header is known. BadInput for numbers that none can be.
  Status read(ByteReader& bytes, StrandMessage& message) const;

 private:
  template <class Code>
  void code_pose(PoseSteps& steps, Code code) const;
  int64_t expected_motion_ns(int64_t sim_time_ns) const;

  SnapshotInfo last_;
  PoseSteps pose_{};  // of the last frame
  PoseSteps way_{};   // to it from the one before
};

}  // namespace strandcast::step
