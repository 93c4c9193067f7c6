#include "server/sim/solvers/direct_rod/direct_rod_style.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <list>
#include <mutex>
#include <span>

#include "common/base/hash.h"
#include "common/base/mercy.h"
#include "common/base/worker_pool.h"
#include "server/sim/directions.h"

namespace strandcast {
namespace {

constexpr size_t kMaxKeptFits = 4;
constexpr size_t kStrandsPerRange = 8;
/// A chain of N equal segments with its mass in the vertices hangs more slowly than a smooth one: its
/// frequency squared is at least 1 / (1 + this / N^2) of it (solved for N = 1 to 63). Without this a strand
/// of few vertices would be stiffened for nothing.
constexpr double kLumping = 0.594;
/// Stiffness over inertia, b h^2 / l^4, that a strand in floats may have with steps of the usual length h:
/// strands of many short edges with more (a hair of 18 mm in 31 of them has 3e6) are thrown about by
/// roundings, with 3e6 one in 250 of them. What is softened to this is still stiff: it yields to its own
/// weight by g h^2 N^4 / 8 over this, 0.04 mm for 15 edges.
constexpr double kMostPerInertia = 5e5;
constexpr double kUsualStepS = 1.0 / 60.0;
/// Pivots below this share of the block's trace are rounding.
constexpr double kLeastPivotShare = 1e-12;

glm::dmat3 symmetric_part(const glm::dmat3& m) {
  return 0.5 * (m + glm::transpose(m));
}

/// A joint turns back by its angle up to a right angle (kMaxHalfSineSquared), with less beyond: what it would
/// have to carry there it cannot.
bool is_within_reach(const RodJoint& joint) {
  const double half_sine = std::sin(0.5 * joint.strain.bend_rad);
  return half_sine * half_sine < kMaxHalfSineSquared && std::abs(joint.strain.twist_rad) < kMaxRestAngleRad;
}

/// J of the header.
glm::dmat3 joint_stiffness(const RodJoint& joint) {
  const glm::dvec3& u = joint.tangent;
  const glm::dvec3& a = joint.strain.bend_axis;
  const glm::dvec3 e = glm::cross(a, u);
  constexpr double kTinyRad = 1e-6;
  const double h = 0.5 * joint.strain.bend_rad;
  const double cosine = std::cos(h);
  const double sine = std::sin(h);
  const double h_cot = h > kTinyRad ? h * cosine / sine : 1.0;
  const glm::dmat3 bend = glm::outerProduct(a, a) + h_cot * glm::outerProduct(e, e) -
                          (h * sine / cosine) * glm::outerProduct(u, u);
  const glm::dmat3 twist =
      glm::outerProduct(u, u) + joint.strain.twist_rad * sine * symmetric_part(glm::outerProduct(u, a));
  return joint.bend_stiffness * bend + (joint.twist_stiffness / (cosine * cosine)) * twist;
}

glm::dvec3 joint_moment(const RodJoint& joint) {
  const double h = 0.5 * joint.strain.bend_rad;
  return joint.bend_stiffness * joint.strain.bend_rad * joint.strain.bend_axis +
         (joint.twist_stiffness * joint.strain.twist_rad / std::cos(h)) * joint.tangent;
}

std::vector<RodJoint> joints_of(const RodShape& shape, const RodParameters& parameters) {
  std::vector<RodJoint> joints;
  for (uint32_t i = shape.first; i < shape.vertex_count(); ++i)
    joints.push_back(joint_at(shape, i, parameters, any_perpendicular(shape.direction[i - 1])));
  return joints;
}

RodHessian hessian_of(const RodShape& shape, const std::vector<RodJoint>& joints) {
  RodHessian hessian;
  hessian.diagonal.resize(joints.size());
  hessian.next.resize(joints.size());
  for (size_t k = 0; k < joints.size(); ++k) {
    const auto i = shape.first + static_cast<uint32_t>(k);
    const glm::dvec3& t = shape.direction[i];
    const glm::dvec3& pull = shape.load[i];
    const glm::dmat3 stiffness = joint_stiffness(joints[k]);
    hessian.diagonal[k] = stiffness + shape.soft_m(i) * (glm::dmat3(glm::dot(pull, t)) -
                                                         symmetric_part(glm::outerProduct(pull, t)));
    if (k == 0) continue;
    hessian.diagonal[k - 1] += stiffness;
    hessian.next[k] = 0.5 * cross_matrix(joint_moment(joints[k])) - stiffness;
  }
  return hessian;
}

bool is_positive(const glm::dmat3& m) {
  const double least = kLeastPivotShare * (std::abs(m[0][0]) + std::abs(m[1][1]) + std::abs(m[2][2]));
  if (!(m[0][0] > least)) return false;
  const double l10 = m[0][1] / m[0][0];
  const double l20 = m[0][2] / m[0][0];
  const double d1 = m[1][1] - l10 * m[0][1];
  if (!(d1 > least)) return false;
  const double s21 = m[1][2] - l20 * m[0][1];
  return m[2][2] - l20 * m[0][2] - s21 * s21 / d1 > least;
}

/// Whether H - w^2 M is positive. M is full in the rotations, but the sum over the edges before a vertex is a
/// state that is carried along: eliminated from the tip, edge by edge, what is left over is a form in the
/// rotation of the edge before (p) and in the way u of the vertex that it ends at.
bool is_above(const RodShape& shape, const RodHessian& hessian, double tip_length_m, double rate_squared) {
  glm::dmat3 on_p(0.0);
  glm::dmat3 p_to_u(0.0);  // p' (p_to_u) u
  glm::dmat3 on_u(0.0);
  double mass = tip_length_m;
  for (size_t k = hessian.diagonal.size(); k-- > 0;) {
    const uint32_t i = shape.first + static_cast<uint32_t>(k);
    mass += 0.5 * shape.soft_m(i);
    on_u -= glm::dmat3(rate_squared * mass);
    mass = 0.5 * shape.soft_m(i);
    // u of this vertex = u of the one before + way * p.
    const glm::dmat3 way = -shape.segment_m[i] * cross_matrix(shape.direction[i]);
    const glm::dmat3 along = p_to_u * way;
    const glm::dmat3 pushed = on_u * way;
    const glm::dmat3 pivot = symmetric_part(hessian.diagonal[k] + on_p + along + glm::transpose(along) +
                                            glm::transpose(way) * pushed);
    if (!is_positive(pivot)) return false;
    if (k == 0) return true;
    const glm::dmat3 inverse = glm::inverse(pivot);
    const glm::dmat3 from_u = glm::transpose(p_to_u) + pushed;  // u' (from_u) p
    const glm::dmat3 solved = hessian.next[k] * inverse;
    on_p = -solved * glm::transpose(hessian.next[k]);
    p_to_u = -solved * glm::transpose(from_u);
    on_u = symmetric_part(on_u - from_u * inverse * glm::transpose(from_u));
  }
  return true;
}

double stiffening_of(int step) {
  return static_cast<double>(static_cast<float>(std::exp2(static_cast<double>(step) / kStiffeningSteps)));
}

/// The step from which on single precision resolves a strand's inertia beside its stiffness; at most 0.
int first_step(const RodShape& shape, const RodParameters& parameters) {
  const double l = shape.mean_segment_m;
  const double most_m4ps2 = kMostPerInertia * l * l * l * l / (kUsualStepS * kUsualStepS);
  if (most_m4ps2 >= parameters.stiffness_m4ps2) return 0;
  return static_cast<int>(std::floor(std::log2(most_m4ps2 / parameters.stiffness_m4ps2) * kStiffeningSteps));
}

/// Returns the smallest step, at least `from`, at which the rod holds; one more than the last if none
/// does. Searches upwards, then bisects.
int least_step(const RodShape& shape, const RodParameters& parameters, double rate_squared, int from) {
  const auto holds = [&](int step) {
    return is_rod_held(shape, stiffened(parameters, stiffening_of(step)), rate_squared);
  };
  const int last = static_cast<int>(std::lround(std::log2(kMaxStiffening))) * kStiffeningSteps;
  if (holds(from)) return from;
  int below = from;
  int above = std::min(from + kStiffeningSteps, last);
  while (!holds(above)) {
    if (above == last) return last + 1;
    below = above;
    above = std::min(above + kStiffeningSteps, last);
  }
  while (above - below > 1) {
    const int middle = (above + below) / 2;
    (holds(middle) ? above : below) = middle;
  }
  return above;
}

/// What a fit depends on.
struct FitKey {
  uint64_t shape_hash = 0;
  uint64_t tails_hash = 0;
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  uint32_t first = 0;
  double stiffness_m4ps2 = 0.0;
  double twist_stiffness_m4ps2 = 0.0;
  double tip_length_m = 0.0;
  double margin = 0.0;
  glm::dvec3 carried_gravity_mps2{0.0};
  bool operator==(const FitKey&) const = default;
};

class FitCache {
 public:
  std::shared_ptr<const StyleFit> find(const FitKey& key) {
    const std::lock_guard lock(mutex_);
    const auto found =
        std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) { return kept.first == key; });
    if (found == kept_.end()) return nullptr;
    kept_.splice(kept_.begin(), kept_, found);
    return found->second;
  }
  void keep(const FitKey& key, std::shared_ptr<const StyleFit> fit) {
    const std::lock_guard lock(mutex_);
    kept_.emplace_front(key, std::move(fit));
    if (kept_.size() > kMaxKeptFits) kept_.pop_back();
  }

 private:
  std::mutex mutex_;
  std::list<std::pair<FitKey, std::shared_ptr<const StyleFit>>> kept_;  // last used first
};

FitCache& fit_cache() {
  static FitCache cache;
  return cache;
}

}  // namespace

RodHessian rod_hessian(const RodShape& shape, const RodParameters& parameters) {
  return hessian_of(shape, joints_of(shape, parameters));
}

bool is_rod_held(const RodShape& shape, const RodParameters& parameters, double least_rate_squared) {
  const std::vector<RodJoint> joints = joints_of(shape, parameters);
  if (!std::all_of(joints.begin(), joints.end(), is_within_reach)) return false;
  return is_above(shape, hessian_of(shape, joints), parameters.tip_length_m, least_rate_squared);
}

std::shared_ptr<const StyleFit> fit_rod_style(const StrandLayout& layout, const RodParameters& parameters,
                                              const glm::dvec3& groom_gravity_in_head_mps2,
                                              const std::stop_token& stop) {
  const glm::dvec3 carried = parameters.sag_free * groom_gravity_in_head_mps2;
  const bool is_carried = layout.has_free_tips() && glm::dot(carried, carried) > 0.0;
  // A chain holds nothing, however many times stiffer.
  const bool is_sought = is_carried && parameters.style_margin > 0.0 && parameters.stiffness_m4ps2 > 0.0;
  auto fit = std::make_shared<StyleFit>();
  fit->stiffening.assign(layout.strand_count, 1.0f);
  if (!is_sought) return fit;
  const FitKey key = {hash_bytes(std::as_bytes(std::span(layout.rest))),
                      hash_bytes(std::as_bytes(std::span(layout.has_tail))),
                      layout.strand_count,
                      layout.vertex_count,
                      layout.pinned_root_count,
                      parameters.stiffness_m4ps2,
                      parameters.twist_stiffness_m4ps2,
                      parameters.tip_length_m,
                      parameters.style_margin,
                      carried};
  if (auto kept = fit_cache().find(key)) return kept;
  std::atomic<uint32_t> unheld{0};
  WorkerPool& workers = shared_workers();
  workers.at(Priority::Background)
      .for_ranges(layout.strand_count, kStrandsPerRange, [&](size_t begin, size_t end) {
        for (auto s = static_cast<uint32_t>(begin); s < end && !stop.stop_requested(); ++s) {
          if (layout.tail_count(s) > 0) continue;  // two ends hold it
          const RodShape shape = make_rod_shape(layout, s, parameters, groom_gravity_in_head_mps2);
          const double length = std::max(shape.free_length_m, shape.mean_segment_m);
          const double edges = shape.vertex_count() - shape.first;
          const double rate_squared =
              parameters.style_margin * glm::length(carried) / length / (1.0 + kLumping / (edges * edges));
          const int step = least_step(shape, parameters, rate_squared, first_step(shape, parameters));
          const double factor = std::min(stiffening_of(step), kMaxStiffening);
          fit->stiffening[s] = static_cast<float>(factor);
          if (stiffening_of(step) > kMaxStiffening) ++unheld;
        }
      });
  if (stop.stop_requested()) return nullptr;
  fit->unheld_count = unheld;
  fit_cache().keep(key, fit);
  return fit;
}

std::vector<std::string> describe(const StyleFit& fit) {
  std::vector<float> raised;
  std::copy_if(fit.stiffening.begin(), fit.stiffening.end(), std::back_inserter(raised),
               [](float factor) { return factor > 1.0f; });
  const auto softened =
      std::count_if(fit.stiffening.begin(), fit.stiffening.end(), [](float factor) { return factor < 1.0f; });
  std::sort(raised.begin(), raised.end());
  const auto at = [&](double share) {
    return raised[static_cast<size_t>(share * static_cast<double>(raised.size() - 1))];
  };
  std::vector<std::string> notes;
  if (raised.empty()) {
    notes.push_back(
        fmt::format("the groom lasts with the stiffness of its hair: none of {} strands is stiffened",
                    fit.stiffening.size()));
  } else {
    notes.push_back(fmt::format(
        "the groom keeps its style: {} of {} strands ({:.1f} %) that would fall are made stiffer, "
        "{:.1f} times at their median, {:.1f} at the 99th percentile, {:.1f} at most; nothing need "
        "be done (direct_rod with style_margin=0 leaves them as hair)",
        raised.size(), fit.stiffening.size(),
        100.0 * static_cast<double>(raised.size()) / static_cast<double>(fit.stiffening.size()), at(0.5),
        at(0.99), raised.back()));
  }
  if (softened > 0)
    notes.push_back(
        fmt::format("{} too short for single precision to move as stiff as hair, and softened",
                    counted(static_cast<uint64_t>(softened), "strand has edges", "strands have edges")));
  if (fit.unheld_count > 0)
    notes.push_back(fmt::format(
        "{} strands are no lasting equilibrium even at {:g} times the stiffness (a joint would have to turn "
        "by "
        "more than a right angle at rest, or give way): they leave their style; a smaller sag_free asks less",
        fit.unheld_count, kMaxStiffening));
  return notes;
}

Result<std::vector<std::string>> prepare_rod_style(const Groom& groom, const SolverParameters& parameters,
                                                   const glm::dvec3& groom_gravity_in_head_mps2,
                                                   const std::stop_token& stop) {
  const RodParameters rod = read_rod_parameters(parameters);
  const glm::dvec3 gravity = limited(groom_gravity_in_head_mps2, kMaxGravityMps2);
  if (rod.sag_free <= 0.0 || rod.style_margin <= 0.0 || gravity == glm::dvec3(0.0))
    return std::vector<std::string>{};
  ASSIGN_OR_RETURN(const StrandLayout layout, make_strand_layout(groom));
  const auto fit = fit_rod_style(layout, rod, gravity, stop);
  return fit == nullptr ? std::vector<std::string>{} : describe(*fit);
}

}  // namespace strandcast
