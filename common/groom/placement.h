// Guesses a groom file's up axis, facing direction and unit from the hair itself when nobody states them.
// Each guess comes with its reason. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "common/groom/groom.h"

namespace strandcast {

/// Transformation of a file's points into head space.
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

/// Guesses whether +Z is up: true if hair covers, and hangs from, the +Z side clearly more than the +Y side.
/// Any units.
Guess<bool> guess_z_up(const Groom& groom);

/// Guesses the rotation about +Y, in degrees, that turns the face to +Z; nearly a quarter turn counts as one.
/// The face is where the lowest roots are highest. `groom` is upright (+Y), in any unit.
Guess<float> guess_yaw_deg(const Groom& groom);

/// Guesses the unit: the first of metre, centimetre, millimetre and inch that gives the sphere through the
/// roots the size of a human head. Otherwise returns the factor that does. `groom` is in file units, +Y up.
Guess<float> guess_unit(const Groom& groom);

}  // namespace strandcast
