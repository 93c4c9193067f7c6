// Bytes of a "step" frame besides its integers: the model, the scene and the ticks. Written values are
// rounded, and both sides continue with the rounded ones. Layout in proto/WIRE.md. Private to common/strands.
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

/// Upper limit of the counts among a kernel's constants, such as rounds and solves. A seed has no limit.
inline constexpr uint32_t kMostRounds = 256;
/// Upper limit of the work that a peer may request in a frame: ticks x substeps x rounds x vertices. It takes
/// a processor about a second, for example 100,000 x 16 vertices with 10 rounds in 16 substeps.
inline constexpr uint64_t kMostVertexRounds = uint64_t{1} << 28;
uint64_t vertex_rounds(const StepModel& model, const StepScene& scene, size_t tick_count);

/// Appends the model for the first `strand_count` strands, whose rest shape has (vertex_count x strand_count)
/// points, strand fastest. Rods may carry their weight under this gravity of the head space.
void write_model(const StepModel& model, std::span<const glm::vec3> rest_in_head_m, uint32_t strand_count,
                 std::vector<std::byte>& bytes, const glm::dvec3& gravity_mps2 = glm::dvec3(0.0));
/// Reads a model for these counts from untrusted bytes. BadInput for an unknown kernel, for values that are
/// not finite, and for counts that no kernel may run with.
Result<StepModel> read_model(ByteReader& bytes, std::span<const glm::vec3> rest_in_head_m,
                             uint32_t strand_count, uint32_t vertex_count);

void write_scene(const StepScene& scene, std::vector<std::byte>& bytes);
Result<StepScene> read_scene(ByteReader& bytes);

/// Wind as coded on the wire, in whole steps.
using WindSteps = std::array<int32_t, 3>;
WindSteps wind_steps(const glm::dvec3& wind_mps);
glm::dvec3 wind_of(const WindSteps& steps);
/// A point of a body as coded on the wire, in whole steps.
using PointSteps = std::array<int32_t, 3>;

/// Values of the preceding tick; ticks are coded as differences from them.
struct TickBase {
  WindSteps wind{};
  std::vector<PointSteps> body;  // empty: not known
  BustCode chest = kRigidBust;
  std::optional<BustTurn> bust = {};  // of the chest under that tick's head
};

/// Appends the ticks up to a frame under this scene. `base` becomes that of the last tick, whose pose is the
/// frame's.
void write_ticks(std::span<const StepTick> ticks, const StepScene& scene, TickBase& base,
                 std::vector<std::byte>& bytes);
/// Tick, time and pose that a frame ends with.
struct FrameTick {
  uint64_t tick = 0;
  Pose world_from_head;
};
Result<std::vector<StepTick>> read_ticks(ByteReader& bytes, const FrameTick& last, const StepScene& scene,
                                         TickBase& base);

/// Appends the scene, or the ticks after `base`, and returns them as viewers read them: with every number
/// rounded.
StepScene told_scene(const StepScene& scene, std::vector<std::byte>& bytes);
std::vector<StepTick> told_ticks(std::span<const StepTick> ticks, const FrameTick& last,
                                 const StepScene& scene, TickBase& base, std::vector<std::byte>& bytes);

}  // namespace strandcast::step
