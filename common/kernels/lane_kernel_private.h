// One kernel for one instruction set: the C++ that shaders/lanes.cmake makes of a kernel's GLSL, as the
// members of a class. Only for the files that CMakeLists.txt writes, one for each kernel, variant and set,
// compiled for that set:
//   KERNEL_FILE     "sim/dftl.comp"
//   KERNEL_NAME     identifier of the LaneKernel
//   KERNEL_VARIANT  "HAS_PINNED_TAIL=0"; each also defined as a macro
//   KERNEL_SET      number of the instruction set
//   KERNEL_PARTS    registers that are worked on side by side: 1, or 2 (common/simd/lane_pairs.h)
// Nothing here may come from the standard library's inline functions (lane_kernel.h).
#pragma once

#include "common/kernels/lane_kernel_headers_private.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"
#if !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#pragma GCC diagnostic ignored "-Wshadow"

namespace strandcast {
namespace {

#if KERNEL_PARTS == 2
using namespace simd::pairs;  // NOLINT: kernels are written in GLSL's names
#else
using namespace simd;  // NOLINT
#endif
using namespace shader;  // NOLINT
using uint = uint32_t;
using number = float;
using uniform_float = float;
using lane_bool = Bool;
using lane_uint = Uint;

constexpr size_t kRowFloats = 64;  // of one vertex of a block: x y z w of 16 strands
constexpr uint kStrands = KERNEL_PARTS * simd::kLanes;

/// Where a plane's rows of the strands at hand begin, for each register.
struct Rows {
  float* of[KERNEL_PARTS];
};
STRANDCAST_LANES Float load_row(const Rows& rows, size_t offset) {
#if KERNEL_PARTS == 2
  return {simd::load_lanes(rows.of[0] + offset), simd::load_lanes(rows.of[1] + offset)};
#else
  return simd::load_lanes(rows.of[0] + offset);
#endif
}
STRANDCAST_LANES void store_row(Float value, const Rows& rows, size_t offset) {
#if KERNEL_PARTS == 2
  simd::store_lanes(value.a, rows.of[0] + offset);
  simd::store_lanes(value.b, rows.of[1] + offset);
#else
  simd::store_lanes(value, rows.of[0] + offset);
#endif
}
STRANDCAST_LANES vec4 load_vec4(const Rows& rows, size_t offset, size_t stride) {
  vec4 value;
  value.x = load_row(rows, offset);
  value.y = load_row(rows, offset + stride);
  value.z = load_row(rows, offset + 2 * stride);
  value.w = load_row(rows, offset + 3 * stride);
  return value;
}
STRANDCAST_LANES void store_vec4(const vec4& value, const Rows& rows, size_t offset, size_t stride) {
  store_row(value.x, rows, offset);
  store_row(value.y, rows, offset + stride);
  store_row(value.z, rows, offset + 2 * stride);
  store_row(value.w, rows, offset + 3 * stride);
}

/// A plane as kernels read it, and as they write it. Elements are rows of the block at hand.
struct samplerBuffer {
  const Rows* rows;
};
STRANDCAST_LANES vec4 texelFetch(const samplerBuffer& plane, int element) {
  return load_vec4(*plane.rows, static_cast<size_t>(element) * kRowFloats, kRowFloats / 4);
}

#if defined(__AVX512F__) && STRANDCAST_LANE_COUNT == 16
using Gathering = __m512;
#define GATHERING(name, ...) _mm512_##name##_ps(__VA_ARGS__)
#elif defined(__AVX2__) && STRANDCAST_LANE_COUNT == 8
using Gathering = __m256;
#define GATHERING(name, ...) _mm256_##name##_ps(__VA_ARGS__)
#elif defined(__SSE2__) && STRANDCAST_LANE_COUNT == 4
using Gathering = __m128;
#define GATHERING(name, ...) _mm_##name##_ps(__VA_ARGS__)
#endif
/// x, y, z and w of an element of a table for each lane.
struct Gathered {
  simd::Float x, y, z, w;
};
/// Elements are loaded whole and turned into rows, four lanes at a time. An index beyond the end is that of
/// the last element.
STRANDCAST_LANES Gathered gather(const float* values, uint last, simd::Uint index) {
  alignas(64) uint at[simd::kLanes];
  const simd::UintBits limited = simd::min(index, simd::Uint(last)).v;
  __builtin_memcpy(at, &limited, sizeof at);
#if defined(GATHERING)
  const auto element = [&](uint lane) STRANDCAST_LANES_LAMBDA {
    const auto load = [&](uint from)
                          STRANDCAST_LANES_LAMBDA { return _mm_load_ps(values + size_t{at[from]} * 4); };
#if STRANDCAST_LANE_COUNT == 16
    const __m512 low = _mm512_insertf32x4(_mm512_castps128_ps512(load(lane)), load(lane + 4), 1);
    return _mm512_insertf32x4(_mm512_insertf32x4(low, load(lane + 8), 2), load(lane + 12), 3);
#elif STRANDCAST_LANE_COUNT == 8
    return _mm256_insertf128_ps(_mm256_castps128_ps256(load(lane)), load(lane + 4), 1);
#else
    return load(lane);
#endif
  };
  const Gathering a = element(0), b = element(1), c = element(2), d = element(3);
  const Gathering xy_ab = GATHERING(unpacklo, a, b), zw_ab = GATHERING(unpackhi, a, b);
  const Gathering xy_cd = GATHERING(unpacklo, c, d), zw_cd = GATHERING(unpackhi, c, d);
  const auto row = [](Gathering value)
                       STRANDCAST_LANES_LAMBDA { return simd::Float((simd::FloatBits)value); };
  return {row(GATHERING(shuffle, xy_ab, xy_cd, 0x44)), row(GATHERING(shuffle, xy_ab, xy_cd, 0xee)),
          row(GATHERING(shuffle, zw_ab, zw_cd, 0x44)), row(GATHERING(shuffle, zw_ab, zw_cd, 0xee))};
#else
  Gathered found;
  for (uint lane = 0; lane < simd::kLanes; ++lane) {
    const float* from = values + size_t{at[lane]} * 4;
    found.x.v[lane] = from[0], found.y.v[lane] = from[1], found.z.v[lane] = from[2],
    found.w.v[lane] = from[3];
  }
  return found;
#endif
}
/// An array of vec4 that kernels look things up in.
struct lookup_table {
  const LaneTable& table;
};
STRANDCAST_LANES vec4 look_up(const lookup_table& from, Uint index) {
  const uint last = from.table.count - 1;
  vec4 value;
#if KERNEL_PARTS == 2
  const Gathered a = gather(from.table.values, last, index.a);
  const Gathered b = gather(from.table.values, last, index.b);
  value.x = {a.x, b.x}, value.y = {a.y, b.y}, value.z = {a.z, b.z}, value.w = {a.w, b.w};
#else
  const Gathered found = gather(from.table.values, last, index);
  value.x = found.x, value.y = found.y, value.z = found.z, value.w = found.w;
#endif
  return value;
}
struct Sheet {
  struct Element {
    const Rows* rows;
    size_t offset;
    STRANDCAST_LANES void operator=(const vec4& value) const {
      store_vec4(value, *rows, offset, kRowFloats / 4);
    }
  };
  const Rows* rows;
  STRANDCAST_LANES Element operator[](uint element) const { return {rows, size_t{element} * kRowFloats}; }
};
/// Memory that only the strands at hand see.
struct Scratch {
  struct Element {
    Rows rows;
    STRANDCAST_LANES void operator=(const vec4& value) const { store_vec4(value, rows, 0, kStrands); }
    STRANDCAST_LANES operator vec4() const { return load_vec4(rows, 0, kStrands); }
  };
  float* at;
  STRANDCAST_LANES Element operator[](uint element) const {
    float* begin = at + size_t{element} * 4 * kStrands;
#if KERNEL_PARTS == 2
    return {{{begin, begin + simd::kLanes}}};
#else
    return {{{begin}}};
#endif
  }
};

STRANDCAST_LANES uint max(uint a, uint b) {
  return a > b ? a : b;
}
STRANDCAST_LANES uint min(uint a, uint b) {
  return a < b ? a : b;
}
/// Returns the highest bit that is set; `value` must be positive.
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
/// Hashes a value that is equal in all lanes.
STRANDCAST_LANES uint mix_u32(uint value) {
#if KERNEL_PARTS == 2
  return mix_u32(Uint(value)).a.v[0];
#else
  return mix_u32(Uint(value)).v[0];
#endif
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
  const Rows* plane(PlaneRole role) const { return &plane_[static_cast<uint>(role)]; }
  const LaneTable& table(TableRole role) const { return run_.tables[static_cast<uint>(role)]; }
  float* scratch_memory() const { return run_.scratch; }
  uint collider_count() const { return run_.collider_count; }
  uint gust_count() const { return run_.gust_count; }

  const LaneRun& run_;
  Rows plane_[kPlaneRoleCount] = {};  // of the strands at hand
  struct {
    uint x;
  } gl_GlobalInvocationID{0};
};

#if defined(__cpp_aggregate_paren_init)
#define CONSTRUCTED(Struct) Struct
#else
template <class Struct, class... Values>
STRANDCAST_LANES Struct constructed(const Values&... values) {
  return Struct{values...};
}
#define CONSTRUCTED(Struct) constructed<Struct>
#endif

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
    const uint begin = run_.block_begin * 16;
    const uint end = run_.block_end * 16;
    for (uint strand = begin; strand < end; strand += kStrands) {
      for (uint part = 0; part < KERNEL_PARTS; ++part) {
        // Behind the last block, once more what the register before has: the same values to the same places.
        uint first = strand + part * simd::kLanes;
        if (first >= end) first = strand;
        for (uint role = 0; role < kPlaneRoleCount; ++role)
          plane_[role].of[part] =
              run_.planes[role] == nullptr
                  ? nullptr
                  : run_.planes[role] + run_.block_floats[role] * (first / 16) + first % 16;
      }
      run_group();
    }
  }
};

// Numbers too small for full precision count as 0, as on OpenGL devices: single processors take a hundred
// times as long for them. (Set back by hand: a destructor would bring tables along that other files share.)
// ARM alone looks at results before they are rounded: of those less than half a rounding step below the least
// number it makes 0, which is once in 2^24 of products as small as that.
void run_kernel(const LaneRun& run) {
#if defined(__SSE2__)
  constexpr uint kFlushed = 0x8040;  // results and operands
  const uint before = _mm_getcsr();
  _mm_setcsr(before | kFlushed);
#elif defined(__aarch64__)
  constexpr uint64_t kFlushed = 1u << 24;  // FZ: results and operands
  uint64_t before;
  __asm__ volatile("mrs %0, fpcr" : "=r"(before));
  __asm__ volatile("msr fpcr, %0" : : "r"(before | kFlushed) : "memory");
#endif
  Kernel* kernel = new (run.memory) Kernel(run);
  kernel->run_blocks();
#if defined(__SSE2__)
  _mm_setcsr(before);
#elif defined(__aarch64__)
  __asm__ volatile("msr fpcr, %0" : : "r"(before) : "memory");
#endif
}

}  // namespace

extern const LaneKernel KERNEL_NAME;
const LaneKernel KERNEL_NAME = {
    KERNEL_FILE, KERNEL_VARIANT, KERNEL_SET, kStrands, sizeof(Kernel), sizeof(Kernel::StepBlock), run_kernel};

}  // namespace strandcast
