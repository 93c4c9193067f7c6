// Hair volume of the OpenGL executor: compute kernels volume/*.comp, entirely on the device. Needs the
// executor's context.
#pragma once

#include <memory>

#include "common/gl/device_limits.h"
#include "common/gl/program.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Makes the volume; as Executor::make_volume().
Result<std::unique_ptr<DeviceVolume>> make_gl_volume(const gl::ShaderLibrary& shaders,
                                                     const gl::DeviceLimits& limits,
                                                     const DeviceVolumeDesc& desc);

}  // namespace strandcast
