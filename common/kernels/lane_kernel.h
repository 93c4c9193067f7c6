// LaneKernel: one strand kernel of shaders/sim, compiled as C++ for one instruction set. Plain data, so that
// files which are compiled for wide sets share no inline function with any other (the linker keeps one of
// each).
#pragma once

#include <cstddef>
#include <cstdint>

namespace strandcast {

/// A model's constant: of a number or a count the other field is 0.
struct LaneConstant {
  const char* name;
  float number;
  uint32_t count;
};

/// A table that a kernel looks things up in: count vec4, 16-byte aligned.
struct LaneTable {
  const float* values = nullptr;  // null = none
  uint32_t count = 0;
};

/// What a run of a kernel works on: blocks [block_begin, block_end) of all planes.
struct LaneRun {
  const void* step = nullptr;   // StepBlock with one strand in `shape`: a kernel sees one strand of a block
  uint32_t collider_count = 0;  // the first ones of the step
  uint32_t gust_count = 0;      // the first ones of the step
  float* const* planes = nullptr;  // kPlaneRoleCount, in blocks (common/kernels/strand_blocks.h); null = none
  const size_t* block_floats = nullptr;  // of each plane
  const LaneTable* tables = nullptr;     // kTableRoleCount
  const LaneConstant* constants = nullptr;
  uint32_t constant_count = 0;
  uint32_t block_begin = 0;
  uint32_t block_end = 0;
  void* memory = nullptr;    // LaneKernel::memory_bytes, 64-byte aligned, of this thread
  float* scratch = nullptr;  // scratch rows x vertices x 4 x LaneKernel::strands floats, of this thread
};

struct LaneKernel {
  const char* shader_path;  // below shaders/
  const char* variant;      // "HAS_PINNED_TAIL=1 HAS_TWIST=0", in the order of their names
  int set;                  // simd::InstructionSet
  uint32_t strands;         // that it works on side by side: rows of its scratch are as wide
  size_t memory_bytes;
  size_t step_bytes;  // of the StepBlock that it reads
  void (*run)(const LaneRun& run);
};

/// All that were built, in no order.
struct LaneKernels {
  const LaneKernel* const* kernels;
  size_t count;
};
LaneKernels lane_kernels();

}  // namespace strandcast
