// PlainPublisher: what a Publisher shows, vertex by vertex in plain loops over glm's vectors: the law that
// the walk over blocks is held to, bit for bit.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/publish/publisher.h"

namespace strandcast {

struct PlainPublished {
  Snapshot snapshot;
  std::vector<uint32_t> quarantined;
  uint64_t bad_vertices = 0;
  uint64_t broken = 0;
};

class PlainPublisher {
 public:
  PlainPublisher(const Groom& groom, float quantum_m)
      : strand_count_(groom.strand_count()),
        vertex_count_(groom.uniform_vertex_count()),
        quantum_m_(quantum_m) {
    for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex)
      for (uint32_t strand = 0; strand < strand_count_; ++strand)
        rest_m_.push_back(groom.rest_position_m[groom.offset[strand] + vertex]);
  }
  void watch_stretch(double stretch_bound) {
    limit_ = overstretch_limit(stretch_bound);
    since_ns_.assign(strand_count_, -1);
  }

  PlainPublished publish(SolverState state, const PublishInput& input) {
    PlainPublished out;
    std::vector<uint32_t> overstretched;
    for (uint32_t strand = 0; strand < strand_count_; ++strand) {
      const uint64_t bad = bad_vertices(state, strand);
      out.bad_vertices += bad;
      out.broken += bad > 0 ? 1 : 0;
      const bool is_away = limit_ > 0.0 && has_stretched_away(state, strand, input.sim_time_ns);
      if (bad > 0 || is_away) out.quarantined.push_back(strand);
    }
    const glm::dmat3 world_from_head = glm::mat3_cast(input.world_from_head.rotation);
    for (const uint32_t strand : out.quarantined)
      for (size_t i = strand; i < rest_m_.size(); i += strand_count_)
        state.position_m[i] = glm::vec3(world_from_head * glm::dvec3(rest_m_[i]));
    in_head_m_.resize(rest_m_.size());
    const glm::dmat3 head_from_world = glm::transpose(world_from_head);
    for (size_t i = 0; i < rest_m_.size(); ++i)
      in_head_m_[i] = glm::vec3(head_from_world * glm::dvec3(state.position_m[i]));
    QuantiseInput quantised;
    quantised.tick = input.tick;
    quantised.sim_time_ns = input.sim_time_ns;
    quantised.motion_time_ns = input.motion_time_ns;
    quantised.world_from_head = input.world_from_head;
    quantised.strand_count = strand_count_;
    quantised.vertex_count = vertex_count_;
    quantised.quantum_m = quantum_m_;
    quantised.position_in_head_m = in_head_m_;
    quantised.fallback_m = rest_m_;
    out.snapshot = quantise(quantised).snapshot;
    return out;
  }

 private:
  uint64_t bad_vertices(const SolverState& state, uint32_t strand) const {
    uint64_t count = 0;
    for (size_t i = strand; i < rest_m_.size(); i += strand_count_) {
      bool is_usable = true;
      for (int axis = 0; axis < 3; ++axis)
        is_usable = is_usable && std::abs(state.position_m[i][axis]) <= kMaxStrandReachM &&
                    std::isfinite(state.velocity_mps[i][axis]);
      count += is_usable ? 0 : 1;
    }
    return count;
  }

  bool has_stretched_away(const SolverState& state, uint32_t strand, int64_t time_ns) {
    const double runaway = std::max(kRunawayStretch, limit_);
    double total_m = 0.0;
    for (size_t i = strand + strand_count_; i < rest_m_.size(); i += strand_count_)
      total_m += rest_segment_m(i);
    bool is_longer = false;
    bool is_away = false;
    for (size_t i = strand + strand_count_; i < rest_m_.size(); i += strand_count_) {
      const double unit_m = std::max(rest_segment_m(i), total_m / (vertex_count_ - 1));
      const auto most_squared = [&](double stretch) {
        const double most_m = rest_segment_m(i) + stretch * unit_m + 1e-5;  // what floats leave of no length
        return static_cast<float>(most_m * most_m);
      };
      const glm::vec3 edge_m = state.position_m[i] - state.position_m[i - strand_count_];
      is_longer = is_longer || glm::dot(edge_m, edge_m) > most_squared(limit_);
      is_away = is_away || glm::dot(edge_m, edge_m) > most_squared(runaway);
    }
    if (!is_longer) {
      since_ns_[strand] = -1;
      return false;
    }
    if (since_ns_[strand] < 0 || since_ns_[strand] > time_ns) since_ns_[strand] = time_ns;
    if (!is_away && time_ns - since_ns_[strand] < kOverstretchPatienceNs) return false;
    since_ns_[strand] = -1;
    return true;
  }

  double rest_segment_m(size_t i) const {
    return glm::distance(glm::dvec3(rest_m_[i]), glm::dvec3(rest_m_[i - strand_count_]));
  }

  uint32_t strand_count_;
  uint32_t vertex_count_;
  float quantum_m_;
  double limit_ = 0.0;                // 0: stretch is not watched
  std::vector<int64_t> since_ns_;     // -1: within the limit
  std::vector<glm::vec3> rest_m_;     // (vertex_count x strand_count) head space
  std::vector<glm::vec3> in_head_m_;  // same shape
};

}  // namespace strandcast
