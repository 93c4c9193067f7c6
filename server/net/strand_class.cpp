#include "server/net/strand_class.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace strandcast {
namespace {

/// A lattice that is coarser by less saves too little to be worth a keyframe.
constexpr uint32_t kLeastCoarsening = 2;

/// Rounding to every k-th point of a lattice adds at most k times the error that the lattice has already.
uint32_t coarsening_for(float bound_m) {
  const double factor =
      std::floor(static_cast<double>(kCoarsestBoundM) / static_cast<double>(bound_m) + 1e-6) - 1.0;
  return factor >= kLeastCoarsening ? static_cast<uint32_t>(factor) : 1;
}

uint32_t first_divisor(const StrandStreamPlan& plan) {
  if (plan.rate_hz <= 0.0 || plan.rate_hz >= plan.step_rate_hz) return 1;
  constexpr double kRounding = 1e-9;
  const double steps = std::ceil(plan.step_rate_hz / plan.rate_hz - kRounding);
  return static_cast<uint32_t>(std::min<double>(steps, kMaxRateDivisor));
}

/// What of a frame's bytes hangs on neither strands nor bound.
double fixed_bytes(const StrandByteModel& model, const StrandClass& row) {
  return model.frame_bytes + model.step_bytes * row.rate_divisor;
}

/// The rest, bytes/s, up to a factor that all classes share.
double relative_rest(const StrandByteModel& model, const StrandClass& row) {
  return std::pow(row.frame_rate_hz, model.rate_power) *
         std::pow(static_cast<double>(row.strand_share), model.share_power) *
         (row.coarsening > 1 ? model.coarse_share : 1.0);
}

bool is_same(const StrandClass& a, const StrandClass& b) {
  return a.strand_share == b.strand_share && a.rate_divisor == b.rate_divisor && a.coarsening == b.coarsening;
}

/// The smallest of 1, 1/2, 1/4, 1/8 that leaves enough strands, but not below `wanted`.
float share_of(float wanted, uint32_t strand_count) {
  float share = 1.0f;
  while (share > wanted && 0.5f * share * static_cast<float>(strand_count) >= kLeastPrefixStrands)
    share *= 0.5f;
  return share;
}

}  // namespace

std::vector<StrandClass> make_strand_classes(const StrandStreamPlan& plan) {
  struct Row {
    float strand_share;
    uint32_t rate_divisor;
    bool is_coarse;
  };
  constexpr Row kRows[] = {{1.0f, 1, false},   {0.5f, 1, false},   {0.25f, 1, false},
                           {0.125f, 1, false}, {0.125f, 2, false}, {0.125f, 3, false},
                           {0.125f, 3, true},  {0.125f, 4, true},  {0.125f, 6, true}};
  const uint32_t coarsening = coarsening_for(plan.bound_m);
  const uint32_t divisor = first_divisor(plan);
  std::vector<StrandClass> classes;
  for (const Row& row : kRows) {
    StrandClass made;
    made.strand_share = share_of(row.strand_share, plan.strand_count);
    made.rate_divisor = divisor * row.rate_divisor;
    made.frame_rate_hz = plan.step_rate_hz / made.rate_divisor;
    made.coarsening = row.is_coarse ? coarsening : 1;
    made.bound_m = made.coarsening > 1 ? plan.bound_m * static_cast<float>(1 + coarsening) : plan.bound_m;
    const bool is_new = classes.empty() || !is_same(made, classes.back());
    const bool is_fast_enough = row.rate_divisor == 1 || made.frame_rate_hz >= kLeastFrameRateHz;
    if (is_new && is_fast_enough && made.rate_divisor <= kMaxRateDivisor) classes.push_back(made);
  }
  return classes;
}

double expected_bytes_per_s(const StrandByteModel& model, const MeasuredClass& measured,
                            const StrandClass& wanted) {
  const double fixed = fixed_bytes(model, measured.row);
  // Where even less came, what is fixed is less here, by as much.
  const double fixed_scale = std::min(1.0, measured.delta_bytes / fixed);
  const double rest_bytes_per_s = std::max(measured.delta_bytes - fixed, 0.0) * measured.row.frame_rate_hz;
  return fixed_scale * fixed_bytes(model, wanted) * wanted.frame_rate_hz +
         rest_bytes_per_s * relative_rest(model, wanted) / relative_rest(model, measured.row);
}

std::string to_string(const StrandClass& row) {
  const std::string strands = row.strand_share < 1.0f
                                  ? fmt::format("1/{:.0f} of the strands", 1.0f / row.strand_share)
                                  : "all strands";
  return fmt::format("{}, {:.3g} Hz, {:.3g} mm", strands, row.frame_rate_hz, row.bound_m * 1e3);
}

}  // namespace strandcast
