// The executor that runs strand kernels as OpenGL compute shaders, with a context of its own: on hardware, or
// on Mesa's llvmpipe. Everything that it made is used and deleted while its context is current. One thread.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// `gl_device` as EglContext::make; makes the context current. `shader_folder`: none = the shaders in the
/// binary. Unavailable where there is no such device, NotFound for an unknown name.
Result<std::unique_ptr<Executor>> make_gl_executor(
    const std::string& gl_device, const std::optional<std::filesystem::path>& shader_folder = {});

}  // namespace strandcast
