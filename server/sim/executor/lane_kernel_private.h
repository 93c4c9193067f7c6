// One kernel for one instruction set: the C++ that shaders/lanes.cmake makes of a kernel's GLSL, as the
// members of a class. Only for the files that CMakeLists.txt writes, one for each kernel, variant and set,
// compiled for that set:
//   KERNEL_FILE     "sim/dftl.comp"
//   KERNEL_NAME     identifier of the LaneKernel
//   KERNEL_VARIANT  "HAS_PINNED_TAIL=0"; each also defined as a macro
//   KERNEL_SET      number of the instruction set
// Nothing here may come from the standard library's inline functions (lane_kernel.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>

#include "common/simd/lane_matrices.h"
#include "server/sim/executor/lane_kernel.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Wshadow"

namespace strandcast {
namespace {

using namespace simd;    // NOLINT: kernels are written in GLSL's names
using namespace shader;  // NOLINT
using uint = uint32_t;
using number = float;
using uniform_float = float;
using lane_bool = Bool;
using lane_uint = Uint;

/// As server/sim/executor/executor.h has it; bindings and units of the kernels in one.
enum class PlaneRole : uint32_t {
  Rest,
  Position,
  Velocity,
  Displacement,
  VelocityChange,
  RodEdge,
  RodStrand,
  RodAxis
};

constexpr size_t kRowFloats = 64;  // of one vertex of a block: x y z w of 16 strands

STRANDCAST_LANES vec4 load_vec4(const float* from, size_t stride) {
  vec4 value;
  value.x = load_lanes(from);
  value.y = load_lanes(from + stride);
  value.z = load_lanes(from + 2 * stride);
  value.w = load_lanes(from + 3 * stride);
  return value;
}
STRANDCAST_LANES void store_vec4(const vec4& value, float* to, size_t stride) {
  store_lanes(value.x, to);
  store_lanes(value.y, to + stride);
  store_lanes(value.z, to + 2 * stride);
  store_lanes(value.w, to + 3 * stride);
}

/// A plane as kernels read it, and as they write it. Elements are rows of the block at hand.
struct samplerBuffer {
  float* const* at;
};
STRANDCAST_LANES vec4 texelFetch(const samplerBuffer& plane, int element) {
  return load_vec4(*plane.at + static_cast<size_t>(element) * kRowFloats, kRowFloats / 4);
}
struct Sheet {
  struct Element {
    float* to;
    STRANDCAST_LANES void operator=(const vec4& value) const { store_vec4(value, to, kRowFloats / 4); }
  };
  float* const* at;
  STRANDCAST_LANES Element operator[](uint element) const { return {*at + size_t{element} * kRowFloats}; }
};
/// Memory that only the strands at hand see.
struct Scratch {
  struct Element {
    float* at;
    STRANDCAST_LANES void operator=(const vec4& value) const { store_vec4(value, at, kLanes); }
    STRANDCAST_LANES operator vec4() const { return load_vec4(at, kLanes); }
  };
  float* at;
  STRANDCAST_LANES Element operator[](uint element) const { return {at + size_t{element} * 4 * kLanes}; }
};

STRANDCAST_LANES uint max(uint a, uint b) {
  return a > b ? a : b;
}
STRANDCAST_LANES uint min(uint a, uint b) {
  return a < b ? a : b;
}
/// Of positive numbers.
STRANDCAST_LANES int findMSB(uint value) {
  return 31 - __builtin_clz(value);
}
STRANDCAST_LANES bool is_any(bool which) {
  return which;
}
STRANDCAST_LANES Bool operator||(bool a, Bool b) {
  return lanes_that(a) || b;
}
STRANDCAST_LANES Bool operator||(Bool a, bool b) {
  return a || lanes_that(b);
}
STRANDCAST_LANES Bool operator&&(bool a, Bool b) {
  return lanes_that(a) && b;
}
STRANDCAST_LANES Bool operator&&(Bool a, bool b) {
  return a && lanes_that(b);
}

#define float Float
#define LAW STRANDCAST_LANES
#define uint Uint
#include "shaders/lib/hash.glsl"
#undef uint
#undef LAW
#undef float
/// Of what is the same in all strands.
STRANDCAST_LANES uint mix_u32(uint value) {
  return mix_u32(Uint(value)).v[0];
}

/// What a kernel's class has besides its GLSL.
class KernelBase {
 public:
  explicit KernelBase(const LaneRun& run) : run_(run) {}

 protected:
  static bool is_same(const char* a, const char* b) {
    while (*a != 0 && *a == *b) ++a, ++b;
    return *a == *b;
  }
  const LaneConstant* find(const char* name) const {
    for (uint i = 0; i < run_.constant_count; ++i)
      if (is_same(run_.constants[i].name, name)) return &run_.constants[i];
    return nullptr;
  }
  number constant(const char* name) const {
    const LaneConstant* found = find(name);
    return found == nullptr ? 0.0f : found->number;
  }
  uint count(const char* name) const {
    const LaneConstant* found = find(name);
    return found == nullptr ? 0u : found->count;
  }
  float* const* plane(PlaneRole role) const { return &plane_[static_cast<uint>(role)]; }
  float* scratch_memory() const { return run_.scratch; }
  uint collider_count() const { return run_.collider_count; }
  uint gust_count() const { return run_.gust_count; }

  const LaneRun& run_;
  float* plane_[8] = {};  // the strands at hand
  struct {
    uint x;
  } gl_GlobalInvocationID{0};
};

#define LANE_STEP(Block, name) const Block name = *static_cast<const Block*>(run_.step);
#define COLLIDERS 16
#define COLLIDER_COUNT collider_count()
#define HAS_TURBULENCE 1
#define GUST_COUNT gust_count()
#define LANES 1
#define float Float

class Kernel : public KernelBase {
 public:
  using KernelBase::KernelBase;
#include KERNEL_FILE
#undef float

  __attribute__((flatten, noinline)) void run_group() {
    run_strands();
  }

  void run_blocks() {
    for (uint block = run_.block_begin; block < run_.block_end; ++block) {
      for (uint lane = 0; lane < 16; lane += kLanes) {
        for (uint role = 0; role < 8; ++role)
          plane_[role] = run_.planes[role] == nullptr
                             ? nullptr
                             : run_.planes[role] + run_.block_floats[role] * block + lane;
        run_group();
      }
    }
  }
};

void run_kernel(const LaneRun& run) {
  Kernel* kernel = new (run.memory) Kernel(run);
  kernel->run_blocks();
}

}  // namespace

extern const LaneKernel KERNEL_NAME;
const LaneKernel KERNEL_NAME = {
    KERNEL_FILE, KERNEL_VARIANT, KERNEL_SET, sizeof(Kernel), sizeof(Kernel::StepBlock), run_kernel};

}  // namespace strandcast
