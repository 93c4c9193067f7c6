// VolumeDesc: how strands act on each other, over the volume that they fill. Plain data.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/kernels/volume/hair_in_air.h"

namespace strandcast {

/// Cells along the longest side of the groom's box.
inline constexpr uint32_t kMinVolumeResolution = 8;
inline constexpr uint32_t kMaxVolumeResolution = 128;
inline constexpr uint32_t kMaxVolumeSmoothing = 3;

/// How strands get into it. "auto": "sort" on an OpenGL device that can, else "host".
inline constexpr std::string_view kVolumeScatters[] = {"auto", "host", "sort", "atomics"};

struct VolumeDesc {
  double friction_per_s = 0.0;  // rate at which hair takes on the mean velocity of the hair around it
  /// How hard hair leaves where it is denser than in the groom: acceleration per cell where it is twice as
  /// dense, and where the density falls to the groom's within a cell.
  double repulsion_per_s2 = 0.0;
  double target_per_s2 = 0.0;       // how hard hair goes to where its density is the groom's
  double wind_width_m = 0.0;        // by which a simulated strand keeps the wind off what is behind it
  double rest_density_scale = 1.0;  // times the groom's own density there, from which on it is repelled
  uint32_t resolution = 32;         // cells along the longest side of the groom's box
  uint32_t smoothing = 1;           // of density and velocity: passes of [1 2 1] / 4
  uint32_t interval = 1;            // times it is used before it is made anew: of those of renews_volume()
  std::string integration = "implicit";  // of the repulsion: "implicit", or "explicit" as in the sources
  std::string scatter = "auto";          // how strands get into it, one of kVolumeScatters
  AirDesc air = {};                      // between the strands and around them; wind_width_m is its own then

  /// Whether strands act on each other other than by the air between them.
  bool has_contact() const {
    return friction_per_s > 0.0 || repulsion_per_s2 > 0.0 || target_per_s2 > 0.0 || wind_width_m > 0.0;
  }
  /// Whether any of it does something.
  bool acts() const { return has_contact() || air.acts; }
  bool is_sheltered() const { return air.acts ? air.has_wind : wind_width_m > 0.0; }
  bool has_extras() const { return target_per_s2 > 0.0 || is_sheltered(); }
  bool is_implicit() const { return integration == "implicit"; }

  bool operator==(const VolumeDesc&) const = default;
};

}  // namespace strandcast
