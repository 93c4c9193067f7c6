// Running sums of counts on the GPU: where each of many writers of unknown counts begins. All calls from the
// context's thread.
#pragma once

#include <cstdint>

#include "common/gl/objects.h"
#include "common/gl/program.h"

namespace strandcast {

class RunningSum {
 public:
  RunningSum() = default;
  /// Of at most so many counts.
  static Result<RunningSum> make(const gl::ShaderLibrary& shaders, uint64_t max_count);
  static uint64_t size_bytes(uint64_t max_count) { return sizeof(uint32_t) * (max_count + 1); }
  /// For kernels that write counts or read sums.
  void bind() const;
  /// Turns the first `count` counts into sums, once the kernels before are through.
  void run(uint32_t count) const;
  /// Of all of them. Waits for the GPU.
  uint32_t read_total(uint32_t count) const;

 private:
  gl::Program program_;
  gl::Buffer sum_;  // (max_count + 1)
};

}  // namespace strandcast
