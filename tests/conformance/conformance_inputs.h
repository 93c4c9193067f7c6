// What the kept streams are made of: strands that sway, stretch, tremble and turn round on a moving head, in
// whole numbers and exact fractions, so that every machine makes the same. Never change how a case that is
// kept is made; add a case of another name instead.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "common/strands/snapshot.h"

namespace strandcast::conformance {

/// One strand stream.
struct StreamCase {
  std::string name;
  std::string codec;
  uint32_t strand_count = 0;  // of the asset
  uint32_t vertex_count = 0;
  uint32_t coded_count = 0;  // of a stream of fewer strands: the first ones
  bool has_rest = true;      // whether both sides know the rest shape
};

/// Every codec: frames of a chain, joins, vertices that cannot be predicted, another bound; a prefix. Of
/// "tangent" also without a rest shape, and with slices and as many classes of weights as there can be. Of
/// "step" with two kernels, and strands that stay where steps leave them, under a head
/// off the lattice of poses and on it.
std::vector<StreamCase> stream_cases();

/// A state to be coded.
struct StreamStep {
  Snapshot snapshot;     // of the strands that the stream has
  bool is_join = false;  // somebody joins with this frame
};
std::vector<StreamStep> steps_of(const StreamCase& stream);

/// (vertex_count x strand_count), strand fastest, head space, of all strands; empty without one.
std::vector<glm::vec3> rest_shape_of(const StreamCase& stream);

}  // namespace strandcast::conformance
