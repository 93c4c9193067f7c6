// Computes the height of hair on a screen, so that small hair can be simulated with less detail. Pure
// functions, any thread.
#pragma once

#include <glm/glm.hpp>

#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Bounds of the hair in head space.
struct HairExtent {
  glm::vec3 center_m{0.0f};  // of the groom's box
  float radius_m = 0.0f;     // of the ball around it that holds the groom
  float reach_m = 0.0f;      // no vertex gets farther from the head joint, wherever the head is turned
};

HairExtent hair_extent(const SceneAsset& asset);

/// Returns the height in pixels of the groom's bounding sphere in a picture of this size. 0 if no hair can be
/// visible; infinity if the camera is inside the sphere or invalid.
double hair_height_px(const HairExtent& extent, const CameraDesc& camera, glm::uvec2 picture_px);

}  // namespace strandcast
