// RunningSum: prefix sums of counts on the GPU, so that each of many writers knows where its output begins.
// All calls from the context's thread.
#pragma once

#include <cstdint>

#include "common/gl/objects.h"
#include "common/gl/program.h"

namespace strandcast {

class RunningSum {
 public:
  RunningSum() = default;
  /// Makes sums of at most `max_count` counts.
  static Result<RunningSum> make(const gl::ShaderLibrary& shaders, uint64_t max_count);
  static uint64_t size_bytes(uint64_t max_count) { return sizeof(uint32_t) * (max_count + 1); }
  /// Binds the buffer for kernels that write counts or read sums.
  void bind() const;
  /// Turns the first `count` counts into sums, after the preceding kernels have finished.
  void run(uint32_t count) const;
  /// Returns the sum of `count` counts. Waits for the GPU.
  uint32_t read_total(uint32_t count) const;

 private:
  gl::Program program_;
  gl::Buffer sum_;  // (max_count + 1)
};

}  // namespace strandcast
