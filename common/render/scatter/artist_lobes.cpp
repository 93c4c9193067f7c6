#include "common/render/scatter/artist_lobes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast::scatter {
namespace {

constexpr double kArtistHalfAngleNorm = 0.5;

double bell(double width, double x) {
  return std::exp(-x * x / (2.0 * width * width));
}

double sine_of_cosine(double cosine) {
  return std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
}

}  // namespace

StrandAngles angles_of(const StrandView& view) {
  const double along_light = std::clamp(glm::dot(view.tangent, view.to_light), -1.0, 1.0);
  const double along_eye = std::clamp(glm::dot(view.tangent, view.to_eye), -1.0, 1.0);
  const glm::dvec3 light_across = view.to_light - along_light * view.tangent;
  const glm::dvec3 eye_across = view.to_eye - along_eye * view.tangent;
  const double lengths = glm::length(light_across) * glm::length(eye_across);
  const double cos_phi =
      lengths > 0.0 ? std::clamp(glm::dot(light_across, eye_across) / lengths, -1.0, 1.0) : 1.0;
  return {std::asin(along_light), std::asin(along_eye), std::acos(cos_phi)};
}

double kajiya_kay_diffuse(const StrandView& view) {
  return glm::length(glm::cross(view.tangent, view.to_light));
}

double kajiya_kay_specular(const StrandView& view, double power) {
  return turned_highlight(view, 0.0, power);
}

double turned_highlight(const StrandView& view, double turn, double power) {
  const double light_along = glm::dot(view.tangent, view.to_light);
  const double eye_along = glm::dot(view.tangent, view.to_eye);
  // Inclination of the reflected ray, turned.
  const double reflected = -light_along * std::cos(turn) + sine_of_cosine(light_along) * std::sin(turn);
  const double cosine = reflected * eye_along + sine_of_cosine(reflected) * sine_of_cosine(eye_along);
  return std::pow(std::max(0.0, cosine), power);
}

std::array<double, 3> sadeghi_lobes(const ArtistLobes& lobes, const StrandAngles& angles) {
  const double half = 0.5 * (angles.theta_in + angles.theta_out);
  const double cos_diff = std::cos(0.5 * (angles.theta_out - angles.theta_in));
  const std::array<double, 3> across{
      std::cos(0.5 * angles.phi), bell(lobes.azimuth_tt, std::numbers::pi - angles.phi),
      std::cos(0.5 * angles.phi) + lobes.glint * bell(lobes.azimuth_glint, lobes.glint_phi - angles.phi)};
  std::array<double, 3> values{};
  for (size_t i = 0; i < values.size(); ++i)
    values[i] = kArtistHalfAngleNorm * gaussian(lobes.shapes[i].width, half - lobes.shapes[i].shift) *
                across[i] / (cos_diff * cos_diff);
  return values;
}

double karis_index_in_section(double cos_theta_diff) {
  return 1.19 / cos_theta_diff + 0.36 * cos_theta_diff;
}

double schlick_fresnel(double index, double cosine) {
  const double root = (1.0 - index) / (1.0 + index);
  const double straight = root * root;
  return straight + (1.0 - straight) * std::pow(1.0 - cosine, 5.0);
}

KarisAzimuthal karis_azimuthal(const glm::dvec3& color, double cos_theta_diff, double cos_phi,
                               double cos_light_eye) {
  const double cos_half_phi = std::sqrt(0.5 + 0.5 * cos_phi);
  const auto through = [&](double power) { return glm::pow(color, glm::dvec3(power)); };
  KarisAzimuthal lobes;
  lobes.r = 0.25 * cos_half_phi * schlick_fresnel(kHairIndex, std::sqrt(0.5 + 0.5 * cos_light_eye));
  const double a = 1.0 / karis_index_in_section(cos_theta_diff);
  const double h = cos_half_phi * (1.0 + a * (0.6 - 0.8 * cos_phi));
  const double entering = 1.0 - schlick_fresnel(kHairIndex, cos_theta_diff * sine_of_cosine(h));
  lobes.tt = entering * entering * std::exp(-3.65 * cos_phi - 3.98) *
             through(sine_of_cosine(h * a) / (2.0 * cos_theta_diff));
  const double inside = schlick_fresnel(kHairIndex, 0.5 * cos_theta_diff);
  lobes.trt = (1.0 - inside) * (1.0 - inside) * inside * std::exp(17.0 * cos_phi - 16.78) *
              through(0.8 / cos_theta_diff);
  return lobes;
}

}  // namespace strandcast::scatter
