// BustSkin: the mesh under the hair with its bust in a pose of its own (common/math/bust.h). Where the neck
// is follows from the mesh alone, so whoever has the mesh finds the same. Deterministic; any thread.
#pragma once

#include <vector>

#include "common/groom/mesh.h"
#include "common/math/bust.h"

namespace strandcast {

/// The neck of a head with shoulders, upright and with its face at +Z; none where a mesh has no shoulders, or
/// no chin above a neck.
BustRig find_bust(const Mesh& mesh);

class BustSkin {
 public:
  BustSkin() = default;
  explicit BustSkin(const Mesh& rest);

  const BustRig& rig() const { return rig_; }
  /// Moves the neck and bust of this mesh, which is the one at rest or what pose() made of it. False where it
  /// is so already.
  bool pose(const BustTurn& turn, Mesh& mesh);

 private:
  /// A vertex below the head.
  struct Moved {
    uint32_t vertex = 0;
    glm::vec3 position_m{0.0f}, normal{0.0f};  // at rest
  };
  BustRig rig_;
  std::vector<Moved> moved_;
  BustTurn turn_{0.0};
};

}  // namespace strandcast
