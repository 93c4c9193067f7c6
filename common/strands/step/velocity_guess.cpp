#include "common/strands/step/velocity_guess.h"

#include <algorithm>
#include <cmath>

#include "common/simd/raw_lanes.h"
#include "common/strands/least_squares.h"
#include "common/strands/step/component.h"
#include "common/strands/step/lanes.h"

namespace strandcast::step {
namespace {

using namespace simd::raw;
using Ground = GuessedVelocities::Ground;
using Rows = GuessedVelocities::Rows;

constexpr float kWeight = 1.0f / 1024.0f;  // unit of the weights
constexpr float kBendPerS = 8.0f;  // velocity that a metre between edges counts as, for weights of one
constexpr float kMostMps = 1e6f;   // also of what is expected: weights may be anything
constexpr float kMostCarriedApartMps = 5e-4f;  // of pinned vertices
constexpr float kShortestSquared = 1e-14f;     // m^2

// Velocities are told on a body-centred cubic lattice, which reaches any point within 0.99 mm/s by the fewest
// of points: odd layers along the edge lie between the even ones.
constexpr float kSideMps = 1.0f / 565.0f;
constexpr float kLayerMps = 0.5f * kSideMps;

/// Within +-most, which is also for what is no number.
STRANDCAST_LANES Lanes within(const Lanes& value, float most) {
  const Lanes low = value > -most ? value : Lanes{} - most;
  return low < most ? low : Lanes{} + most;
}
STRANDCAST_LANES IntLanes whole_lanes(const Lanes& value) {
  constexpr float kRounder = 12582912.0f;  // 1.5 * 2^23: floats there are whole numbers
  return to_integers((within(value, kMostSteps) + kRounder) - kRounder);
}

STRANDCAST_LANES LaneVectors sum(const LaneVectors& a, const LaneVectors& b) {
  return {a.axis[0] + b.axis[0], a.axis[1] + b.axis[1], a.axis[2] + b.axis[2]};
}
STRANDCAST_LANES LaneVectors less(const LaneVectors& a, const LaneVectors& b) {
  return {a.axis[0] - b.axis[0], a.axis[1] - b.axis[1], a.axis[2] - b.axis[2]};
}
STRANDCAST_LANES LaneVectors times(const LaneVectors& a, float scale) {
  return {a.axis[0] * scale, a.axis[1] * scale, a.axis[2] * scale};
}
STRANDCAST_LANES LaneVectors chosen(const IntLanes& which, const LaneVectors& a, const LaneVectors& b) {
  return {which ? a.axis[0] : b.axis[0], which ? a.axis[1] : b.axis[1], which ? a.axis[2] : b.axis[2]};
}

STRANDCAST_LANES LaneVectors vectors_of(const IntLaneVectors& steps) {
  const Lanes shift = (steps.axis[2] & 1) != 0 ? Lanes{} + 0.5f : Lanes{};
  return {kSideMps * (to_floats(steps.axis[0]) + shift), kSideMps * (to_floats(steps.axis[1]) + shift),
          kLayerMps * to_floats(steps.axis[2])};
}

/// The nearest point of the lattice, in one of the two layers beside.
STRANDCAST_LANES IntLaneVectors nearest_steps(const LaneVectors& apart_mps) {
  const Lanes height = apart_mps.axis[2] * (1.0f / kLayerMps);
  const IntLanes layer = whole_lanes(height);
  const IntLanes other = layer + (height > to_floats(layer) ? IntLanes{} + 1 : IntLanes{} - 1);
  IntLaneVectors nearest{};
  Lanes least = Lanes{} + INFINITY;
  for (const IntLanes& tried : {layer, other}) {
    const Lanes shift = (tried & 1) != 0 ? Lanes{} + 0.5f : Lanes{};
    const IntLaneVectors steps = {whole_lanes(apart_mps.axis[0] * (1.0f / kSideMps) - shift),
                                  whole_lanes(apart_mps.axis[1] * (1.0f / kSideMps) - shift), tried};
    const LaneVectors away = less(apart_mps, vectors_of(steps));
    const Lanes squared = dots(away, away);
    const IntLanes is_nearer = squared < least;
    least = is_nearer ? squared : least;
    for (size_t i = 0; i < 3; ++i) nearest.axis[i] = is_nearer ? steps.axis[i] : nearest.axis[i];
  }
  return nearest;
}

/// Which weights: the first edges and the last one are unlike others.
uint32_t class_of(uint32_t v, uint32_t vertex_count) {
  if (v + 1 == vertex_count) return kGuessClassCount - 1;
  constexpr uint32_t kFirstEdges = 3;
  if (v <= kFirstEdges) return v < kFirstEdges ? 0 : 1;
  return 2 + 3 * v / vertex_count;
}

/// Parts of vectors along an edge and across it.
struct EdgeFrames {
  LaneVectors along{Lanes{}, Lanes{} + 1.0f, Lanes{}};
  LaneVectors first;
  LaneVectors second;

  /// Aims along a direction; where there is none, on along the last one.
  STRANDCAST_LANES void aim(const IntLanes& has, const LaneVectors& direction) {
    along = chosen(has, direction, along);
    const auto& [x, y, z] = along.axis;
    const Lanes sign = z >= 0.0f ? Lanes{} + 1.0f : Lanes{} - 1.0f;
    const Lanes p = -1.0f / (sign + z);
    const Lanes q = x * y * p;
    first = {1.0f + sign * (x * x * p), sign * q, -sign * x};
    second = {q, sign + y * y * p, -y};
  }
  /// Returns the parts across, and the one along as it is given.
  STRANDCAST_LANES LaneVectors parts_of(const LaneVectors& vector, const Lanes& part_along) const {
    return {dots(vector, first), dots(vector, second), part_along};
  }
  STRANDCAST_LANES LaneVectors sum_of(const LaneVectors& parts) const {
    LaneVectors vector;
    for (size_t i = 0; i < 3; ++i)
      vector.axis[i] =
          (parts.axis[0] * first.axis[i] + parts.axis[1] * second.axis[i]) + parts.axis[2] * along.axis[i];
    return vector;
  }
};

/// Eight vertices: the edges to them, and how velocities change there.
struct Joints {
  LaneVectors edge{};
  LaneVectors direction{};
  IntLanes has{};
  LaneVectors change{};
};
STRANDCAST_LANES Joints joints_at(const Rows& rows, size_t row, const uint32_t* places) {
  Joints joints;
  const Lanes per_length = gather_lanes(rows.per_length.data() + row, places);
  joints.has = per_length > 0.0f;
  for (size_t i = 0; i < 3; ++i) {
    joints.edge.axis[i] = gather_lanes(rows.edge[i].data() + row, places);
    joints.direction.axis[i] = joints.edge.axis[i] * per_length;
    joints.change.axis[i] = gather_lanes(rows.change[i].data() + row, places);
  }
  return joints;
}

/// A change of velocity after the smallest rotation that takes its edge to the direction of another one.
STRANDCAST_LANES LaneVectors turned(const Joints& from, const Joints& to) {
  constexpr float kLeastSum = 0.05f;  // of one and the cosine
  const LaneVectors both = sum(from.direction, to.direction);
  const Lanes one_and_cosine = 1.0f + dots(from.direction, to.direction);
  const IntLanes is_turned = from.has & to.has & (one_and_cosine > kLeastSum);
  const Lanes along_both = dots(from.change, both) / one_and_cosine;
  const Lanes along_from = 2.0f * dots(from.change, from.direction);
  LaneVectors result;
  for (size_t i = 0; i < 3; ++i) {
    const Lanes value = (from.change.axis[i] - along_both * both.axis[i]) + along_from * to.direction.axis[i];
    result.axis[i] = is_turned ? value : from.change.axis[i];
  }
  return result;
}

/// Goes along eight strands: what is expected of their velocities at a vertex follows from the features, of
/// the neighbours there and of the strand's own vertices before.
class Walk {
 public:
  using Features = std::array<LaneVectors, kGuessAcrossCount>;

  STRANDCAST_LANES Walk(const Ground& ground, const Rows& rows, size_t place)
      : ground_(ground), rows_(rows), place_(place) {
    for (uint32_t lane = 0; lane < kLaneCount; ++lane) own_[lane] = static_cast<uint32_t>(place) + lane;
    next_ = joints_at(rows_, 0, own_);
    for (size_t i = 0; i < 2; ++i) next_beside_[i] = joints_at(rows_, 0, beside(i));
  }
  /// Goes to the next vertex, at first to a root; changes there are those of store(), once it was called.
  STRANDCAST_LANES void go_on(uint32_t v) {
    for (size_t k = kBefore; k > 0; --k) joints_[k] = joints_[k - 1];
    joints_[0] = next_;
    for (size_t i = 0; i < 2; ++i) {
      for (size_t k = 2; k > 0; --k) beside_[i][k] = beside_[i][k - 1];
      beside_[i][0] = next_beside_[i];
    }
    has_next_ = v + 1 < ground_.vertex_count;
    if (!has_next_) return;
    const size_t row = size_t{v + 1} * ground_.layout.stride;
    next_ = joints_at(rows_, row, own_);
    for (size_t i = 0; i < 2; ++i) next_beside_[i] = joints_at(rows_, row, beside(i));
  }
  STRANDCAST_LANES void keep(const LaneVectors& change) { joints_[0].change = change; }
  STRANDCAST_LANES const Joints& here() const { return joints_[0]; }
  /// In the mean.
  STRANDCAST_LANES LaneVectors change_beside() const {
    return times(sum(beside_[0][0].change, beside_[1][0].change), 0.5f);
  }
  /// The head's part of the change.
  STRANDCAST_LANES LaneVectors carried(uint32_t v, const glm::vec3& head_mps) const {
    const auto block = static_cast<uint32_t>(place_ / kBlockStrands);
    LaneVectors way = joints_[0].edge;
    if (v == 0)
      for (uint32_t i = 0; i < 3; ++i)
        way.axis[i] = load_lanes(ground_.position.row(block, 0, i) + place_ % kBlockStrands);
    LaneVectors result;
    for (int i = 0; i < 3; ++i) {
      const auto& turn = ground_.turn_per_s;
      result.axis[i] = (turn[0][i] * way.axis[0] + turn[1][i] * way.axis[1]) + turn[2][i] * way.axis[2];
      if (v == 0) result.axis[i] = head_mps[i] + result.axis[i];
    }
    return result;
  }
  STRANDCAST_LANES Features features(uint32_t v) const {
    const Joints& own = joints_[0];
    Features value{};
    for (size_t i = 0; i < 2; ++i) {
      const auto& near = beside_[i];
      value[i] = turned(near[0], own);
      if (v >= 2) value[3 + i] = turned(near[1], own);
      if (v >= 3) value[6 + i] = turned(near[2], own);
      value[9 + i] = times(less(near[0].edge, own.edge), kBendPerS);
      if (has_next_) value[11 + i] = times(less(next_beside_[i].edge, next_.edge), kBendPerS);
    }
    if (v >= 2) value[2] = turned(joints_[1], own);
    if (v >= 3) value[5] = turned(joints_[2], own);
    if (v >= 4) value[8] = turned(joints_[3], own);
    if (v >= 2) value[13] = times(less(beside_[0][1].edge, joints_[1].edge), kBendPerS);
    return value;
  }

 private:
  static constexpr size_t kBefore = 3;

  STRANDCAST_LANES const uint32_t* beside(size_t i) const { return ground_.beside[i].data() + place_; }

  const Ground& ground_;
  const Rows& rows_;
  size_t place_;
  uint32_t own_[kLaneCount];
  bool has_next_ = false;
  std::array<Joints, kBefore + 1> joints_;  // here and at the vertices before
  Joints next_;
  std::array<std::array<Joints, kBefore>, 2> beside_;  // of the neighbours
  std::array<Joints, 2> next_beside_;
};

template <uint32_t kCount>
STRANDCAST_LANES LaneVectors weighted(const std::array<int16_t, kCount>& weights,
                                      const Walk::Features& features) {
  LaneVectors total{};
  for (uint32_t k = 0; k < kCount; ++k)
    total = sum(total, times(features[k], static_cast<float>(weights[k]) * kWeight));
  return total;
}

STRANDCAST_LANES LaneVectors load_vectors(const StrandBlocks& blocks, size_t place, uint32_t v) {
  const float* const row =
      blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, 0) + place % kBlockStrands;
  return {load_lanes(row), load_lanes(row + kBlockStrands), load_lanes(row + 2 * kBlockStrands)};
}
STRANDCAST_LANES void store_vectors(const LaneVectors& vectors, size_t place, uint32_t v,
                                    StrandBlocks& blocks) {
  float* const row = blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, 0) + place % kBlockStrands;
  for (size_t i = 0; i < 3; ++i) store_lanes(vectors.axis[i], row + i * kBlockStrands);
}
STRANDCAST_LANES void store_row(const LaneVectors& vectors, size_t at, tangent::Planes<float>& planes) {
  for (size_t i = 0; i < 3; ++i) store_lanes(vectors.axis[i], planes[i].data() + at);
}
STRANDCAST_LANES IntLanes is_strand(const Ground& ground, size_t place) {
  return load_lanes(ground.layout.presence.data() + place) > 0.5f;
}

struct EdgeWork {
  const Ground& ground;
  Rows& rows;
};
STRANDCAST_LANES void find_edges_lanes(const EdgeWork& of) {
  for (size_t place = 0; place < of.ground.layout.no_neighbour(); place += kLaneCount) {
    const IntLanes is_there = is_strand(of.ground, place);
    LaneVectors before = load_vectors(of.ground.position, place, 0);
    for (uint32_t v = 1; v < of.ground.vertex_count; ++v) {
      const LaneVectors here = load_vectors(of.ground.position, place, v);
      const LaneVectors edge = less(here, before);
      before = here;
      const Lanes squared = dots(edge, edge);
      const IntLanes has = is_there & (squared > kShortestSquared);
      const size_t at = size_t{v} * of.ground.layout.stride + place;
      store_row(chosen(is_there, edge, {}), at, of.rows.edge);
      store_lanes(has ? 1.0f / square_roots(has ? squared : Lanes{} + 1.0f) : Lanes{},
                  of.rows.per_length.data() + at);
    }
  }
}

struct GuessWork {
  const Ground& ground;
  const VelocityGuess& guess;
  Rows& rows;
  StrandBlocks& velocity;
  std::vector<int32_t>& steps;  // (places x vertex_count x 3)
};
/// Visits velocities beside what is expected of them; steps(at, is_there, apart_mps) gives whole numbers,
/// with the index of the first vertex's steps.
template <class Steps>
STRANDCAST_LANES void visit_velocities(const GuessWork& of, Steps steps) {
  const Ground& ground = of.ground;
  const uint32_t first = of.guess.are_roots_carried ? ground.pinned_root_count : 0;
  for (size_t place = 0; place < ground.layout.no_neighbour(); place += kLaneCount) {
    const IntLanes is_there = is_strand(ground, place);
    Walk walk(ground, of.rows, place);
    EdgeFrames frame;
    LaneVectors speed{};
    for (uint32_t v = 0; v < ground.vertex_count; ++v) {
      walk.go_on(v);
      speed = sum(speed, walk.carried(v, of.guess.head_mps));
      if (v > 0) frame.aim(walk.here().has, walk.here().direction);
      const LaneVectors velocity = load_vectors(of.velocity, place, v);
      LaneVectors change{};
      if (v >= first) {
        LaneVectors about = walk.change_beside();
        LaneVectors wanted = less(velocity, speed);
        if (v > 0) {
          const Walk::Features value = walk.features(v);
          const uint32_t which = class_of(v, ground.vertex_count);
          const LaneVectors along = weighted<kGuessAlongCount>(of.guess.along[which], value);
          about = frame.parts_of(weighted<kGuessAcrossCount>(of.guess.across[which], value),
                                 dots(along, frame.along));
          wanted = frame.parts_of(wanted, dots(wanted, frame.along));
        }
        for (Lanes& axis : about.axis) axis = within(axis, kMostMps);
        const size_t at = 3 * (place * ground.vertex_count + v);
        const LaneVectors parts = sum(about, vectors_of(steps(at, is_there, less(wanted, about))));
        change = v > 0 ? frame.sum_of(parts) : parts;
        change = chosen(is_there, change, {});
      }
      walk.keep(change);
      store_row(change, size_t{v} * ground.layout.stride + place, of.rows.change);
      speed = sum(speed, change);
      store_vectors(chosen(is_there, speed, velocity), place, v, of.velocity);
    }
  }
}
STRANDCAST_LANES void settle_velocities_lanes(const GuessWork& of) {
  int32_t* const to = of.steps.data();
  const size_t apart = 3 * size_t{of.ground.vertex_count};
  visit_velocities(
      of, [&](size_t at, const IntLanes& is_there, const LaneVectors& apart_mps) STRANDCAST_LANES_LAMBDA {
        const IntLaneVectors found = nearest_steps(apart_mps);
        for (uint32_t lane = 0; lane < kLaneCount; ++lane)
          for (size_t i = 0; i < 3; ++i) to[at + lane * apart + i] = is_there[lane] ? found.axis[i][lane] : 0;
        return found;
      });
}
STRANDCAST_LANES void place_velocities_lanes(const GuessWork& of) {
  const int32_t* const from = of.steps.data();
  const size_t apart = 3 * size_t{of.ground.vertex_count};
  visit_velocities(of, [&](size_t at, const IntLanes&, const LaneVectors&) STRANDCAST_LANES_LAMBDA {
    IntLaneVectors told;
    for (uint32_t lane = 0; lane < kLaneCount; ++lane)
      for (size_t i = 0; i < 3; ++i) told.axis[i][lane] = from[at + lane * apart + i];
    return told;
  });
}

using AcrossFits = std::array<LeastSquares<kGuessAcrossCount>, kGuessClassCount>;
using AlongFits = std::array<LeastSquares<kGuessAlongCount>, kGuessClassCount>;
struct FitWork {
  const Ground& ground;
  const VelocityGuess& guess;  // whose weights are to be found
  const StrandBlocks& velocity;
  Rows& rows;
  AcrossFits& across;
  AlongFits& along;
};
STRANDCAST_LANES void find_changes(const FitWork& of) {
  const uint32_t first = of.guess.are_roots_carried ? of.ground.pinned_root_count : 0;
  for (size_t place = 0; place < of.ground.layout.no_neighbour(); place += kLaneCount) {
    const IntLanes is_there = is_strand(of.ground, place);
    Walk walk(of.ground, of.rows, place);
    LaneVectors before{};
    for (uint32_t v = 0; v < of.ground.vertex_count; ++v) {
      walk.go_on(v);
      const LaneVectors here = load_vectors(of.velocity, place, v);
      const LaneVectors change = less(less(here, before), walk.carried(v, of.guess.head_mps));
      before = here;
      if (v < first) continue;
      store_row(chosen(is_there, change, {}), size_t{v} * of.ground.layout.stride + place, of.rows.change);
    }
  }
}
template <class Fit>
STRANDCAST_LANES void add_samples(const Walk::Features& value, const LaneVectors& change,
                                  const LaneVectors& axis, const Lanes& trust, Fit& fit) {
  simd::FloatBits* const sample = fit.room(0);
  for (uint32_t k = 0; k + 1 < Fit::kTerms; ++k) sample[k] = trust * dots(value[k], axis);
  sample[Fit::kTerms - 1] = trust * dots(change, axis);
  for (uint32_t lane = 0; lane < kLaneCount; ++lane) fit.count(trust[lane]);
  fit.add_eights(1);
}
/// Of places some are samples. A strand that moves unlike others must not decide: samples count by how well a
/// simpler guess tells them, that velocities go on along a strand as its neighbours' do.
STRANDCAST_LANES void add_velocities_lanes(const FitWork& of) {
  constexpr size_t kSampledBlocks = 4;
  constexpr std::array<float, 3> kGoOn = {1.55f, -1.0f, 0.28f};
  constexpr float kAcrossNoise = 1e-5f, kAlongNoise = 1e-6f;  // (m/s)^2
  find_changes(of);
  const Ground& ground = of.ground;
  const uint32_t first = std::max(of.guess.are_roots_carried ? ground.pinned_root_count : 0u, 1u);
  for (size_t place = 0; place < ground.layout.no_neighbour(); place += kSampledBlocks * kLaneCount) {
    const Lanes presence = is_strand(ground, place) ? Lanes{} + 1.0f : Lanes{};
    Walk walk(ground, of.rows, place);
    EdgeFrames frame;
    std::array<LaneVectors, 3> apart{};  // from the neighbours, of the vertices before, the last one first
    for (uint32_t v = 0; v < ground.vertex_count; ++v) {
      walk.go_on(v);
      if (v < first) continue;
      frame.aim(walk.here().has, walk.here().direction);
      const LaneVectors change = walk.here().change;
      const LaneVectors near = walk.change_beside();
      LaneVectors left = less(change, near);
      const LaneVectors beyond = left;
      for (size_t k = 0; k < apart.size(); ++k) left = less(left, times(apart[k], kGoOn[k]));
      apart = {beyond, apart[0], apart[1]};
      const LaneVectors parts = frame.parts_of(left, dots(left, frame.along));
      const Lanes across_squared = parts.axis[0] * parts.axis[0] + parts.axis[1] * parts.axis[1];
      const Lanes trust = presence / square_roots(kAcrossNoise + 0.5f * across_squared);
      const Walk::Features value = walk.features(v);
      const uint32_t which = class_of(v, ground.vertex_count);
      for (const LaneVectors* axis : {&frame.first, &frame.second})
        add_samples(value, change, *axis, trust, of.across[which]);
      add_samples(value, change, frame.along,
                  presence / square_roots(kAlongNoise + parts.axis[2] * parts.axis[2]), of.along[which]);
    }
  }
  for (auto& fit : of.across) fit.flush();
  for (auto& fit : of.along) fit.flush();
}

STRANDCAST_KERNEL(find_edges, EdgeWork);
STRANDCAST_KERNEL(settle_velocities, GuessWork);
STRANDCAST_KERNEL(place_velocities, GuessWork);
STRANDCAST_KERNEL(add_velocities, FitWork);

glm::vec3 head_part(const Ground& ground, size_t place, uint32_t v) {
  const auto& turn = ground.turn_per_s;
  glm::vec3 way = vector_at(ground.position, place, v);
  if (v > 0) way -= vector_at(ground.position, place, v - 1);
  return (turn[0] * way.x + turn[1] * way.y) + turn[2] * way.z;
}

}  // namespace

void VelocityGuess::write(std::vector<std::byte>& bytes) const {
  ByteWriter to(bytes);
  to.put(static_cast<uint8_t>(are_roots_carried));
  for (int axis = 0; axis < 3; ++axis) to.put(head_mps[axis]);
  for (const auto& weights : across) to.put_bytes(std::as_bytes(std::span(weights)));
  for (const auto& weights : along) to.put_bytes(std::as_bytes(std::span(weights)));
}

Result<VelocityGuess> VelocityGuess::read(ByteReader& bytes) {
  VelocityGuess guess;
  const auto flags = bytes.take<uint8_t>();
  guess.are_roots_carried = flags != 0;
  bool is_usable = flags <= 1;
  for (int axis = 0; axis < 3; ++axis) {
    guess.head_mps[axis] = bytes.take<float>();
    is_usable &= std::abs(guess.head_mps[axis]) <= kMostMps;
  }
  for (auto& weights : guess.across)
    for (int16_t& weight : weights) weight = bytes.take<int16_t>();
  for (auto& weights : guess.along)
    for (int16_t& weight : weights) weight = bytes.take<int16_t>();
  if (!bytes.ok() || !is_usable)
    return make_error(ErrorCode::BadInput, "what is expected of velocities is cut off or no numbers");
  return guess;
}

GuessedVelocities::GuessedVelocities(const Ground& ground) : ground_(ground) {
  const size_t size = ground_.layout.plane_size();
  for (auto& plane : rows_.edge) plane.assign(size, 0.0f);
  for (auto& plane : rows_.change) plane.assign(size, 0.0f);
  rows_.per_length.assign(size, 0.0f);
  find_edges(ground_.set, {ground_, rows_});
}

void GuessedVelocities::settle(const VelocityGuess& guess, StrandBlocks& velocity,
                               std::vector<int32_t>& steps) {
  std::fill(steps.begin(), steps.end(), 0);
  settle_velocities(ground_.set, {ground_, guess, rows_, velocity, steps});
}

void GuessedVelocities::place(const VelocityGuess& guess, std::vector<int32_t>& steps,
                              StrandBlocks& velocity) {
  place_velocities(ground_.set, {ground_, guess, rows_, velocity, steps});
}

glm::vec3 GuessedVelocities::mean_head(const StrandBlocks& velocity) const {
  glm::dvec3 total(0.0);
  for (const uint32_t place : ground_.layout.place_of)
    total += glm::dvec3(vector_at(velocity, place, 0) - head_part(ground_, place, 0));
  glm::vec3 mean(total / static_cast<double>(ground_.layout.strand_count));
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(mean[axis]) <= kMostMps)) mean[axis] = 0.0f;
  return mean;
}

bool GuessedVelocities::carries_roots(const glm::vec3& head_mps, const StrandBlocks& velocity) const {
  for (const uint32_t place : ground_.layout.place_of) {
    glm::vec3 speed = head_mps;
    for (uint32_t v = 0; v < ground_.pinned_root_count; ++v) {
      speed += head_part(ground_, place, v);
      const glm::vec3 away = vector_at(velocity, place, v) - speed;
      if (!(dot_of(away, away) <= kMostCarriedApartMps * kMostCarriedApartMps)) return false;
    }
  }
  return true;
}

VelocityGuess GuessedVelocities::fit(const StrandBlocks& velocity) {
  constexpr double kNoiseMps = 1e-4;
  VelocityGuess guess;
  guess.head_mps = mean_head(velocity);
  guess.are_roots_carried = carries_roots(guess.head_mps, velocity);
  AcrossFits across;
  AlongFits along;
  add_velocities(ground_.set, {ground_, guess, velocity, rows_, across, along});
  std::array<double, kGuessAcrossCount> across_noise;
  across_noise.fill(kNoiseMps);
  std::array<double, kGuessAlongCount> along_noise;
  along_noise.fill(kNoiseMps);
  for (uint32_t which = 0; which < kGuessClassCount; ++which) {
    guess.across[which] = across[which].weights(double{kWeight}, across_noise);
    guess.along[which] = along[which].weights(double{kWeight}, along_noise);
  }
  return guess;
}

}  // namespace strandcast::step
