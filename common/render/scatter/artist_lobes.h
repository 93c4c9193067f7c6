// Shading models designed for their looks and low cost, in double precision, written from their equations:
// Kajiya and Kay 1989 with TressFX's two highlights, Sadeghi et al. 2010, Karis 2016. Directions are unit
// vectors that point away from the strand. Pure functions, any thread.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "common/render/scatter/marschner.h"

namespace strandcast::scatter {

/// A light and an eye relative to a strand with this tangent (root to tip).
struct StrandView {
  glm::dvec3 tangent{1.0, 0.0, 0.0};
  glm::dvec3 to_light{0.0, 1.0, 0.0};
  glm::dvec3 to_eye{0.0, 1.0, 0.0};
};
struct StrandAngles {
  double theta_in = 0.0;
  double theta_out = 0.0;
  double phi = 0.0;  // 0 .. pi
};
StrandAngles angles_of(const StrandView& view);

double kajiya_kay_diffuse(const StrandView& view);
double kajiya_kay_specular(const StrandView& view, double power);
/// Highlight on a reflection cone that is tilted by `turn` towards the tip (TressFX 4.1: -2 and +3 times its
/// cone angle of 10 degrees).
double turned_highlight(const StrandView& view, double turn, double power);

struct ArtistLobes {
  std::array<LobeShape, 3> shapes;        // R, TT, TRT
  double azimuth_tt = 35.0 * kDegree;     // gamma_TT
  double azimuth_glint = 15.0 * kDegree;  // gamma_g
  double glint = 0.4;                     // I_g, at most 0.5
  double glint_phi = 35.0 * kDegree;      // where the strand's glint is seen, 30 .. 45 degrees
};
/// Lobes R, TT and TRT of Sadeghi et al. 2010 without colours and weights.
std::array<double, 3> sadeghi_lobes(const ArtistLobes& lobes, const StrandAngles& angles);

/// Karis 2016: azimuthal parts of R, TT and TRT, including absorption in the fibre.
struct KarisAzimuthal {
  double r = 0.0;
  glm::dvec3 tt{0.0};
  glm::dvec3 trt{0.0};
};
double karis_index_in_section(double cos_theta_diff);
double schlick_fresnel(double index, double cosine);
KarisAzimuthal karis_azimuthal(const glm::dvec3& color, double cos_theta_diff, double cos_phi,
                               double cos_light_eye);

}  // namespace strandcast::scatter
