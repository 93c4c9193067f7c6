#include "server/publish/publisher.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"

namespace strandcast {
namespace {

// Comparisons with a NaN are false, so this also refuses what is not finite.
bool is_usable_position(const glm::vec3& point) {
  return std::abs(point.x) <= kMaxStrandReachM && std::abs(point.y) <= kMaxStrandReachM &&
         std::abs(point.z) <= kMaxStrandReachM;
}

bool is_usable_velocity(const glm::vec3& velocity) {
  return std::isfinite(velocity.x) && std::isfinite(velocity.y) && std::isfinite(velocity.z);
}

constexpr int64_t kNotOverstretched = std::numeric_limits<int64_t>::min();
// What float positions a metre from the head leave of a segment without length.
constexpr double kSegmentRoundingM = 1e-5;

float squared(double value) {
  return static_cast<float>(value * value);
}

}  // namespace

double overstretch_limit(double stretch_bound) {
  return std::max(kLeastOverstretch, kOverstretchPerBound * stretch_bound);
}

Publisher::Publisher(const Groom& groom, float quantum_m)
    : strand_count_(groom.strand_count()),
      vertex_count_(groom.uniform_vertex_count()),
      quantum_m_(quantum_m) {
  CHECK(strand_count_ > 0 && vertex_count_ > 0);
  const size_t plane_size = static_cast<size_t>(strand_count_) * vertex_count_;
  rest_position_m_.resize(plane_size);
  position_in_head_m_.resize(plane_size);
  is_broken_.resize(strand_count_);
  quarantined_.reserve(strand_count_);
  for (uint32_t strand = 0; strand < strand_count_; ++strand)
    for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex)
      rest_position_m_[static_cast<size_t>(vertex) * strand_count_ + strand] =
          groom.rest_position_m[groom.offset[strand] + vertex];
}

void Publisher::watch_stretch(double stretch_bound) {
  const double limit = overstretch_limit(stretch_bound);
  const double runaway = std::max(kRunawayStretch, limit);
  longest_squared_m2_.assign(rest_position_m_.size(), 0.0f);
  runaway_squared_m2_.assign(rest_position_m_.size(), 0.0f);
  stretch_grade_.assign(strand_count_, 0);
  overstretched_since_ns_.assign(strand_count_, kNotOverstretched);
  std::vector<double> total_m(strand_count_, 0.0);
  const auto segment_m = [this](size_t i) {
    return glm::distance(glm::dvec3(rest_position_m_[i]), glm::dvec3(rest_position_m_[i - strand_count_]));
  };
  for (size_t i = strand_count_; i < rest_position_m_.size(); ++i) total_m[i % strand_count_] += segment_m(i);
  for (size_t i = strand_count_; i < rest_position_m_.size(); ++i) {
    const double unit_m = std::max(segment_m(i), total_m[i % strand_count_] / (vertex_count_ - 1));
    longest_squared_m2_[i] = squared(segment_m(i) + limit * unit_m + kSegmentRoundingM);
    runaway_squared_m2_[i] = squared(segment_m(i) + runaway * unit_m + kSegmentRoundingM);
  }
}

void Publisher::read(Solver& solver) {
  solver.read(state_);
  CHECK(state_.position_m.size() == rest_position_m_.size());
  CHECK(state_.velocity_mps.size() == rest_position_m_.size());
}

std::shared_ptr<const Snapshot> Publisher::quantise(const PublishInput& input) {
  find_broken_strands();
  if (!longest_squared_m2_.empty()) find_overstretched_strands(input.sim_time_ns);
  for (const uint32_t strand : quarantined_) put_to_rest(strand, input);

  // In double, so that the one rounding to float is all that is added to the announced bound.
  const glm::dmat3 head_from_world = glm::transpose(glm::mat3_cast(input.world_from_head.rotation));
  for (size_t i = 0; i < position_in_head_m_.size(); ++i)
    position_in_head_m_[i] = glm::vec3(head_from_world * glm::dvec3(state_.position_m[i]));

  QuantiseInput quantise_input;
  quantise_input.tick = input.tick;
  quantise_input.sim_time_ns = input.sim_time_ns;
  quantise_input.motion_time_ns = input.motion_time_ns;
  quantise_input.world_from_head = input.world_from_head;
  quantise_input.strand_count = strand_count_;
  quantise_input.vertex_count = vertex_count_;
  quantise_input.quantum_m = quantum_m_;
  quantise_input.position_in_head_m = position_in_head_m_;
  quantise_input.fallback_m = rest_position_m_;
  return std::make_shared<const Snapshot>(strandcast::quantise(quantise_input).snapshot);
}

void Publisher::find_broken_strands() {
  uint64_t bad_vertices = 0;
  const size_t plane_size = rest_position_m_.size();
  for (size_t i = 0; i < plane_size; ++i)
    bad_vertices +=
        is_usable_position(state_.position_m[i]) && is_usable_velocity(state_.velocity_mps[i]) ? 0 : 1;
  quarantined_.clear();
  if (bad_vertices == 0) return;

  std::fill(is_broken_.begin(), is_broken_.end(), uint8_t{0});
  for (size_t i = 0; i < plane_size; ++i)
    if (!is_usable_position(state_.position_m[i]) || !is_usable_velocity(state_.velocity_mps[i]))
      is_broken_[i % strand_count_] = 1;
  for (uint32_t strand = 0; strand < strand_count_; ++strand)
    if (is_broken_[strand] != 0) quarantined_.push_back(strand);
  bad_vertex_count_ += bad_vertices;
  quarantine_count_ += quarantined_.size();
}

void Publisher::find_overstretched_strands(int64_t sim_time_ns) {
  // 0 = within the limit, 1 = beyond it, 2 = run away. A broken strand's comparisons are false or say run
  // away; it is on the list already.
  std::fill(stretch_grade_.begin(), stretch_grade_.end(), uint8_t{0});
  for (uint32_t vertex = 1; vertex < vertex_count_; ++vertex) {
    const size_t row = static_cast<size_t>(vertex) * strand_count_;
    for (uint32_t strand = 0; strand < strand_count_; ++strand) {
      const glm::vec3 edge =
          state_.position_m[row + strand] - state_.position_m[row + strand - strand_count_];
      const float length_squared = glm::dot(edge, edge);
      const int grade = (length_squared > longest_squared_m2_[row + strand] ? 1 : 0) +
                        (length_squared > runaway_squared_m2_[row + strand] ? 1 : 0);
      stretch_grade_[strand] = std::max(stretch_grade_[strand], static_cast<uint8_t>(grade));
    }
  }
  const size_t broken_count = quarantined_.size();
  for (uint32_t strand = 0; strand < strand_count_; ++strand) {
    int64_t& since_ns = overstretched_since_ns_[strand];
    if (stretch_grade_[strand] == 0) {
      since_ns = kNotOverstretched;
      continue;
    }
    // A clock that was set back starts the wait again.
    if (since_ns == kNotOverstretched || since_ns > sim_time_ns) since_ns = sim_time_ns;
    const bool is_lasting = sim_time_ns - since_ns >= kOverstretchPatienceNs;
    if (!is_lasting && stretch_grade_[strand] < 2) continue;
    since_ns = kNotOverstretched;
    if (!std::binary_search(quarantined_.begin(), quarantined_.begin() + static_cast<ptrdiff_t>(broken_count),
                            strand))
      quarantined_.push_back(strand);
  }
  overstretch_count_ += quarantined_.size() - broken_count;
  std::sort(quarantined_.begin(), quarantined_.end());
}

void Publisher::put_to_rest(uint32_t strand_index, const PublishInput& input) {
  const glm::dmat3 world_from_head_rotation = glm::mat3_cast(input.world_from_head.rotation);
  const glm::vec3 head_velocity_mps(input.head_velocity_mps);
  for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex) {
    const size_t i = static_cast<size_t>(vertex) * strand_count_ + strand_index;
    state_.position_m[i] = glm::vec3(world_from_head_rotation * glm::dvec3(rest_position_m_[i]));
    state_.velocity_mps[i] = is_usable_velocity(head_velocity_mps) ? head_velocity_mps : glm::vec3(0.0f);
  }
}

void Publisher::repair(Solver& solver) {
  solver.write(state_);
}

}  // namespace strandcast
