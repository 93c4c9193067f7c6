#include "common/strands/snapshot.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/check.h"
#include "common/base/hash.h"

namespace strandcast {
namespace {

// Half the gap between neighbouring floats just below kBoundReachM (2 m: 24 bits, so 2^-24 m).
constexpr double kFloatRoundingM = kBoundReachM * 0x1p-25;

bool is_finite(const glm::vec3& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

template <class T>
uint64_t hash_value(const T& value, uint64_t seed) {
  return hash_bytes(std::as_bytes(std::span(&value, 1)), seed);
}

}  // namespace

float quantum_for_bound(float bound_m) {
  CHECK(bound_m >= kMinBoundM);
  const double quantum_m = 2.0 * (static_cast<double>(bound_m) * std::numbers::inv_sqrt3 - kFloatRoundingM);
  return std::nextafter(static_cast<float>(quantum_m), 0.0f);
}

Quantised quantise(const QuantiseInput& input) {
  const size_t plane_size = input.plane_size();
  CHECK(input.position_in_head_m.size() == plane_size);
  CHECK(input.fallback_m.empty() || input.fallback_m.size() == plane_size);
  CHECK(input.quantum_m > 0.0f);

  Quantised result;
  Snapshot& snapshot = result.snapshot;
  static_cast<SnapshotInfo&>(snapshot) = input;
  snapshot.lattice.resize(3 * plane_size);

  // Double keeps the rounding exact: a float quotient of 1 m by 0.1 mm is already off by a thousandth of a
  // step.
  const double steps_per_m = 1.0 / static_cast<double>(input.quantum_m);
  constexpr double kLimit = kMaxLattice - 1;
  for (size_t i = 0; i < plane_size; ++i) {
    glm::vec3 point = input.position_in_head_m[i];
    if (!is_finite(point)) [[unlikely]] {
      ++result.replaced_count;
      const bool has_fallback = !input.fallback_m.empty() && is_finite(input.fallback_m[i]);
      point = has_fallback ? input.fallback_m[i] : glm::vec3(0.0f);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = std::clamp(static_cast<double>(point[axis]) * steps_per_m, -kLimit, kLimit);
      snapshot.lattice[static_cast<size_t>(axis) * plane_size + i] = static_cast<int32_t>(std::lrint(steps));
    }
  }
  return result;
}

std::vector<glm::vec3> positions_in_head(const Snapshot& snapshot) {
  const size_t plane_size = snapshot.plane_size();
  CHECK(snapshot.lattice.size() == 3 * plane_size);
  const int32_t* lattice = snapshot.lattice.data();
  const double quantum_m = snapshot.quantum_m;
  std::vector<glm::vec3> positions(plane_size);
  for (size_t i = 0; i < plane_size; ++i) {
    positions[i] = {static_cast<float>(lattice[i] * quantum_m),
                    static_cast<float>(lattice[plane_size + i] * quantum_m),
                    static_cast<float>(lattice[2 * plane_size + i] * quantum_m)};
  }
  return positions;
}

uint64_t info_hash(const SnapshotInfo& info) {
  const Pose& pose = info.world_from_head;
  const double pose_numbers[7] = {pose.position_m.x, pose.position_m.y, pose.position_m.z, pose.rotation.w,
                                  pose.rotation.x,   pose.rotation.y,   pose.rotation.z};
  uint64_t hash = hash_value(info.tick, hash_bytes({}));
  hash = hash_value(info.sim_time_ns, hash);
  hash = hash_value(pose_numbers, hash);
  hash = hash_value(info.strand_count, hash);
  hash = hash_value(info.vertex_count, hash);
  return hash_value(info.quantum_m, hash);
}

uint64_t state_hash(const Snapshot& snapshot) {
  return hash_bytes(std::as_bytes(std::span(snapshot.lattice)), info_hash(snapshot));
}

}  // namespace strandcast
