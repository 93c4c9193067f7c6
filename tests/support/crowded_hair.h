// Hair that acts on hair, shaken and left alone: how it lies afterwards, seen from the head. For tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/kernels/volume/hair_volume.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/executor/executor.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// What is seen of hair that should lie still.
struct RestFindings {
  double speed_rms_mps = 0.0;
  double nyquist_m = 0.0;  // largest amplitude of what changes its sign from step to step, 99.9 % of vertices
  double volume_share = 0.0;   // of the groom's: (length of all hair)^2 / integral of the squared density
  double crowded_share = 0.0;  // of vertices that lie more than twice as dense as in the groom
  double highest_m = 0.0;      // height of the hair above the head joint
};

/// A tuft that hangs from a disc and gets wider downwards, each strand a little in its own direction: without
/// forces between strands it falls together.
inline Groom tuft(uint32_t strand_count, uint32_t vertex_count, float length_m, uint32_t seed) {
  constexpr float kRootRadiusM = 0.03f;
  constexpr float kFlare = 0.12f;    // tangent of how far the outermost strands lean out
  constexpr float kScatter = 0.06f;  // of directions
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  Groom groom;
  groom.name = "tuft";
  groom.offset = {0};
  while (groom.strand_count() < strand_count) {
    const glm::vec2 root(uniform(random), uniform(random));
    if (glm::dot(root, root) > 1.0f) continue;
    const glm::vec3 begin(kRootRadiusM * root.x, 0.1f, kRootRadiusM * root.y);
    const glm::vec3 along = glm::normalize(glm::vec3(kFlare * root.x + kScatter * uniform(random), -1.0f,
                                                     kFlare * root.y + kScatter * uniform(random)));
    for (uint32_t i = 0; i < vertex_count; ++i) {
      const float way_m = length_m * static_cast<float>(i) / static_cast<float>(vertex_count - 1);
      groom.rest_position_m.push_back(begin + way_m * along);
      groom.pinned.push_back(i == 0 ? 1 : 0);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return groom;
}

class CrowdedHair {
 public:
  /// A groom without a head.
  CrowdedHair(Executor& executor, const SceneDesc& scene, Groom groom)
      : scene_(scene),
        content_(content_of(std::move(groom))),
        builder_(scene, {}),
        layout_(make_strand_layout(content_.groom).value()),
        volume_(HairVolume::make({layout_.strand_count, layout_.vertex_count, layout_.rest, {}},
                                 {scene.volume.resolution, 1})
                    .value()),
        nodes_(volume_.most_nodes()) {
    const SolverRow* row = find_solver(scene.solver.name).value();
    SolverContext context{&executor, analyse(scene, {})};
    context.groom_gravity_in_head_mps2 = scene.gravity_mps2;
    context.volume = scene.volume;
    context.bend_limit = scene.bend_limit;
    auto solver = row->make(complete_parameters(*row, scene.solver.parameters).value(), context);
    EXPECT_TRUE(solver) << solver.error().to_string();
    solver_ = std::move(solver).value();
    features_ = context.features;
    const Status loaded = solver_->load(content_.groom, head_at(0.0).rotation);
    EXPECT_TRUE(loaded) << loaded.error().to_string();
    for (const glm::vec4& rest : layout_.rest) position_m_.push_back(glm::vec3(rest));
    groom_density_ = densities();
    groom_volume_m3_ = filled_volume_m3();
  }

  /// Shakes for so long, then holds still.
  void shake(double seconds) {
    const double begin_s = time_s();
    while (time_s() - begin_s < seconds) step(head_at(time_s() - begin_s + 1.0 / scene_.step_rate_hz));
    still_ = head_at(time_s() - begin_s);
  }
  void hold(double seconds) {
    for (int i = 0; i < std::lround(seconds * scene_.step_rate_hz); ++i) step(still_);
  }
  /// While it lies for so long.
  RestFindings look(double seconds) {
    RestFindings findings;
    const int steps = static_cast<int>(std::lround(seconds * scene_.step_rate_hz));
    std::vector<glm::vec3> before = position_m_;
    std::vector<glm::vec3> before_that = position_m_;
    std::vector<double> nyquist(layout_.size(), 0.0);
    double squared = 0.0;
    for (int i = 0; i < steps; ++i) {
      before_that = std::exchange(before, position_m_);
      step(still_);
      for (size_t v = 0; v < position_m_.size(); ++v) {
        const glm::dvec3 moved = glm::dvec3(position_m_[v]) - glm::dvec3(before[v]);
        const glm::dvec3 moved_before = glm::dvec3(before[v]) - glm::dvec3(before_that[v]);
        squared += glm::dot(moved, moved);
        if (i > 0) nyquist[v] = std::max(nyquist[v], 0.25 * glm::distance(moved, moved_before));
      }
    }
    findings.speed_rms_mps =
        scene_.step_rate_hz *
        std::sqrt(squared / (static_cast<double>(steps) * static_cast<double>(layout_.size())));
    std::sort(nyquist.begin(), nyquist.end());
    findings.nyquist_m = nyquist[nyquist.size() * 999 / 1000];
    const std::vector<double> density = densities();
    size_t crowded = 0;
    for (size_t v = 0; v < density.size(); ++v) crowded += density[v] > 2.0 * groom_density_[v] ? 1 : 0;
    findings.crowded_share = static_cast<double>(crowded) / static_cast<double>(density.size());
    findings.volume_share = filled_volume_m3() / groom_volume_m3_;
    findings.highest_m = -1.0;
    for (const glm::vec3& point : position_m_)
      findings.highest_m = std::max(findings.highest_m, static_cast<double>(point.y));
    return findings;
  }
  /// Root mean square of how far vertices are from where the groom has them.
  double shape_rms_m() const {
    double squared = 0.0;
    for (size_t i = 0; i < position_m_.size(); ++i) {
      const glm::dvec3 off = glm::dvec3(position_m_[i]) - glm::dvec3(layout_.rest[i]);
      squared += glm::dot(off, off);
    }
    return std::sqrt(squared / static_cast<double>(position_m_.size()));
  }
  /// Of all vertices from where the groom has them, head space.
  glm::dvec3 mean_shift_m() const {
    glm::dvec3 sum(0.0);
    for (size_t i = 0; i < position_m_.size(); ++i)
      sum += glm::dvec3(position_m_[i]) - glm::dvec3(layout_.rest[i]);
    return sum / static_cast<double>(position_m_.size());
  }

 private:
  static SceneContent content_of(Groom groom) {
    SceneContent content;
    content.groom = std::move(groom);
    return content;
  }
  double time_s() const { return static_cast<double>(tick_) / scene_.step_rate_hz; }
  /// 3 g to and fro at 2 Hz while the head says no and nods.
  static Pose head_at(double t_s) {
    Pose pose;
    constexpr double kTurn = 2.0 * 3.14159265358979;
    pose.position_m = {0.15 * std::sin(2.0 * kTurn * t_s), 1.6 + 0.03 * std::sin(3.1 * kTurn * t_s), 0.0};
    pose.rotation = glm::angleAxis(0.6 * std::sin(1.3 * kTurn * t_s), glm::dvec3(0.0, 1.0, 0.0)) *
                    glm::angleAxis(0.3 * std::sin(0.9 * kTurn * t_s), glm::dvec3(1.0, 0.0, 0.0));
    return pose;
  }
  void step(const Pose& head) {
    ++tick_;
    InputFrame input;
    input.has_motion = true;
    input.is_motion_stale = false;
    input.world_from_head = head;
    const SceneStep& step = builder_.build(input, features_, time_s());
    if (step.carried_to_rotation) solver_->rebase(*step.carried_to_rotation);
    for (const StepInput& substep : step.substeps) solver_->substep(substep);
    SolverState state;
    solver_->read(state);
    const glm::dmat3 head_from_world = glm::transpose(glm::mat3_cast(step.world_from_head.rotation));
    for (size_t i = 0; i < position_m_.size(); ++i)
      position_m_[i] = glm::vec3(head_from_world * glm::dvec3(state.position_m[i]));
  }
  void fill() {
    StrandBlocks blocks(layout_.strand_count, layout_.vertex_count);
    pack_blocks(std::span<const glm::vec3>(position_m_), blocks);
    VolumeInput input;
    input.position_m = blocks.view();
    volume_.update(input, nodes_);
  }
  std::vector<double> densities() {
    fill();
    std::vector<double> density;
    for (const glm::vec3& point : position_m_)
      density.push_back(sample_volume(volume_.grid(), nodes_, glm::dvec3(point)).density_mpm3);
    return density;
  }
  double filled_volume_m3() {
    fill();
    const auto cell_m = static_cast<double>(volume_.cell_m());
    double length_m = 0.0;
    double squared = 0.0;
    for (size_t i = 0; i < volume_.grid().size(); ++i) {
      const double density = static_cast<double>(nodes_[i].w);
      length_m += density * cell_m * cell_m * cell_m;
      squared += density * density * cell_m * cell_m * cell_m;
    }
    return length_m * length_m / squared;
  }

  SceneDesc scene_;
  SceneContent content_;
  StepBuilder builder_;
  StrandLayout layout_;
  SceneFeatures features_;
  std::unique_ptr<Solver> solver_;
  HairVolume volume_;
  std::vector<glm::vec4> nodes_;
  std::vector<glm::vec3> position_m_;  // (vertex_count x strand_count) head space
  std::vector<double> groom_density_;
  double groom_volume_m3_ = 0.0;
  Pose still_ = head_at(0.0);
  uint64_t tick_ = 0;
};

}  // namespace strandcast
