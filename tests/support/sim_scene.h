// Grooms and motions for tests of solvers: small, deterministic, without files.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <vector>

#include "common/base/hash.h"
#include "common/groom/groom.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

struct TestGroomDesc {
  uint32_t strand_count = 21;  // not a multiple of any group size
  uint32_t vertex_count = 16;
  double length_m = 0.25;
  double head_radius_m = 0.1;
  double bend_rad = 0.8;  // over the whole strand
  Pinning pinning = Pinning::RootPair;
  uint32_t seed = 1;
};

inline bool is_pinned(Pinning pinning, uint32_t vertex_index, uint32_t vertex_count) {
  const uint32_t root_count = pinning == Pinning::Root ? 1u : 2u;
  const uint32_t tail_count = pinning == Pinning::BothEnds ? 2u : 0u;
  return vertex_index < root_count || vertex_index + tail_count >= vertex_count;
}

/// A uniform groom from one polyline per strand, all of the same size.
inline Groom groom_from(const std::vector<std::vector<glm::vec3>>& strands, Pinning pinning) {
  Groom groom;
  groom.name = "test";
  groom.offset.push_back(0);
  for (const auto& strand : strands) {
    for (uint32_t i = 0; i < strand.size(); ++i) {
      groom.rest_position_m.push_back(strand[i]);
      groom.pinned.push_back(is_pinned(pinning, i, static_cast<uint32_t>(strand.size())) ? 1 : 0);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return groom;
}

/// Bent strands over the upper half of a sphere about the head joint, each in a plane of its own.
inline Groom make_test_groom(const TestGroomDesc& desc) {
  constexpr double kTwoPi = 6.283185307179586;
  std::vector<std::vector<glm::vec3>> strands;
  for (uint32_t s = 0; s < desc.strand_count; ++s) {
    const auto random = [&](uint32_t salt) {
      return static_cast<double>(unit_float(mix_u32(desc.seed * 7919u + s * 4u + salt)));
    };
    const double up = 0.1 + 0.9 * random(0);
    const double around = kTwoPi * random(1);
    const double level = std::sqrt(1.0 - up * up);
    const glm::dvec3 normal(level * std::cos(around), up, level * std::sin(around));
    const glm::dvec3 side = glm::normalize(glm::cross(normal, glm::dvec3(0.3, 0.2 + random(2), 0.9)));
    std::vector<glm::vec3> strand;
    glm::dvec3 point = desc.head_radius_m * normal;
    const double step_m = desc.length_m * (0.7 + 0.3 * random(3)) / (desc.vertex_count - 1);
    for (uint32_t i = 0; i < desc.vertex_count; ++i) {
      strand.emplace_back(point);
      const double angle = desc.bend_rad * i / (desc.vertex_count - 1);
      point += step_m * (std::cos(angle) * normal + std::sin(angle) * side);
    }
    strands.push_back(std::move(strand));
  }
  return groom_from(strands, desc.pinning);
}

/// A nodding, swaying head with everything switched on; step `k` of a motion sampled every h_s.
inline StepInput moving_input(int k, double h_s) {
  const double t = k * h_s;
  const auto head_at = [](double time) {
    return glm::dvec3(0.08 * std::sin(5.0 * time), 0.03 * std::sin(7.0 * time), 0.05 * std::cos(4.0 * time));
  };
  StepInput input;
  input.h_s = h_s;
  input.world_from_head_rotation =
      glm::angleAxis(0.5 * std::sin(4.0 * t), glm::normalize(glm::dvec3(1.0, 0.4, -0.2)));
  input.head_shift_m = head_at(t) - head_at(t - h_s);
  input.groom_gravity_in_head_mps2 = {0.0, -9.81, 0.0};
  input.wind_mps = {2.0, 0.0, -1.0};
  input.gusts = {{{0.8f, 0.2f, 0.0f}, {3.0f, 1.0f, 0.0f}, static_cast<float>(2.0 * t)},
                 {{0.0f, 0.1f, 0.7f}, {0.0f, 2.0f, 4.0f}, static_cast<float>(3.0 * t)}};
  input.colliders = {{glm::vec3(0.0f, 0.0f, 0.0f), 0.099f},
                     {glm::vec3(input.world_from_head_rotation * glm::dvec3(0.0, -0.05, 0.04)), 0.08f}};
  return input;
}

/// Everything of an input turned by one rotation.
inline StepInput turned(StepInput input, const glm::dquat& turn) {
  input.world_from_head_rotation = turn * input.world_from_head_rotation;
  input.head_shift_m = turn * input.head_shift_m;
  input.gravity_mps2 = turn * input.gravity_mps2;
  input.wind_mps = turn * input.wind_mps;
  for (GustWave& wave : input.gusts) {
    wave.amplitude_mps = glm::vec3(turn * glm::dvec3(wave.amplitude_mps));
    wave.wave_vector_rad_per_m = glm::vec3(turn * glm::dvec3(wave.wave_vector_rad_per_m));
  }
  for (SphereCollider& sphere : input.colliders)
    sphere.center_m = glm::vec3(turn * glm::dvec3(sphere.center_m));
  return input;
}

/// Largest distance between two states' vertices, m; infinity when anything is not finite or the sizes
/// differ.
inline double largest_distance_m(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  if (a.size() != b.size()) return INFINITY;
  double largest = 0.0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double distance = glm::distance(glm::dvec3(a[i]), glm::dvec3(b[i]));
    if (!std::isfinite(distance)) return INFINITY;
    largest = std::fmax(largest, distance);
  }
  return largest;
}

/// Of the given parameters, those that the row has: models differ in what can be set.
inline SolverParameters known_parameters(const SolverRow& row, const SolverParameters& given) {
  SolverParameters known;
  for (const SolverParameterInfo& info : row.parameters) {
    if (const auto found = given.find(info.name); found != given.end()) known.insert(*found);
  }
  return known;
}

/// All facts a solver may ask for.
inline SceneFeatures all_features() {
  SceneFeatures features;
  features.has_wind = features.has_turbulence = features.has_colliders = true;
  return features;
}

}  // namespace strandcast
