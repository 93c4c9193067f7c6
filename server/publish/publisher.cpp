#include "server/publish/publisher.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <utility>

#include "common/base/check.h"
#include "common/strands/snapshot.h"

namespace strandcast {
namespace {

bool is_usable_velocity(const glm::vec3& velocity) {
  return std::isfinite(velocity.x) && std::isfinite(velocity.y) && std::isfinite(velocity.z);
}

constexpr int64_t kNotOverstretched = std::numeric_limits<int64_t>::min();
// What float positions a metre from the head leave of a segment without length.
constexpr double kSegmentRoundingM = 1e-5;

// Vertices that a worker takes at a time: a tenth of a millisecond. Fewer are not worth waking one.
constexpr uint32_t kVerticesPerRange = 32'768;
// Snapshots whose memory is kept: one is being encoded, drawn or looked at while the next is made.
constexpr size_t kKeptSnapshots = 4;

float squared(double value) {
  return static_cast<float>(value * value);
}

}  // namespace

/// Snapshots that nobody has any more.
struct Publisher::SnapshotMemory {
  std::mutex mutex;
  std::vector<std::unique_ptr<Snapshot>> free;
};

double overstretch_limit(double stretch_bound) {
  return std::max(kLeastOverstretch, kOverstretchPerBound * stretch_bound);
}

Publisher::Publisher(const Groom& groom, float quantum_m, const PublishMeans& means)
    : strand_count_(groom.strand_count()),
      vertex_count_(groom.uniform_vertex_count()),
      quantum_m_(quantum_m),
      means_(means),
      memory_(std::make_shared<SnapshotMemory>()) {
  CHECK(strand_count_ > 0 && vertex_count_ > 0);
  rest_position_m_.resize(static_cast<size_t>(strand_count_) * vertex_count_);
  findings_.resize(block_count(strand_count_));
  quarantined_.reserve(strand_count_);
  for (uint32_t strand = 0; strand < strand_count_; ++strand)
    for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex)
      rest_position_m_[static_cast<size_t>(vertex) * strand_count_ + strand] =
          groom.rest_position_m[groom.offset[strand] + vertex];
}

void Publisher::watch_stretch(double stretch_bound) {
  const double limit = overstretch_limit(stretch_bound);
  const double runaway = std::max(kRunawayStretch, limit);
  const size_t size = size_t{block_count(strand_count_)} * kBlockStrands * vertex_count_;
  longest_squared_m2_.assign(size, 0.0f);
  runaway_squared_m2_.assign(size, 0.0f);
  overstretched_since_ns_.assign(strand_count_, kNotOverstretched);
  overstretched_now_ = 0;
  // Beyond the last strand of the last block are copies of it.
  for (uint32_t place = 0; place < block_count(strand_count_) * kBlockStrands; ++place) {
    const uint32_t strand = std::min(place, strand_count_ - 1);
    const auto segment_m = [&](uint32_t vertex) {
      const size_t i = static_cast<size_t>(vertex) * strand_count_ + strand;
      return glm::distance(glm::dvec3(rest_position_m_[i]), glm::dvec3(rest_position_m_[i - strand_count_]));
    };
    double total_m = 0.0;
    for (uint32_t vertex = 1; vertex < vertex_count_; ++vertex) total_m += segment_m(vertex);
    for (uint32_t vertex = 1; vertex < vertex_count_; ++vertex) {
      const double unit_m = std::max(segment_m(vertex), total_m / (vertex_count_ - 1));
      const size_t i = place_in_blocks(place, vertex);
      longest_squared_m2_[i] = squared(segment_m(vertex) + limit * unit_m + kSegmentRoundingM);
      runaway_squared_m2_[i] = squared(segment_m(vertex) + runaway * unit_m + kSegmentRoundingM);
    }
  }
}

/// Of one number per vertex, in blocks.
size_t Publisher::place_in_blocks(uint32_t strand_index, uint32_t vertex) const {
  const uint32_t block = strand_index / kBlockStrands;
  return (size_t{block} * vertex_count_ + vertex) * kBlockStrands + strand_index % kBlockStrands;
}

void Publisher::read(const SolverBlocks& state) {
  blocks_ = state;
  for (const StrandBlocksView& blocks : {blocks_.position_m, blocks_.velocity_mps})
    CHECK(blocks.strand_count == strand_count_ && blocks.row_count == vertex_count_);
}

std::shared_ptr<const Snapshot> Publisher::quantise(const PublishInput& input) {
  CHECK(blocks_.position_m.values != nullptr && quantum_m_ > 0.0f);
  world_from_head_rotation_ = glm::mat3_cast(input.world_from_head.rotation);
  head_velocity_mps_ = glm::vec3(input.head_velocity_mps);
  if (!is_usable_velocity(head_velocity_mps_)) head_velocity_mps_ = glm::vec3(0.0f);
  std::unique_ptr<Snapshot> snapshot = take_snapshot();
  snapshot->tick = input.tick;
  snapshot->sim_time_ns = input.sim_time_ns;
  snapshot->motion_time_ns = input.motion_time_ns;
  snapshot->world_from_head = input.world_from_head;
  snapshot->bust = input.bust;
  snapshot->strand_count = strand_count_;
  snapshot->vertex_count = vertex_count_;
  snapshot->quantum_m = quantum_m_;
  snapshot->trail = input.trail;
  snapshot->timecode = input.timecode;
  snapshot->lattice.resize(3 * rest_position_m_.size());

  const glm::dmat3 head_from_world = glm::transpose(world_from_head_rotation_);
  walk_blocks(head_from_world, *snapshot);
  find_broken_strands();
  if (!longest_squared_m2_.empty()) find_overstretched_strands(input.sim_time_ns);
  for (const uint32_t strand : quarantined_) show_at_rest(strand, head_from_world, *snapshot);
  return {snapshot.release(), [memory = memory_](Snapshot* done) { give_back(*memory, done); }};
}

std::unique_ptr<Snapshot> Publisher::take_snapshot() {
  const std::lock_guard lock(memory_->mutex);
  if (memory_->free.empty()) return std::make_unique<Snapshot>();
  std::unique_ptr<Snapshot> snapshot = std::move(memory_->free.back());
  memory_->free.pop_back();
  return snapshot;
}

void Publisher::give_back(SnapshotMemory& memory, Snapshot* snapshot) {
  std::unique_ptr<Snapshot> done(snapshot);
  const std::lock_guard lock(memory.mutex);
  if (memory.free.size() < kKeptSnapshots) memory.free.push_back(std::move(done));
}

/// Fills the lattice and findings_.
void Publisher::walk_blocks(const glm::dmat3& head_from_world, Snapshot& snapshot) {
  BlockQuantise work;
  work.position_m = blocks_.position_m;
  work.velocity_mps = blocks_.velocity_mps;
  work.reach_m = kMaxStrandReachM;
  work.longest_squared_m2 = longest_squared_m2_.empty() ? nullptr : longest_squared_m2_.data();
  // In double, so that the one rounding to float is all that is added to the announced bound.
  for (int column = 0; column < 3; ++column)
    for (int axis = 0; axis < 3; ++axis) work.head_from_world[column][axis] = head_from_world[column][axis];
  work.quantum_m = quantum_m_;
  work.findings = findings_.data();
  work.lattice = snapshot.lattice.data();
  const size_t grain = std::max(1u, kVerticesPerRange / (kBlockStrands * vertex_count_));
  means_.workers->at(Priority::Simulation).for_ranges(findings_.size(), grain, [&](size_t begin, size_t end) {
    quantise_blocks(means_.set, {&work, static_cast<uint32_t>(begin), static_cast<uint32_t>(end)});
  });
}

void Publisher::find_broken_strands() {
  quarantined_.clear();
  for (uint32_t block = 0; block < findings_.size(); ++block) {
    if (!findings_[block].has_bad) continue;
    const uint32_t first = block * kBlockStrands;
    for (uint32_t strand = first; strand < std::min(first + kBlockStrands, strand_count_); ++strand) {
      const auto bad_vertices = static_cast<uint64_t>(findings_[block].bad_vertices[strand - first]);
      if (bad_vertices == 0) continue;
      bad_vertex_count_ += bad_vertices;
      quarantined_.push_back(strand);
    }
  }
  quarantine_count_ += quarantined_.size();
}

void Publisher::find_overstretched_strands(int64_t sim_time_ns) {
  const size_t broken_count = quarantined_.size();
  for (uint32_t block = 0; block < findings_.size(); ++block) {
    if (!findings_[block].has_stretched && overstretched_now_ == 0) continue;
    const uint32_t first = block * kBlockStrands;
    for (uint32_t strand = first; strand < std::min(first + kBlockStrands, strand_count_); ++strand) {
      int64_t& since_ns = overstretched_since_ns_[strand];
      const auto set_since = [&](int64_t time_ns) {
        overstretched_now_ -= since_ns != kNotOverstretched ? 1 : 0;
        since_ns = time_ns;
        overstretched_now_ += since_ns != kNotOverstretched ? 1 : 0;
      };
      const bool is_stretched = findings_[block].stretched_segments[strand - first] > 0 &&
                                has_segment_beyond(longest_squared_m2_, strand);
      if (!is_stretched) {
        set_since(kNotOverstretched);
        continue;
      }
      // A clock that was set back starts the wait again.
      if (since_ns == kNotOverstretched || since_ns > sim_time_ns) set_since(sim_time_ns);
      const bool is_lasting = sim_time_ns - since_ns >= kOverstretchPatienceNs;
      if (!is_lasting && !has_segment_beyond(runaway_squared_m2_, strand)) continue;
      set_since(kNotOverstretched);
      if (!std::binary_search(quarantined_.begin(),
                              quarantined_.begin() + static_cast<ptrdiff_t>(broken_count), strand))
        quarantined_.push_back(strand);
    }
  }
  overstretch_count_ += quarantined_.size() - broken_count;
  std::sort(quarantined_.begin(), quarantined_.end());
}

bool Publisher::has_segment_beyond(std::span<const float> squared_m2, uint32_t strand_index) const {
  const auto point_m = [&](uint32_t vertex) {
    const float* const row =
        blocks_.position_m.row(strand_index / kBlockStrands, vertex, 0) + strand_index % kBlockStrands;
    return glm::vec3(row[0], row[kBlockStrands], row[2 * kBlockStrands]);
  };
  for (uint32_t vertex = 1; vertex < vertex_count_; ++vertex) {
    const glm::vec3 edge_m = point_m(vertex) - point_m(vertex - 1);
    if (glm::dot(edge_m, edge_m) > squared_m2[place_in_blocks(strand_index, vertex)]) return true;
  }
  return false;
}

glm::vec3 Publisher::rest_in_world_m(size_t i) const {
  return glm::vec3(world_from_head_rotation_ * glm::dvec3(rest_position_m_[i]));
}

/// As if the solver's copy had been at rest already.
void Publisher::show_at_rest(uint32_t strand_index, const glm::dmat3& head_from_world,
                             Snapshot& snapshot) const {
  std::vector<glm::vec3> in_head_m;
  std::vector<glm::vec3> fallback_m;
  for (size_t i = strand_index; i < rest_position_m_.size(); i += strand_count_) {
    in_head_m.emplace_back(head_from_world * glm::dvec3(rest_in_world_m(i)));
    fallback_m.push_back(rest_position_m_[i]);
  }
  QuantiseInput one;
  one.strand_count = 1;
  one.vertex_count = vertex_count_;
  one.quantum_m = quantum_m_;
  one.position_in_head_m = in_head_m;
  one.fallback_m = fallback_m;
  const std::vector<int32_t> lattice = strandcast::quantise(one).snapshot.lattice;
  for (size_t k = 0; k < lattice.size(); ++k) snapshot.lattice[k * strand_count_ + strand_index] = lattice[k];
}

void Publisher::repair(Solver& solver) {
  SolverState state;
  solver.read(state);
  for (const uint32_t strand : quarantined_)
    for (size_t i = strand; i < rest_position_m_.size(); i += strand_count_) {
      state.position_m[i] = rest_in_world_m(i);
      state.velocity_mps[i] = head_velocity_mps_;
    }
  solver.write(state);
}

namespace {

using simd::Float;
using simd::FloatBits;
using simd::IntBits;
using simd::kLanes;
using DoubleBits = double __attribute__((vector_size(8 * kLanes)));

static_assert(kBlockStrands % kLanes == 0);

STRANDCAST_LANES DoubleBits widened(const Float& x) {
  return __builtin_convertvector(x.v, DoubleBits);
}

STRANDCAST_LANES simd::vec3 load_vertex(const StrandBlocksView& blocks, uint32_t block, uint32_t vertex,
                                        uint32_t first_lane) {
  const float* const row = blocks.row(block, vertex, 0) + first_lane;
  return {simd::load_lanes(row), simd::load_lanes(row + kBlockStrands),
          simd::load_lanes(row + 2 * kBlockStrands)};
}

/// Negative where |x| is more than `most`, or x no number. As integers, since floats order alike and the
/// older instruction sets compare eight of them one by one.
STRANDCAST_LANES IntBits less_size(const Float& most, const Float& x) {
  return (IntBits)most.v - (IntBits)simd::abs(x).v;
}
STRANDCAST_LANES IntBits less_sizes(const Float& most, const simd::vec3& v) {
  return less_size(most, v.x) | less_size(most, v.y) | less_size(most, v.z);
}
/// -1 where negative, else 0.
STRANDCAST_LANES IntBits is_negative(const IntBits& x) {
  return x >> 31;
}

/// std::lrint of values within +-2^51: the sum has no digits behind the point.
STRANDCAST_LANES IntBits to_nearest(DoubleBits x) {
  constexpr double kWithoutFractions = 0x1.8p52;
  return __builtin_convertvector((x + kWithoutFractions) - kWithoutFractions, IntBits);
}

constexpr double kLimit = kMaxLattice - 1;

/// Whether positions beyond the last lattice value are brought back to it.
enum class Limits { None, Kept };

STRANDCAST_LANES IntBits lattice_value(const FloatBits& in_head_m, double steps_per_m, Limits limits) {
  DoubleBits steps = __builtin_convertvector(in_head_m, DoubleBits) * steps_per_m;
  if (limits == Limits::Kept) {
    steps = steps < -kLimit ? DoubleBits{} - kLimit : steps;
    steps = steps > kLimit ? DoubleBits{} + kLimit : steps;
  }
  return to_nearest(steps);
}

/// Nothing within it is beyond the last lattice value.
float lattice_reach_m(double steps_per_m) {
  return std::nextafter(static_cast<float>(kLimit / steps_per_m), 0.0f);
}

STRANDCAST_LANES void store_strands(const IntBits& values, uint32_t count, int32_t* to) {
  if (count == kLanes)
    std::memcpy(to, &values, sizeof values);
  else
    std::memcpy(to, &values, count * sizeof(int32_t));
}

/// Eight strands, those from `first_lane` of the block on. Whether one of them reaches beyond the lattice.
STRANDCAST_LANES bool quantise_part(const BlockQuantise& work, uint32_t block, uint32_t first_lane,
                                    Limits limits) {
  const uint32_t strand_count = work.position_m.strand_count;
  const uint32_t vertex_count = work.position_m.row_count;
  const uint32_t strand = block * kBlockStrands + first_lane;
  const uint32_t stored = strand < strand_count ? std::min(strand_count - strand, kLanes) : 0;
  const size_t plane_size = size_t{strand_count} * vertex_count;
  const auto turn =
      work.head_from_world;  // a copy: as far as the compiler knows, what is stored might be this
  const double steps_per_m = 1.0 / static_cast<double>(work.quantum_m);
  const Float lattice_m = lattice_reach_m(steps_per_m);
  const Float reach_m = work.reach_m;
  const Float finite = std::numeric_limits<float>::max();
  IntBits bad = {};
  IntBits stretched = {};
  IntBits far = {};
  simd::vec3 before = load_vertex(work.position_m, block, 0, first_lane);
  for (uint32_t vertex = 0; vertex < vertex_count; ++vertex) {
    const simd::vec3 point = load_vertex(work.position_m, block, vertex, first_lane);
    const simd::vec3 velocity = load_vertex(work.velocity_mps, block, vertex, first_lane);
    bad -= is_negative(less_sizes(reach_m, point) | less_sizes(finite, velocity));
    if (work.longest_squared_m2 != nullptr) {
      const simd::vec3 edge = point - before;
      const Float squared = (edge.x * edge.x + edge.y * edge.y) + edge.z * edge.z;
      const size_t row = (size_t{block} * vertex_count + vertex) * kBlockStrands;
      const Float longest = simd::load_lanes(work.longest_squared_m2 + row + first_lane);
      stretched -= is_negative(less_size(longest, squared));
      before = point;
    }
    const DoubleBits x = widened(point.x);
    const DoubleBits y = widened(point.y);
    const DoubleBits z = widened(point.z);
    int32_t* const to = work.lattice + size_t{vertex} * strand_count + strand;
    for (size_t axis = 0; axis < 3; ++axis) {
      const DoubleBits turned = turn[0][axis] * x + turn[1][axis] * y + turn[2][axis] * z;
      // Positions are floats in the whole program: this is the one rounding that the bound allows for.
      const FloatBits in_head_m = __builtin_convertvector(turned, FloatBits);
      far |= less_size(lattice_m, in_head_m);
      store_strands(lattice_value(in_head_m, steps_per_m, limits), stored, to + axis * plane_size);
    }
  }
  BlockFindings& findings = work.findings[block];
  std::memcpy(findings.bad_vertices.data() + first_lane, &bad, sizeof bad);
  std::memcpy(findings.stretched_segments.data() + first_lane, &stretched, sizeof stretched);
  findings.has_bad |= simd::is_any({bad});
  findings.has_stretched |= simd::is_any({stretched});
  return simd::is_any({is_negative(far)});
}

STRANDCAST_LANES void quantise_blocks_lanes(const BlockRange& range) {
  for (uint32_t block = range.begin; block < range.end; ++block) {
    BlockFindings& findings = range.work->findings[block];
    findings.has_bad = findings.has_stretched = false;
    for (uint32_t lane = 0; lane < kBlockStrands; lane += kLanes)
      if (quantise_part(*range.work, block, lane, Limits::None))
        quantise_part(*range.work, block, lane, Limits::Kept);
  }
}

}  // namespace

STRANDCAST_KERNEL(quantise_blocks, BlockRange);

}  // namespace strandcast
