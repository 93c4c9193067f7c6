// The bytes of what a "step" frame says beside its integers: the model, the scene and the ticks. What is
// written is rounded; both sides go on with what was read. Layout in proto/WIRE.md. Private to
// common/strands.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/kernels/step_model.h"
#include "common/strands/byte_io.h"

namespace strandcast::step {

/// Largest count among a kernel's constants: rounds, solves and the like. A seed may be anything.
inline constexpr uint32_t kMostRounds = 256;
/// What a peer may ask for in a frame: ticks times substeps times rounds times vertices. A processor takes
/// about a second for as many; 100,000 x 16 with 10 rounds in 16 substeps are as many.
inline constexpr uint64_t kMostVertexRounds = uint64_t{1} << 28;
uint64_t vertex_rounds(const StepModel& model, const StepScene& scene, size_t tick_count);

/// The model for the first `strand_count` of its strands, whose rest shape this is: (vertex_count x
/// strand_count), strand fastest.
void write_model(const StepModel& model, std::span<const glm::vec3> rest_in_head_m, uint32_t strand_count,
                 std::vector<std::byte>& bytes);
/// From untrusted bytes, for strands of these counts: BadInput for a kernel that is not known, for numbers
/// that are none, and for counts that no kernel may run with.
Result<StepModel> read_model(ByteReader& bytes, std::span<const glm::vec3> rest_in_head_m,
                             uint32_t strand_count, uint32_t vertex_count);

void write_scene(const StepScene& scene, std::vector<std::byte>& bytes);
Result<StepScene> read_scene(ByteReader& bytes);

/// Wind as it is on the wire.
using WindSteps = std::array<int32_t, 3>;
WindSteps wind_steps(const glm::dvec3& wind_mps);
glm::dvec3 wind_of(const WindSteps& steps);
/// A point of a body likewise.
using PointSteps = std::array<int32_t, 3>;

/// What ticks are told beside, of the tick before.
struct TickBase {
  WindSteps wind{};
  std::vector<PointSteps> body;  // empty: not known
  std::optional<BustTurn> bust = {};
};

/// Ticks up to a frame, under this scene; `base` becomes that of the last one, whose pose is the frame's.
void write_ticks(std::span<const StepTick> ticks, const StepScene& scene, TickBase& base,
                 std::vector<std::byte>& bytes);
/// The last tick of a frame.
struct FrameTick {
  uint64_t tick = 0;
  Pose world_from_head;
};
Result<std::vector<StepTick>> read_ticks(ByteReader& bytes, const FrameTick& last, const StepScene& scene,
                                         TickBase& base);

}  // namespace strandcast::step
