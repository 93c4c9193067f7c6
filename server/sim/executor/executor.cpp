#include "server/sim/executor/executor.h"

#include <glm/gtc/quaternion.hpp>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/gl/egl_context.h"
#include "common/gl/timer.h"
#include "server/sim/executor/gl_executor.h"
#include "server/sim/executor/lanes_executor.h"

namespace strandcast {

Result<std::unique_ptr<DeviceVolume>> Executor::make_volume(const DeviceVolumeDesc& desc) {
  return make_error(ErrorCode::Unsupported,
                    "volume.scatter: {} needs OpenGL, this simulation runs on {} (known there: auto, host)",
                    desc.scatter, info().name);
}

void turn_plane(StrandPlane& plane, const glm::dquat& turn) {
  std::vector<glm::vec4> values;
  plane.read(values);
  for (glm::vec4& value : values) value = glm::vec4(glm::vec3(turn * glm::dvec3(value)), value.w);
  plane.write(values);
}

double timed_ms(Executor& executor, const std::function<void()>& work) {
  gl::GpuTimer* timer = executor.timer();
  const int64_t begin_ns = now_ns();
  if (timer != nullptr) timer->begin();
  work();
  return timer != nullptr ? timer->end_ms() : static_cast<double>(now_ns() - begin_ns) * kMsPerNs;
}

const char* to_string(SimDevice device) {
  return device == SimDevice::Gl ? "gl" : "lanes";
}

bool is_sim_device_name(const std::string& name) {
  return name == "auto" || name == "gl" || name == "lanes";
}

SimDevice likely_sim_device(const ExecutorConfig& config) {
  if (config.sim_device == "lanes") return SimDevice::Lanes;
  const bool names_gl = config.sim_device == "gl" || config.gl_device != "auto";
  return names_gl || gl::EglContext::make("hardware").ok() ? SimDevice::Gl : SimDevice::Lanes;
}

Result<std::unique_ptr<Executor>> open_executor(const ExecutorConfig& config) {
  if (!is_sim_device_name(config.sim_device))
    return make_error(ErrorCode::BadInput, "sim device '{}' is not known (known: auto, gl, lanes)",
                      config.sim_device);
  if (config.sim_device == "lanes") return make_lanes_executor();
  // Who names an OpenGL device wants it.
  if (config.sim_device == "gl" || config.gl_device != "auto")
    return make_gl_executor(config.gl_device, config.shader_folder);
  if (auto gl = make_gl_executor("hardware", config.shader_folder)) return gl;
  if (auto lanes = make_lanes_executor()) return lanes;
  return make_gl_executor("auto", config.shader_folder);
}

}  // namespace strandcast
