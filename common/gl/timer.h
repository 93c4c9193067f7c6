// Times GPU work: with timer queries on hardware, with glFinish and a wall clock on software renderers, whose
// queries are wrong.
#pragma once

#include <cstdint>

#include "common/gl/egl_context.h"
#include "common/gl/objects.h"

namespace strandcast::gl {

class GpuTimer {
 public:
  explicit GpuTimer(const DeviceInfo& info);
  void begin();
  /// Waits for the work and returns the milliseconds since begin().
  double end_ms();

 private:
  bool is_software_;
  int64_t begin_ns_ = 0;
  Handle<delete_query> begin_query_;  // time stamps, so that timers may nest
  Handle<delete_query> end_query_;
};

}  // namespace strandcast::gl
