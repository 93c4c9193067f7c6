// The kernels that act on strands besides a model's own, around each substep: their parts and inputs. The
// simulation runs them on its executor, the strand codec "step" on lanes. Their order is: drag before the
// model's kernel; bending, follicles, body and head field after it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <numbers>
#include <vector>

#include "common/kernels/body_input.h"
#include "common/kernels/kernel_desc.h"

namespace strandcast {

/// Whether the last vertices of strands follow the head.
enum class Tips : uint8_t { Free, Pinned };
inline constexpr Tips kBothTips[] = {Tips::Free, Tips::Pinned};
constexpr Tips other(Tips tips) {
  return tips == Tips::Free ? Tips::Pinned : Tips::Free;
}

/// What of a model goes along when a pass moves strands (MEMORY of shaders/sim/carried.glsl).
constexpr int pass_memory(bool has_way, bool has_axis) {
  return has_axis ? 2 : has_way ? 1 : 0;
}

KernelDesc follicle_limit_kernel(int memory);

/// Angles from each segment to the next, rad; from those at the root to those at the tip.
struct BendAngles {
  double least_root_rad = 0.0, least_tip_rad = 0.0;
  double most_root_rad = std::numbers::pi, most_tip_rad = std::numbers::pi;

  bool operator==(const BendAngles&) const = default;
};
KernelDesc bend_limit_kernel(const BendAngles& angles, int memory);

/// `along_share`: of the drag across a hair what there is along it, 0..1.
KernelDesc oriented_drag_kernel(double along_share, bool has_way);

/// Where the nodes of a distance field are, in head space.
struct FieldGrid {
  glm::vec3 origin_m{0.0f};  // node (0, 0, 0)
  float cell_m = 1.0f;
  glm::uvec3 node_count{0};  // at least 2 by axis

  size_t size() const { return size_t{node_count.x} * node_count.y * node_count.z; }
  bool operator==(const FieldGrid&) const = default;
};
KernelDesc field_collider_kernel(const FieldGrid& grid, int memory);

KernelDesc body_collider_kernel(int memory);

/// Strands whose tips are pinned, or free, get back what a plane had (shaders/sim/put_back.comp). The model's
/// kernel and the passes around it run once for each kind, where a groom has both.
KernelDesc put_back_kernel(Tips of);
/// The shapes as the kernel looks them up, with every number held to the limits of a step.
std::vector<glm::vec4> body_table(const BodyInput& body, double h_s, bool is_new);
extern const size_t kBodyTableSize;

}  // namespace strandcast
