// Which way up a groom's file is, where its face is and how long its unit: guessed from the hair itself when
// nobody states it, each guess with its reason. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "common/groom/groom.h"

namespace strandcast {

/// How a point of a file comes into head space.
struct GroomPlacement {
  bool is_z_up = false;     // +Z up and -Y forward in the file; turned to +Y up and +Z forward
  float yaw_deg = 0.0f;     // then turned about +Y, counter-clockwise seen from above
  float unit_m = 1.0f;      // metres per unit of the file
  glm::vec3 origin{0.0f};   // point that becomes the head joint: file units, before the yaw
  glm::vec3 shift_m{0.0f};  // further movement at last, in head space

  glm::vec3 turn(const glm::vec3& direction) const;
  glm::vec3 place(const glm::vec3& point) const { return yawed(upright(point) - origin) * unit_m + shift_m; }

 private:
  glm::vec3 upright(const glm::vec3& v) const { return is_z_up ? glm::vec3(v.x, v.z, -v.y) : v; }
  glm::vec3 yawed(const glm::vec3& v) const;
};

template <class T>
struct Guess {
  T value{};
  std::string reason;  // "the hairline is highest there"; empty: nothing to go by, the value is the default
};

/// Whether +Z is up: when hair covers and hangs from the +Z side clearly more than the +Y side. Any units.
Guess<bool> guess_z_up(const Groom& groom);

/// The turn about +Y, a multiple of 90 degrees, that brings the face to +Z: to where the lowest roots stand
/// highest. `groom` is upright (+Y), in any unit.
Guess<float> guess_yaw_deg(const Groom& groom);

/// The first of metre, centimetre, millimetre and inch in which the sphere through the roots has the size of
/// a human head, else whatever makes it one. `groom` is in file units, +Y up.
Guess<float> guess_unit(const Groom& groom);

}  // namespace strandcast
