#include "common/render/scatter/fibre_optics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast::scatter {
namespace {

double cosine_of_sine(double sine) {
  return std::sqrt(std::max(0.0, 1.0 - sine * sine));
}

}  // namespace

double fresnel(double index, double cos_incidence) {
  const double cos_i = std::clamp(cos_incidence, 0.0, 1.0);
  const double cos_t = std::sqrt(std::max(0.0, 1.0 - (1.0 - cos_i * cos_i) / (index * index)));
  const double across = (cos_i - index * cos_t) / (cos_i + index * cos_t);
  const double along = (index * cos_i - cos_t) / (index * cos_i + cos_t);
  return 0.5 * (across * across + along * along);
}

BravaisIndices bravais_indices(double index, double theta) {
  constexpr double kMinCosine = 1e-9;
  const double cos_theta = std::max(std::cos(theta), kMinCosine);
  const double inside = std::sqrt(index * index - square(std::sin(theta)));
  return {inside / cos_theta, index * index * cos_theta / inside};
}

double section_fresnel(const BravaisIndices& indices, double h) {
  const double cos_i = cosine_of_sine(h);
  const double cos_t = cosine_of_sine(h / indices.perpendicular);
  const double across = (cos_i - indices.perpendicular * cos_t) / (cos_i + indices.perpendicular * cos_t);
  const double along = (indices.parallel * cos_i - cos_t) / (indices.parallel * cos_i + cos_t);
  return 0.5 * (across * across + along * along);
}

double pass_transmittance(const FibreRay& ray) {
  const double cos_theta_t = cosine_of_sine(std::sin(ray.theta) / ray.index);
  const double cos_gamma_t = cosine_of_sine(ray.h / bravais_indices(ray.index, ray.theta).perpendicular);
  return std::exp(-2.0 * ray.absorption * cos_gamma_t / cos_theta_t);
}

std::array<double, kLobes> lobe_shares(const FibreRay& ray) {
  const double f = fresnel(ray.index, std::cos(ray.theta) * cosine_of_sine(ray.h));
  const double t = pass_transmittance(ray);
  std::array<double, kLobes> shares{};
  shares[0] = f;
  shares[1] = square(1.0 - f) * t;
  shares[2] = shares[1] * t * f;
  // At grazing incidence nothing enters, and f t may reach 1.
  shares[3] = f < 1.0 ? shares[2] * f * t / (1.0 - t * f) : 0.0;
  return shares;
}

double exit_azimuth(size_t p, double index_in_section, double h) {
  const auto passes = static_cast<double>(p);
  return 2.0 * passes * std::asin(std::clamp(h / index_in_section, -1.0, 1.0)) -
         2.0 * std::asin(std::clamp(h, -1.0, 1.0)) + passes * std::numbers::pi;
}

double wrapped(double angle) {
  return angle - 2.0 * std::numbers::pi * std::round(angle / (2.0 * std::numbers::pi));
}

double gaussian(double width, double x) {
  return std::exp(-x * x / (2.0 * width * width)) / (width * std::sqrt(2.0 * std::numbers::pi));
}

}  // namespace strandcast::scatter
