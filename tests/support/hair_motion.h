// A small hair simulation on the CPU for codec tests and benches: chains of fixed length (Follow-The-Leader
// with the velocity correction of Mueller et al. 2012) on a moving head, in gusts. Deterministic. Not one of
// the solvers.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <random>
#include <vector>

#include "common/strands/snapshot.h"

namespace strandcast {

enum class MotionKind { Still, Idle, Active, Extreme };

struct HairMotionDesc {
  uint32_t strand_count = 100;
  uint32_t vertex_count = 16;
  MotionKind kind = MotionKind::Active;
  float length_m = 0.3f;
  float curl_radius_m = 0.004f;
  glm::dvec3 origin_m{0.0};  // of the head, world
  uint32_t seed = 7;
};

class HairMotion {
 public:
  explicit HairMotion(const HairMotionDesc& desc) : desc_(desc) {
    std::mt19937 random(desc.seed);
    std::uniform_real_distribution<float> unit(0.0f, 1.0f);
    rest_.resize(plane_size());
    wind_phase_.resize(desc.strand_count);
    for (uint32_t s = 0; s < desc.strand_count; ++s) {
      const float height = 0.1f + 0.9f * unit(random);
      const float angle = 6.2831853f * unit(random);
      const float ring = std::sqrt(1.0f - height * height);
      const glm::vec3 normal(ring * std::cos(angle), height, ring * std::sin(angle));
      const float step_m =
          desc.length_m * (0.9f + 0.2f * unit(random)) / static_cast<float>(desc.vertex_count - 1);
      glm::vec3 point = 0.095f * normal;
      for (uint32_t v = 0; v < desc.vertex_count; ++v) {
        const float turn = 1.1f * static_cast<float>(v) + 3.0f * height;
        const glm::vec3 curl(std::cos(turn), 0.0f, std::sin(turn));
        rest_[v * desc.strand_count + s] = point + (v == 0 ? 0.0f : desc.curl_radius_m) * curl;
        const float droop = static_cast<float>(v) / static_cast<float>(desc.vertex_count);
        point += step_m * glm::normalize(glm::mix(normal, glm::vec3(0.0f, -1.0f, 0.0f), 0.3f + 0.6f * droop));
      }
      wind_phase_[s] = 0.3f * unit(random);
    }
    position_m_.resize(plane_size());
    velocity_mps_.assign(plane_size(), glm::dvec3(0.0));
    const Pose pose = head_pose(0.0);
    for (size_t i = 0; i < plane_size(); ++i) position_m_[i] = pose * glm::dvec3(rest_[i]);
  }

  /// (vertex_count x strand_count)
  const std::vector<glm::vec3>& rest_in_head() const { return rest_; }

  size_t plane_size() const { return static_cast<size_t>(desc_.strand_count) * desc_.vertex_count; }
  double time_s() const { return time_s_; }

  /// Advances by 1/60 s.
  void step() {
    constexpr double kStepS = 1.0 / 60.0;
    constexpr double kDragPerS = 5.0;
    constexpr double kCorrection = 0.9;
    constexpr double kSkullRadiusM = 0.1;
    time_s_ += kStepS;
    const Pose pose = head_pose(time_s_);
    const uint32_t strands = desc_.strand_count;
    std::vector<glm::dvec3> pull(desc_.vertex_count);
    for (uint32_t s = 0; s < strands; ++s) {
      std::vector<glm::dvec3> moved(desc_.vertex_count);
      for (uint32_t v = 0; v < desc_.vertex_count; ++v) {
        const size_t i = static_cast<size_t>(v) * strands + s;
        pull[v] = glm::dvec3(0.0);
        if (v < 2) {
          moved[v] = pose * glm::dvec3(rest_[i]);
          continue;
        }
        const glm::dvec3 wind = wind_at(position_m_[i] - pose.position_m, s);
        const glm::dvec3 acceleration = glm::dvec3(0.0, -9.81, 0.0) + kDragPerS * (wind - velocity_mps_[i]);
        glm::dvec3 free = position_m_[i] + kStepS * velocity_mps_[i] + kStepS * kStepS * acceleration;
        const glm::dvec3 from_head = free - pose.position_m;
        if (const double distance = glm::length(from_head); distance < kSkullRadiusM)
          free = pose.position_m + from_head * (kSkullRadiusM / std::max(distance, 1e-9));
        const double length_m = glm::distance(glm::dvec3(rest_[i]), glm::dvec3(rest_[i - strands]));
        moved[v] = moved[v - 1] + length_m * glm::normalize(free - moved[v - 1]);
        pull[v] = moved[v] - free;
      }
      for (uint32_t v = 0; v < desc_.vertex_count; ++v) {
        const size_t i = static_cast<size_t>(v) * strands + s;
        velocity_mps_[i] = (moved[v] - position_m_[i]) / kStepS;
        if (v + 1 < desc_.vertex_count && v >= 2) velocity_mps_[i] -= kCorrection * pull[v + 1] / kStepS;
        position_m_[i] = moved[v];
      }
    }
  }

  Pose head_pose(double t) const {
    Pose pose;
    pose.position_m = desc_.origin_m;
    double yaw = 0.0, pitch = 0.0;
    if (desc_.kind == MotionKind::Idle) {
      yaw = 0.05 * std::sin(1.3 * t);
      pitch = 0.03 * std::sin(0.9 * t);
      pose.position_m += glm::dvec3(0.01 * std::sin(0.8 * t), 0.004 * std::sin(1.1 * t), 0.0);
    } else if (desc_.kind == MotionKind::Active) {
      yaw = 0.73 * look(t, 0.7, 2.1);
      pitch = 0.25 * look(t + 0.9, 0.8, 2.9);
      pose.position_m += glm::dvec3(0.0, 0.025 * std::sin(11.5 * t), 1.25 * t) +
                         glm::dvec3(0.02 * std::sin(5.75 * t), 0.0, 0.0);
    } else if (desc_.kind == MotionKind::Extreme) {
      yaw = 1.3 * look(t, 0.3, 0.7);
      pitch = 0.6 * look(t + 0.2, 0.35, 0.9);
      pose.position_m += glm::dvec3(0.03 * std::sin(9.0 * t), 0.05 * std::sin(17.0 * t), 3.0 * t);
    }
    pose.rotation =
        glm::angleAxis(yaw, glm::dvec3(0.0, 1.0, 0.0)) * glm::angleAxis(pitch, glm::dvec3(1.0, 0.0, 0.0));
    return pose;
  }

  /// Head-space positions as the server would hand them to quantise(), (vertex_count x strand_count).
  std::vector<glm::vec3> positions_in_head() const {
    const Pose pose = head_pose(time_s_);
    const glm::dquat head_from_world = glm::conjugate(pose.rotation);
    std::vector<glm::vec3> points(plane_size());
    for (size_t i = 0; i < points.size(); ++i)
      points[i] = glm::vec3(head_from_world * (position_m_[i] - pose.position_m));
    return points;
  }

  Snapshot snapshot(float quantum_m) const {
    const std::vector<glm::vec3> points = positions_in_head();
    QuantiseInput input;
    input.tick = static_cast<uint64_t>(std::llround(time_s_ * 60.0));
    input.sim_time_ns = std::llround(time_s_ * 1e9);
    input.motion_time_ns = input.sim_time_ns + 5;
    input.world_from_head = head_pose(time_s_);
    input.strand_count = desc_.strand_count;
    input.vertex_count = desc_.vertex_count;
    input.quantum_m = quantum_m;
    input.position_in_head_m = points;
    return quantise(input).snapshot;
  }

 private:
  /// Looks from side to side: minimum-jerk moves of `move_s` seconds, one every `period_s`; -1..1.
  static double look(double t, double move_s, double period_s) {
    const double cycle = std::floor(t / period_s);
    const double x = std::min(1.0, (t - cycle * period_s) / move_s);
    const double blend = x * x * x * (10.0 + x * (6.0 * x - 15.0));
    const auto target = [](double i) { return std::sin(2.4 * i); };
    return target(cycle) + (target(cycle + 1.0) - target(cycle)) * blend;
  }

  glm::dvec3 wind_at(const glm::dvec3& x, uint32_t s) const {
    if (desc_.kind == MotionKind::Still) return glm::dvec3(0.0);
    const double speed = desc_.kind == MotionKind::Idle ? 0.5 : desc_.kind == MotionKind::Active ? 1.5 : 4.0;
    const double phase = 6.0 * x.x + 4.0 * x.y - 9.0 * time_s_ + wind_phase_[s];
    return speed * glm::dvec3(0.4 + 0.5 * std::sin(phase), 0.15 * std::sin(2.3 * phase + 14.0 * x.z),
                              0.4 * std::cos(1.7 * phase));
  }

  HairMotionDesc desc_;
  double time_s_ = 0.0;
  std::vector<glm::vec3> rest_;
  std::vector<float> wind_phase_;
  std::vector<glm::dvec3> position_m_;
  std::vector<glm::dvec3> velocity_mps_;
};

}  // namespace strandcast
