// BustSkin: moves the mesh under the hair so that its bust has a pose of its own (common/math/bust.h). The
// location of the neck follows from the mesh alone, so server and viewers agree on it. Deterministic; any
// thread.
#pragma once

#include <vector>

#include "common/groom/mesh.h"
#include "common/math/bust.h"

namespace strandcast {

/// Finds the neck of a mesh that is upright with its face at +Z. Returns an empty rig if the mesh has no
/// shoulders, or no chin above a neck.
BustRig find_bust(const Mesh& mesh);

class BustSkin {
 public:
  BustSkin() = default;
  explicit BustSkin(const Mesh& rest);

  const BustRig& rig() const { return rig_; }
  /// Moves neck and bust of `mesh`, which is the mesh at rest or one that pose() has moved. Returns false if
  /// it already has this pose.
  bool pose(const BustTurn& turn, Mesh& mesh);

 private:
  /// A vertex below the head, which the bust moves.
  struct Moved {
    uint32_t vertex = 0;
    glm::vec3 position_m{0.0f}, normal{0.0f};  // at rest
  };
  BustRig rig_;
  std::vector<Moved> moved_;
  BustTurn turn_{0.0};
};

}  // namespace strandcast
