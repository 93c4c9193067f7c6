// MadeStates: states of a few strands that hang from a ring and swing, for tests of exports.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/export/export_source.h"
#include "common/math/pose.h"
#include "common/strands/snapshot.h"

namespace strandcast::export_test {

inline constexpr uint32_t kStrands = 7, kVertices = 5;
inline constexpr float kQuantumM = 1e-5f;
inline constexpr int64_t kStepNs = 16'666'667;

/// Hair that hangs from a ring and swings as cubics of time do, on a head that walks and turns.
inline glm::vec3 place_of(uint32_t strand, uint32_t vertex, double t_s) {
  const double angle = 0.9 * strand, down = 0.05 * vertex;
  const double swing = vertex * (0.01 * t_s + 0.02 * t_s * t_s - 0.015 * t_s * t_s * t_s);
  return {0.1 * std::cos(angle) + swing, 0.1 - down, 0.1 * std::sin(angle) - 0.5 * swing};
}
inline Pose pose_of(double t_s) {
  return {{0.3 * t_s, 1.6, -0.2 * t_s}, glm::angleAxis(0.4 * t_s, glm::dvec3(0, 1, 0))};
}
inline std::vector<glm::vec3> positions_at(double t_s) {
  std::vector<glm::vec3> positions;
  for (uint32_t vertex = 0; vertex < kVertices; ++vertex)
    for (uint32_t strand = 0; strand < kStrands; ++strand) positions.push_back(place_of(strand, vertex, t_s));
  return positions;
}
inline std::shared_ptr<const Snapshot> state_at(int64_t sim_time_ns,
                                                const std::vector<glm::vec3>& positions) {
  QuantiseInput input;
  input.sim_time_ns = sim_time_ns;
  input.world_from_head = pose_of(static_cast<double>(sim_time_ns) * 1e-9);
  input.strand_count = kStrands;
  input.vertex_count = kVertices;
  input.quantum_m = kQuantumM;
  input.position_in_head_m = positions;
  return std::make_shared<Snapshot>(quantise(input).snapshot);
}
inline std::shared_ptr<const Snapshot> state_at(int64_t sim_time_ns) {
  return state_at(sim_time_ns, positions_at(static_cast<double>(sim_time_ns) * 1e-9));
}

class MadeStates : public ExportSource {
 public:
  explicit MadeStates(size_t count) {
    SceneAsset asset;
    asset.strand_count = kStrands;
    asset.vertex_count = kVertices;
    asset.rest_position_m = positions_at(0.0);
    scene_ = {std::make_shared<const SceneAsset>(asset), 0.0002f, 0.25f};
    for (size_t i = 0; i < count; ++i) states_.push_back(state_at(static_cast<int64_t>(i) * kStepNs));
  }
  const ExportScene& scene() const override { return scene_; }
  Result<std::shared_ptr<const Snapshot>> next() override {
    if (next_ == stop_at_) stop_ = true;
    if (next_ < states_.size()) return states_[next_++];
    if (end_) return *end_;
    return std::shared_ptr<const Snapshot>();
  }
  std::vector<std::string> remarks() const override { return {"the source says so"}; }
  Result<std::optional<int64_t>> skip_to(double) override {
    return counted_ ? std::optional(states_.front()->sim_time_ns) : std::nullopt;
  }
  std::optional<CountedState> counted() const override { return counted_; }
  const TimecodeTrack& timecodes() const override { return timecodes_; }

  ExportScene scene_;
  TimecodeTrack timecodes_;
  std::optional<CountedState> counted_;  // as of a running server
  std::vector<std::shared_ptr<const Snapshot>> states_;
  std::optional<Error> end_;
  size_t stop_at_ = ~size_t{0};  // whoever exports is stopped with this state
  std::atomic<bool> stop_{false};
  size_t next_ = 0;
};

}  // namespace strandcast::export_test
