// VelocityGuess: what a fine anchor tells of how strands move, and the velocities that joiners receive beside
// that. Private to common/strands/step; one thread.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/kernels/strand_blocks.h"
#include "common/simd/variants.h"
#include "common/strands/byte_io.h"
#include "common/strands/tangent/motion.h"

namespace strandcast::step {

/// Features of a change of velocity across its edge, along it, and classes of vertices that share weights.
inline constexpr uint32_t kGuessAcrossCount = 14;
inline constexpr uint32_t kGuessAlongCount = 3;
inline constexpr uint32_t kGuessClassCount = 6;

/// As told: how the head moves, and weights of what is expected of a vertex.
struct VelocityGuess {
  bool are_roots_carried = false;  // pinned ones move as the head, exactly
  glm::vec3 head_mps{0.0f};
  std::array<std::array<int16_t, kGuessAcrossCount>, kGuessClassCount> across{};
  std::array<std::array<int16_t, kGuessAlongCount>, kGuessClassCount> along{};

  void write(std::vector<std::byte>& bytes) const;
  static Result<VelocityGuess> read(ByteReader& bytes);
};

/// Velocities of strands in coding order, as changes from vertex to vertex beside the motion of the head.
/// Neighbours are turned to a strand's own edges before they tell anything of it. Eight strands at a time, in
/// one thread; the same bits from every instruction set.
class GuessedVelocities {
 public:
  struct Ground {
    const tangent::Layout& layout;
    const tangent::Neighbours& beside;
    const StrandBlocks& position;  // as decoded
    glm::mat3 turn_per_s;          // velocity of a point by the head's turn
    uint32_t vertex_count;
    uint32_t pinned_root_count;
    simd::InstructionSet set;
  };
  /// (vertex_count x stride)
  struct Rows {
    tangent::Planes<float> edge;    // to each vertex
    std::vector<float> per_length;  // the inverse of its length, 0 where there is none
    tangent::Planes<float> change;  // of velocity there, beside the head's
  };
  explicit GuessedVelocities(const Ground& ground);

  /// Fits a guess to velocities that are not rounded.
  VelocityGuess fit(const StrandBlocks& velocity);
  /// Rounds velocities to what the steps, three a vertex, tell; fills these.
  void settle(const VelocityGuess& guess, StrandBlocks& velocity, std::vector<int32_t>& steps);
  /// Sets velocities to what the steps tell.
  void place(const VelocityGuess& guess, std::vector<int32_t>& steps, StrandBlocks& velocity);

 private:
  glm::vec3 mean_head(const StrandBlocks& velocity) const;
  bool carries_roots(const glm::vec3& head_mps, const StrandBlocks& velocity) const;

  Ground ground_;
  Rows rows_;
};

}  // namespace strandcast::step
