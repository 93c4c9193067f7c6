#include "client/app/step_speed.h"

namespace strandcast {
namespace {

double measure_step_ns() {
  return 0.0;
}

}  // namespace

double measured_step_ns() {
  static const double step_ns = measure_step_ns();
  return step_ns;
}

}  // namespace strandcast
