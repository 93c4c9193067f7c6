// An executor that runs strand kernels as OpenGL compute shaders with its own context, on hardware or Mesa's
// llvmpipe. Its objects must be used and destroyed while its context is current. One thread.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Makes the executor and makes its context current. `gl_device` as EglContext::make(); without
/// `shader_folder`, the embedded shaders are used. Unavailable if there is no such device, NotFound for an
/// unknown name.
Result<std::unique_ptr<Executor>> make_gl_executor(
    const std::string& gl_device, const std::optional<std::filesystem::path>& shader_folder = {});

}  // namespace strandcast
