#include "common/gl/timer.h"

#include <epoxy/gl.h>

#include "common/base/profile.h"
#include "common/base/units.h"

namespace strandcast::gl {
namespace {

uint32_t create_timestamp() {
  GLuint name = 0;
  glCreateQueries(GL_TIMESTAMP, 1, &name);
  return name;
}

}  // namespace

GpuTimer::GpuTimer(const DeviceInfo& info) : is_software_(info.is_software) {
  if (is_software_) return;
  begin_query_ = Handle<delete_query>(create_timestamp());
  end_query_ = Handle<delete_query>(create_timestamp());
}

void GpuTimer::begin() {
  if (!is_software_) {
    glQueryCounter(begin_query_.name(), GL_TIMESTAMP);
    return;
  }
  glFinish();  // earlier work must not count
  begin_ns_ = now_ns();
}

double GpuTimer::end_ms() {
  if (is_software_) {
    glFinish();
    return static_cast<double>(now_ns() - begin_ns_) * kMsPerNs;
  }
  glQueryCounter(end_query_.name(), GL_TIMESTAMP);
  GLuint64 begin_time_ns = 0, end_time_ns = 0;
  glGetQueryObjectui64v(begin_query_.name(), GL_QUERY_RESULT, &begin_time_ns);
  glGetQueryObjectui64v(end_query_.name(), GL_QUERY_RESULT, &end_time_ns);
  return static_cast<double>(end_time_ns - begin_time_ns) * kMsPerNs;
}

}  // namespace strandcast::gl
