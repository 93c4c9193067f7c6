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
  look.hair_color = "red";
  look.eumelanin = 0.25f;
  look.pheomelanin = 0.75f;
  look.style = {0.5f, 3,      0.03125f, 0.0078125f, 2.0f,    0.001953125f,
                5.0f, 0.125f, 2.0f,     0.25f,      0.0625f, 0.375f};
  look.shading = {0.625f, 0.375f, 1.5f,   0.75f,   1.25f,    9.0f, 2.5f,
                  3.0f,   0.25f,  0.125f, 0.0625f, 0.03125f, 0.5f};
  look.rim_direction = {-0.5f, -0.25f, 1.0f};
  look.rim_color = {0.75f, 0.5f, 1.0f};
  look.exposure = 1.25f;
  look.methods = {"marschner", "dual",  "fragment", "volume",    "hashed", "density_samples",
                  "bezier",    "split", "bends",    "occlusion", "coarse"};
  return look;
}

/// Another one, with none of the defaults nor of the values above.
inline LookDesc second_sample_look() {
  LookDesc look;
  look.root_color = {0.03125f, 0.5f, 0.25f};
  look.tip_color = {0.75f, 0.25f, 0.625f};
  look.strand_radius_m = 0.00025f;
  look.tip_scale = 0.5f;
  look.followers = 2;
  look.segments = 4;
  look.light_direction = {-1.0f, -0.25f, -0.125f};
  look.light_color = {1.5f, 0.75f, 0.25f};
  look.ambient = 0.125f;
  look.background = {0.0625f, 0.5f, 0.25f};
  look.skin_color = {0.875f, 0.25f, 0.125f};
  look.hair_color = "blond";
  look.eumelanin = 2.5f;
  look.pheomelanin = 1.25f;
  look.style = {0.25f, 7, 0.0625f, 0.015625f, 5.0f, 0.00390625f, 3.0f, 0.0625f, 6.0f, 0.5f, 0.125f, 0.75f};
  look.shading = {0.25f, 0.75f, 0.5f, 1.5f, 0.375f, 15.0f, -2.5f, 8.0f, 0.75f, 0.25f, 0.375f, 0.125f, 0.25f};
  look.rim_direction = {0.75f, 0.125f, -0.5f};
  look.rim_color = {0.25f, 1.0f, 0.5f};
  look.exposure = 0.75f;
  look.methods = {"chiang",  "none",   "vertex", "deep_opacity", "lists", "analytic",
                  "hermite", "mended", "full",   "frustum",      "same"};
  return look;
}

inline CameraDesc sample_camera() {
  return {{0.375f, 0.125f, 0.5f}, {0.015625f, -0.03125f, 0.0078125f}, 0.75f};
}

}  // namespace strandcast
