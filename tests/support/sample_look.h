// A look and a camera with no value of the defaults, which can be drawn: whoever loses one of them on its way
// shows or compares something else.
#pragma once

#include "common/scene/scene_desc.h"

namespace strandcast {

inline LookDesc sample_look() {
  LookDesc look;
  look.root_color = {0.5f, 0.25f, 0.0625f};
  look.tip_color = {0.125f, 0.75f, 0.375f};
  look.strand_radius_m = 0.0005f;
  look.tip_scale = 0.875f;
  look.followers = 5;
  look.segments = 2;
  look.light_direction = {0.25f, -1.0f, 0.5f};
  look.light_color = {0.5f, 1.5f, 2.0f};
  look.ambient = 0.4375f;
  look.background = {0.75f, 0.0f, 0.5f};
  look.skin_color = {0.25f, 0.625f, 1.0f};
  return look;
}

inline CameraDesc sample_camera() {
  return {{0.375f, 0.125f, 0.5f}, {0.015625f, -0.03125f, 0.0078125f}, 0.75f};
}

}  // namespace strandcast
