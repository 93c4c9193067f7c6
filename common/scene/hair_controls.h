// HairControls: the settings of hair that a newcomer changes first, as factors on the scene's values. They
// thus survive a change of quality, solver or groom. Plain data, and the one table of their names and ranges.
// Applied by server/source/hair_factors, server/scene/scene_content and step_builder.
#pragma once

#include <array>

namespace strandcast {

/// Factors on the scene's values; 1 changes nothing.
struct HairControls {
  double length = 1.0;  // of every strand's length as loaded
  double curl = 1.0;    // amplitude of waves and curls about each strand's smooth path; 0 = combed straight
  double stiffness = 1.0;  // of the solver's own stiffness: how strongly hair keeps its style
  double friction = 1.0;   // of volume.friction_per_s
  double wind = 1.0;       // of the air's velocity, the scene's or a wind stream's

  bool operator==(const HairControls&) const = default;
};

struct HairControl {
  const char* name;  // of the field, in the scene's group `hair`
  double HairControls::*value;
  double minimum;
  double maximum;  // at least ten times a minimum above 0: a slider is logarithmic
  const char* unit;
  const char* note;  // a few words for people
};

/// Controls in the order in which they are shown; quality precedes them.
inline constexpr std::array kHairControls{
    HairControl{"length", &HairControls::length, 0.3, 1.5, "of its length",
                "0.5 = half as long as the groom, 1 = as it is"},
    HairControl{"curl", &HairControls::curl, 0.0, 2.0, "of its curl",
                "0 = combed straight, 1 = as groomed, 2 = waves twice as wide"},
    HairControl{"stiffness", &HairControls::stiffness, 0.1, 10.0, "times as stiff",
                "how strongly hair keeps its style: 0.1 = limp, 1 = as it is, 10 = wiry"},
    HairControl{"friction", &HairControls::friction, 0.0, 5.0, "of its friction",
                "how strongly hair holds on to hair: 0 = it slides, 1 = as it is"},
    HairControl{"wind", &HairControls::wind, 0.0, 3.0, "of the wind", "0 = still air, 1 = as it blows"},
};

}  // namespace strandcast
