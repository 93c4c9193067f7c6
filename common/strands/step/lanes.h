// Vectorised work of the predictor on all vertices, a block of strands at a time: from its floats to the
// lattice, and back from decoded positions. Private to common/strands/step; the same bits from every
// instruction set. Places without a strand keep their values.
#pragma once

#include <array>
#include <cstdint>

#include "common/kernels/strand_blocks.h"
#include "common/simd/variants.h"
#include "common/strands/tangent/motion.h"

namespace strandcast::step {

/// A rotation matrix by rows.
using Turn = std::array<std::array<float, 3>, 3>;

struct ExpectWork {
  const tangent::Layout& layout;
  const StrandBlocks& position_m;  // world axes
  Turn head_from_world;
  float quantum_m;
  tangent::Planes<int32_t>& lattice;
  uint32_t block_begin;
  uint32_t block_end;
};
void expect_blocks(simd::InstructionSet set, const ExpectWork& work);

struct CorrectWork {
  const tangent::Layout& layout;
  const tangent::Planes<int32_t>& expected;
  const tangent::Planes<int32_t>& decoded;
  Turn world_from_head;
  float quantum_m;
  float per_second;     // velocity gained by a correction, per metre
  uint32_t free_begin;  // vertices that are not pinned
  uint32_t free_end;
  StrandBlocks& position_m;
  StrandBlocks& velocity_mps;
  // What a model keeps of the last step; null = it does not.
  StrandBlocks* way_m;
  StrandBlocks* velocity_change_mps;
  StrandBlocks* axis;  // of the segment before each vertex
  uint32_t block_begin;
  uint32_t block_end;
};
void correct_blocks(simd::InstructionSet set, const CorrectWork& work);

/// Sets the strands to their decoded positions.
struct PlaceWork {
  const tangent::Layout& layout;
  const tangent::Planes<int32_t>& decoded;
  Turn world_from_head;
  float quantum_m;
  StrandBlocks& position_m;
  uint32_t block_begin;
  uint32_t block_end;
};
void place_blocks(simd::InstructionSet set, const PlaceWork& work);

/// Computes velocities from decoded positions under an earlier pose of the head; strands that jumped get
/// zero.
struct StartWork {
  const tangent::Layout& layout;
  const tangent::Planes<int32_t>& before;
  Turn world_from_head;          // then
  std::array<float, 3> shift_m;  // of the head, back to then
  float quantum_m;
  float per_second;
  const StrandBlocks& position_m;
  StrandBlocks& velocity_mps;
  uint32_t block_begin;
  uint32_t block_end;
};
void start_blocks(simd::InstructionSet set, const StartWork& work);

struct TurnWork {
  Turn by;
  StrandBlocks& vectors;
  uint32_t block_begin;
  uint32_t block_end;
};
void turn_blocks(simd::InstructionSet set, const TurnWork& work);

/// Computes twist-free material axes along the current strands.
struct AxesWork {
  const StrandBlocks& rod_edge;
  const StrandBlocks& rod_strand;
  Turn world_from_head;
  uint32_t first;  // free vertex
  const StrandBlocks& position_m;
  StrandBlocks& axis;
  uint32_t block_begin;
  uint32_t block_end;
};
void axes_blocks(simd::InstructionSet set, const AxesWork& work);

/// Rounds vectors, as differences from a reference, to whole multiples of a step.
struct SettleWork {
  StrandBlocks& vectors;
  const StrandBlocks* about = nullptr;    // null: 0
  const StrandBlocks* seconds = nullptr;  // w of whose first row that is multiplied with; null: 1
  float step = 1.0f;
  float w_step = 0.0f;  // of w, from the second row on; 0: w becomes 0
  uint32_t block_begin = 0;
  uint32_t block_end = 0;
};
void settle_blocks(simd::InstructionSet set, const SettleWork& work);
/// Largest multiple of the step that a difference may become.
inline constexpr float kMostSteps = 524288.0f;

}  // namespace strandcast::step
