#include "common/render/detail/running_sum.h"

#include <epoxy/gl.h>

#include "shaders/shared/bindings.h"

namespace strandcast {

Result<RunningSum> RunningSum::make(const gl::ShaderLibrary& shaders, uint64_t max_count) {
  RunningSum sum;
  ASSIGN_OR_RETURN(sum.program_, gl::Program::make(shaders, {"render/running_sum.comp"}, {}));
  sum.sum_ = gl::Buffer("running sum", size_bytes(max_count));
  return sum;
}

void RunningSum::bind() const {
  sum_.bind_storage(shader::kBindingRunningSum);
}

void RunningSum::run(uint32_t count) const {
  program_.use();
  bind();
  program_.set("u_count", count);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  glDispatchCompute(1, 1, 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

uint32_t RunningSum::read_total(uint32_t count) const {
  uint32_t total = 0;
  sum_.read(sizeof(uint32_t) * size_t{count}, std::as_writable_bytes(std::span(&total, 1)));
  return total;
}

}  // namespace strandcast
