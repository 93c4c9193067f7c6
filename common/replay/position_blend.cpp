#include "common/replay/position_blend.h"

#include "common/simd/raw_lanes.h"

namespace strandcast {
namespace {

using simd::raw::kLaneCount;
using simd::raw::Lanes;
using simd::raw::load_lanes;
using simd::raw::store_lanes;

/// The lanes from `at` on; those behind the end are zero.
STRANDCAST_LANES Lanes load_some(const float* from, size_t at, size_t count) {
  if (at + kLaneCount <= count) [[likely]]
    return load_lanes(from + at);
  float some[kLaneCount] = {};
  for (size_t lane = 0; at + lane < count; ++lane) some[lane] = from[at + lane];
  return load_lanes(some);
}
STRANDCAST_LANES void store_some(const Lanes& lanes, float* to, size_t at, size_t count) {
  if (at + kLaneCount <= count) [[likely]]
    return store_lanes(lanes, to + at);
  float some[kLaneCount];
  store_lanes(lanes, some);
  for (size_t lane = 0; at + lane < count; ++lane) to[at + lane] = some[lane];
}

STRANDCAST_LANES void blend_on_line_lanes(const LineBlend& of) {
  for (size_t at = 0; at < of.count; at += kLaneCount) {
    const Lanes from = load_some(of.from, at, of.count);
    const Lanes step = load_some(of.to, at, of.count) - from;
    store_some(from + step * of.blend, of.out, at, of.count);
  }
}

STRANDCAST_LANES void blend_on_cubic_lanes(const CubicBlend& of) {
  for (size_t at = 0; at < of.count; at += kLaneCount) {
    const Lanes from = load_some(of.state[1], at, of.count);
    const Lanes to = load_some(of.state[2], at, of.count);
    const Lanes before = (from - load_some(of.state[0], at, of.count)) * of.before_scale;
    const Lanes step = to - from;
    const Lanes after = (load_some(of.state[3], at, of.count) - to) * of.after_scale;
    const Lanes bend = (step - before) * of.bend_before + (after - step) * of.bend_after;
    const Lanes sizes[3] = {simd::raw::sizes_of(before), simd::raw::sizes_of(step),
                            simd::raw::sizes_of(after)};
    const Lanes all = (sizes[0] + sizes[1]) + sizes[2];
    const Lanes larger = sizes[0] > sizes[1] ? sizes[0] : sizes[1];
    const Lanes largest = larger > sizes[2] ? larger : sizes[2];
    const Lanes bent = largest > (all - largest) * kJumpSteps ? Lanes{} : bend;
    store_some((from + step * of.blend) + bent, of.out, at, of.count);
  }
}

}  // namespace

STRANDCAST_KERNEL(blend_on_line, LineBlend);
STRANDCAST_KERNEL(blend_on_cubic, CubicBlend);

}  // namespace strandcast
