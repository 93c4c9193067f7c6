// Headless OpenGL 4.5 core context through EGL: hardware devices first, then llvmpipe. One context belongs to
// one thread at a time. No window system, no environment variables.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/gl/device_limits.h"

namespace strandcast::gl {

/// Facts about the current OpenGL context.
struct DeviceInfo {
  std::string renderer;
  std::string vendor;
  std::string version;
  bool is_software = false;  // GPU timers lie there: glFinish and a wall clock instead
  int max_samples = 1;
  DeviceLimits limits;
};

/// Which driver threads a software renderer uses; no difference on hardware. Its threads are shared by all
/// contexts of a display and run at the priority of the first context's thread. Contexts made with Own share
/// a second set of threads, so that they and the Shared ones never queue behind each other.
enum class DriverThreads { Shared, Own };

class EglContext {
 public:
  /// Makes a context and makes it current on the calling thread. `device`: "auto", "software", "hardware" or
  /// a device number. Unavailable lists what was tried.
  static Result<std::unique_ptr<EglContext>> make(const std::string& device,
                                                  DriverThreads threads = DriverThreads::Shared);
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Binds the context to the calling thread; the thread on which it is current must call release() first.
  Status make_current();
  void release();
  const DeviceInfo& info() const { return info_; }

 private:
  EglContext() = default;
  void* display_ = nullptr;
  void* context_ = nullptr;
  DeviceInfo info_;
};

/// Reads facts about the current context, also one of a window. Unsupported below GL 4.5 core, and if a limit
/// is lower than our shaders need.
Result<DeviceInfo> read_device_info();

/// Logs GL debug messages of medium and high severity; call it with a current context.
void enable_debug_log();

}  // namespace strandcast::gl
