// Headless OpenGL 4.5 core context through EGL: hardware devices first, then llvmpipe. One context belongs to
// one thread at a time. No window system, no environment variables.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/gl/device_limits.h"

namespace strandcast::gl {

/// Facts about the current context.
struct DeviceInfo {
  std::string renderer;
  std::string vendor;
  std::string version;
  bool is_software = false;  // GPU timers lie there: glFinish and a wall clock instead
  int max_samples = 1;
  DeviceLimits limits;
};

/// Software renderers draw with threads that all contexts of a display share; they run at the priority of the
/// thread that came first. Own keeps apart from the contexts made with Shared, so that neither waits in the
/// other's queue; contexts made with Own share one such set. No difference on hardware.
enum class DriverThreads { Shared, Own };

class EglContext {
 public:
  /// `device`: "auto", "software", "hardware" or a device number. Makes the context current on the calling
  /// thread. Unavailable lists what was tried.
  static Result<std::unique_ptr<EglContext>> make(const std::string& device,
                                                  DriverThreads threads = DriverThreads::Shared);
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Binds to the calling thread; release() first where it is current.
  Status make_current();
  void release();
  const DeviceInfo& info() const { return info_; }

 private:
  EglContext() = default;
  void* display_ = nullptr;
  void* context_ = nullptr;
  DeviceInfo info_;
};

/// Reads DeviceInfo from whatever context is current (also a window's). Unsupported below GL 4.5 core, and
/// where a limit is lower than our shaders need.
Result<DeviceInfo> read_device_info();

/// Turns GL debug messages of medium and high severity into log lines; call with a current context.
void enable_debug_log();

}  // namespace strandcast::gl
