// Guesses a groom file's up axis, facing direction and unit from the hair itself when nobody states them.
// Each guess comes with its reason. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "common/groom/groom.h"

namespace strandcast {

struct CommonUnit {
  float unit_m;
  const char* name;
};
/// Units of files, in the order in which they are tried. Metres that were taken for centimetres are last.
inline constexpr CommonUnit kCommonUnits[] = {{1.0f, "metres"},
                                              {0.01f, "centimetres"},
                                              {0.001f, "millimetres"},
                                              {0.0254f, "inches"},
                                              {100.0f, "units of 100 m"}};
/// How many times larger one file may be than another, by its unit alone.
inline constexpr float kUnitRatios[] = {0.01f, 100.0f,  0.001f,         1000.0f, 0.1f,
                                        10.0f, 0.0254f, 1.0f / 0.0254f, 2.54f,   1.0f / 2.54f};

/// Transformation of a file's points into head space.
struct GroomPlacement {
  bool is_z_up = false;         // +Z up and -Y forward in the file; turned to +Y up and +Z forward
  bool is_upside_down = false;  // then turned over about +Z: the file's -Y or -Z is up
  float yaw_deg = 0.0f;         // then turned about +Y, counter-clockwise seen from above
  float unit_m = 1.0f;          // metres per unit of the file
  glm::vec3 origin{0.0f};       // point that becomes the head joint: file units, before the yaw
  glm::vec3 shift_m{0.0f};      // further movement at last, in head space

  glm::vec3 turn(const glm::vec3& direction) const;
  glm::vec3 place(const glm::vec3& point) const { return yawed(upright(point) - origin) * unit_m + shift_m; }

 private:
  glm::vec3 upright(const glm::vec3& v) const {
    const glm::vec3 turned = is_z_up ? glm::vec3(v.x, v.z, -v.y) : v;
    return is_upside_down ? glm::vec3(-turned.x, -turned.y, turned.z) : turned;
  }
  glm::vec3 yawed(const glm::vec3& v) const;
};

template <class T>
struct Guess {
  T value{};
  std::string reason;  // "the hairline is highest there"; empty: nothing to go by, the value is the default
};

/// Which side of a file is up, as GroomPlacement has it.
struct UpSide {
  bool is_z_up = false;
  bool is_upside_down = false;
  bool operator==(const UpSide&) const = default;
};

/// Guesses which of +Y, +Z, -Y and -Z is up: the assumed one, unless hair covers, and hangs from, another
/// side clearly more; the reason is empty then. Any units.
Guess<UpSide> guess_up(const Groom& groom, const UpSide& assumed = {});
/// Returns "+X" or "-X" where that side is so, and nullptr for other hair.
const char* lies_aside(const Groom& groom, const UpSide& assumed);
/// Returns the name of a side: "+Z".
const char* name_of(const UpSide& up);
/// Returns how groom.file.up_axis names it.
const char* setting_of(const UpSide& up);

/// Guesses the rotation about +Y, in whole degrees, that turns the face to +Z; nearly a quarter turn is taken
/// as one. The face is where the lowest roots are highest, in the plane to whose sides the roots are alike.
/// `groom` is upright (+Y), in any unit.
Guess<float> guess_yaw_deg(const Groom& groom);

/// Guesses the unit: the first of kCommonUnits that gives the sphere through the roots the size of a human
/// head, or flat roots hair of usual length. Otherwise returns the factor that does. Fur and beards never get
/// a unit of their own: one in which neither is usual stays a metre. `groom` is in file units, +Y up.
Guess<float> guess_unit(const Groom& groom);

}  // namespace strandcast
