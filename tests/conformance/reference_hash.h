// The state hash, written from the words of proto/WIRE.md: shares no code with common/.
#pragma once

#include <bit>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/strands/snapshot.h"

namespace strandcast::conformance {

class ReferenceHash {
 public:
  /// A part of the state: its bytes, little-endian.
  void add(const std::vector<uint8_t>& part) {
    const size_t whole = part.size() / 8;
    for (size_t w = 0; w < whole; ++w) {
      uint64_t word = 0;
      for (size_t i = 8; i-- > 0;) word = word << 8 | part[8 * w + i];
      value_ = (value_ ^ word) * kPrime;
      value_ ^= value_ >> 32;
    }
    for (size_t i = 8 * whole; i < part.size(); ++i) value_ = (value_ ^ part[i]) * kPrime;
  }
  uint64_t value() const { return value_; }

 private:
  static constexpr uint64_t kPrime = 1'099'511'628'211;  // 0x100000001b3
  uint64_t value_ = 0xcbf29ce484222325;
};

template <class Number>
void append_number(std::vector<uint8_t>& part, Number number) {
  uint64_t bits = 0;
  if constexpr (std::is_same_v<Number, double>)
    bits = std::bit_cast<uint64_t>(number);
  else if constexpr (std::is_same_v<Number, float>)
    bits = std::bit_cast<uint32_t>(number);
  else
    bits = static_cast<uint64_t>(number);
  for (size_t i = 0; i < sizeof(Number); ++i) part.push_back(static_cast<uint8_t>(bits >> (8 * i)));
}

/// The parts of a state in the order in which they are hashed.
inline std::vector<std::vector<uint8_t>> hashed_parts(const Snapshot& snapshot) {
  std::vector<std::vector<uint8_t>> parts(7);
  append_number(parts[0], snapshot.tick);
  append_number(parts[1], snapshot.sim_time_ns);
  const Pose& pose = snapshot.world_from_head;
  for (const double number : {pose.position_m.x, pose.position_m.y, pose.position_m.z, pose.rotation.w,
                              pose.rotation.x, pose.rotation.y, pose.rotation.z})
    append_number(parts[2], number);
  append_number(parts[3], snapshot.strand_count);
  append_number(parts[4], snapshot.vertex_count);
  append_number(parts[5], snapshot.quantum_m);
  for (const int32_t value : snapshot.lattice) append_number(parts[6], value);
  return parts;
}

inline uint64_t reference_state_hash(const Snapshot& snapshot) {
  ReferenceHash hash;
  for (const auto& part : hashed_parts(snapshot)) hash.add(part);
  return hash.value();
}

/// Of points, as one part.
inline uint64_t reference_hash(std::span<const glm::vec3> points) {
  std::vector<uint8_t> part;
  for (const glm::vec3& point : points)
    for (int axis = 0; axis < 3; ++axis) append_number(part, point[axis]);
  ReferenceHash hash;
  hash.add(part);
  return hash.value();
}

}  // namespace strandcast::conformance
