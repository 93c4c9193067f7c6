// How high hair is on a screen, for whoever simulates less of it where it is small. Pure functions, any
// thread.
#pragma once

#include <glm/glm.hpp>

#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Room that hair takes, in head space.
struct HairExtent {
  glm::vec3 center_m{0.0f};  // of the groom's box
  float radius_m = 0.0f;     // of the ball around it that holds the groom
  float reach_m = 0.0f;      // no vertex gets farther from the head joint, wherever the head is turned
};

HairExtent hair_extent(const SceneAsset& asset);

/// Height in pixels of the ball that holds the groom on a picture so high and wide; 0 where no hair can be in
/// the picture, infinity where the camera is inside of the ball, or makes no picture.
double hair_height_px(const HairExtent& extent, const CameraDesc& camera, glm::uvec2 picture_px);

}  // namespace strandcast
