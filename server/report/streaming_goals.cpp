#include "server/report/streaming_goals.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <string_view>

namespace strandcast {
namespace {

constexpr const char* kJudgedCodec = "tangent";
constexpr const char* kStepCodec = "step";
constexpr const char* kGlitching = "glitching";  // of stream_clips()
constexpr size_t kTimedVertices = 160'000;
constexpr unsigned kEncodeCores = 2;

// At kGoalBoundM, bits per vertex.
constexpr double kActiveBits = 3.5;
constexpr double kIdleBits = 1.8;
constexpr double kViolentBits = 6.0;
constexpr double kWildestBits = 6.0;
constexpr double kJoinBits = 13.0;
// Times fewer bits than the best peer.
constexpr double kTemporalRatio = 2.0;
constexpr double kPlainRatio = 6.0;
constexpr double kDecodeMs = 12.0;
constexpr double kEncodeMs = 16.0;

// Of `step`, on kStepSize.
constexpr StreamSize kStepSize{10'000, 16};
constexpr double kFineBoundM = 2e-5;
constexpr double kStepRatio = 10.0;
constexpr double kStepDecodeMs = 12.0;
constexpr const char* kStepDecodeSolver = "dftl";

std::string place_of(const StreamingRow& row) {
  return fmt::format("{}, {}", row.motion_and_part(), to_string(row.size));
}

std::vector<const StreamingRow*> judged_rows(const StreamingReport& report) {
  std::vector<const StreamingRow*> rows;
  for (const StreamingRow& row : report.rows)
    if (row.codec == kJudgedCodec && row.bound_m == kGoalBoundM && row.solver == report.solver)
      rows.push_back(&row);
  return rows;
}

enum class Better { Low, High };

/// The row whose value is worst, and the mean of all, against a limit.
class Worst {
 public:
  Worst(Better better, double limit) : better_(better), limit_(limit) {}

  void add(double value, std::string place) {
    const bool is_worse = better_ == Better::Low ? value > worst_ : value < worst_;
    if (count_ == 0 || is_worse) {
      worst_ = value;
      place_ = std::move(place);
    }
    ++count_;
    sum_ += value;
    kept_ += is_kept(value) ? 1 : 0;
  }
  GoalLine line(std::string goal, const std::string& unit) const {
    if (count_ == 0) return {std::move(goal), "nothing recorded that it is stated for", Verdict::NotMeasured};
    return {std::move(goal),
            fmt::format("{:.2f}{} at worst ({}), {:.2f} in the mean; {} of {} recordings", worst_, unit,
                        place_, sum_ / count_, kept_, count_),
            is_kept(worst_) ? Verdict::Met : Verdict::Missed};
  }

 private:
  bool is_kept(double value) const { return better_ == Better::Low ? value <= limit_ : value >= limit_; }

  Better better_;
  double limit_;
  double worst_ = 0.0;
  double sum_ = 0.0;
  int count_ = 0;
  int kept_ = 0;
  std::string place_;
};

GoalLine level_goal(const StreamingReport& report, MotionLevel motion_level, double limit) {
  Worst worst(Better::Low, limit);
  for (const StreamingRow* row : judged_rows(report))
    if (row->motion_level == motion_level && row->part == MotionPart::Median)
      worst.add(row->bits, place_of(*row));
  return worst.line(fmt::format("tangent: median part of what is {}: at most {:g} bits per vertex",
                                to_string(motion_level), limit),
                    " bits");
}

GoalLine wildest_goal(const StreamingReport& report) {
  Worst worst(Better::Low, kWildestBits);
  for (const StreamingRow* row : judged_rows(report))
    if (row->part == MotionPart::Wildest) worst.add(row->bits, place_of(*row));
  return worst.line(
      fmt::format("tangent: wildest part of any motion: at most {:g} bits per vertex", kWildestBits),
      " bits");
}

GoalLine ratio_goal(const StreamingReport& report, PeerKind kind) {
  const double limit = kind == PeerKind::Temporal ? kTemporalRatio : kPlainRatio;
  Worst worst(Better::High, limit);
  for (const StreamingRow* row : judged_rows(report)) {
    // Positions of a violent motion cost others no more than any; the goal is not stated for them.
    const bool is_violent = row->motion_level == MotionLevel::Violent || row->part == MotionPart::Wildest;
    if (kind == PeerKind::Plain && is_violent) continue;
    if (const StreamingRow* peer = best_peer(report, *row, kind); peer != nullptr)
      worst.add(peer->bits / row->bits, fmt::format("{}, {}", place_of(*row), peer->codec));
  }
  return worst.line(
      kind == PeerKind::Temporal
          ? fmt::format("tangent: at least {:g} times fewer bits than the best peer given a prediction in "
                        "time",
                        limit)
          : fmt::format("tangent: at least {:g} times fewer bits than the best peer on positions, "
                        "violent motions and wildest parts aside",
                        limit),
      " times");
}

GoalLine join_goal(const StreamingReport& report) {
  Worst worst(Better::Low, kJoinBits);
  for (const StreamingRow* row : judged_rows(report)) worst.add(row->join_bits, place_of(*row));
  return worst.line(fmt::format("tangent: a keyframe of at most {:g} bits per vertex", kJoinBits), " bits");
}

GoalLine time_goal(const StreamingReport& report, std::string goal, double limit_ms,
                   const std::function<double(const StreamingRow&)>& ms) {
  Worst worst(Better::Low, limit_ms);
  for (const StreamingRow* row : judged_rows(report))
    if (row->size.vertices() == kTimedVertices) worst.add(ms(*row), place_of(*row));
  return worst.line(std::move(goal), " ms");
}

/// What a clip asks of `step`.
enum class StepClip { Walking, Wild, Glitching };

bool is_glitching(const StreamingRow& row) {
  for (const StreamClip& clip : stream_clips())
    if (clip.character == std::string_view(kGlitching))
      for (const std::filesystem::path file_name : clip.file_names)
        if (row.motion == file_name.stem().string()) return true;
  return false;
}

bool is_of(const StreamingRow& row, StepClip clip) {
  if (is_glitching(row)) return clip == StepClip::Glitching;
  const bool is_active = row.motion_level == MotionLevel::Active;
  if (clip == StepClip::Walking) return is_active && row.part == MotionPart::Median;
  return clip == StepClip::Wild &&
         (row.motion_level == MotionLevel::Violent || (is_active && row.part == MotionPart::Wildest));
}

/// Rows of `step` at its size whose steps were told: the double-precision solvers have none.
template <class Visit>
void for_step_rows(const StreamingReport& report, double bound_m, WindTold wind, Visit visit) {
  for (const StreamingRow& row : report.rows)
    if (row.codec == kStepCodec && row.wind == to_string(wind) && row.bound_m == bound_m &&
        row.size.strand_count == kStepSize.strand_count && row.size.vertex_count == kStepSize.vertex_count &&
        row.moved_by != kMovedByReference)
      visit(row);
}

/// So many bits per vertex at most, headers and all.
struct StepBitsGoal {
  const char* solver;
  StepClip clip;
  WindTold wind;
  double bound_m;
  double bits;
  const char* words;
};
constexpr StepBitsGoal kStepBits[] = {
    {"dftl", StepClip::Walking, WindTold::Known, kGoalBoundM, 0.2, "walking and turning"},
    {"dftl", StepClip::Wild, WindTold::Known, kGoalBoundM, 0.7,
     "violent motions and the wildest of others but idle ones"},
    {"dftl", StepClip::Walking, WindTold::Known, kFineBoundM, 0.3, "walking and turning"},
    {"dftl", StepClip::Walking, WindTold::Unknown, kGoalBoundM, 1.4, "walking and turning"},
    {"direct_rod", StepClip::Walking, WindTold::Known, kGoalBoundM, 0.25, "walking and turning"},
    {"direct_rod", StepClip::Wild, WindTold::Known, kGoalBoundM, 0.7,
     "violent motions and the wildest of others but idle ones"},
    {"direct_rod", StepClip::Glitching, WindTold::Known, kGoalBoundM, 2.0, "the glitching clip"},
    {"direct_rod", StepClip::Walking, WindTold::Unknown, kGoalBoundM, 2.2, "walking and turning"},
};

GoalLine step_bits_goal(const StreamingReport& report, const StepBitsGoal& goal) {
  Worst worst(Better::Low, goal.bits);
  for_step_rows(report, goal.bound_m, goal.wind, [&](const StreamingRow& row) {
    if (row.solver == goal.solver && is_of(row, goal.clip)) worst.add(row.bits, place_of(row));
  });
  return worst.line(fmt::format("step, {}, {}, wind {}, {:g} mm: at most {:g} bits per vertex", goal.solver,
                                goal.words, to_string(goal.wind), 1e3 * goal.bound_m, goal.bits),
                    " bits");
}

GoalLine step_ratio_goal(const StreamingReport& report) {
  Worst worst(Better::High, kStepRatio);
  for_step_rows(report, kGoalBoundM, WindTold::Known, [&](const StreamingRow& row) {
    if (is_glitching(row)) return;
    if (const StreamingRow* peer = best_peer(report, row, PeerKind::Temporal); peer != nullptr)
      worst.add(peer->bits / row.bits, fmt::format("{}, {}, {}", place_of(row), row.solver, peer->codec));
  });
  return worst.line(fmt::format("step, wherever peers ran, the glitching clip aside: at least {:g} times "
                                "fewer bits than the best peer given a prediction in time",
                                kStepRatio),
                    " times");
}

GoalLine step_decode_goal(const StreamingReport& report) {
  Worst worst(Better::Low, kStepDecodeMs);
  for_step_rows(report, kGoalBoundM, WindTold::Known, [&](const StreamingRow& row) {
    if (row.solver == kStepDecodeSolver) worst.add(row.decode_cpu_ms, place_of(row));
  });
  return worst.line(fmt::format("step, {}: decode {} vertices in {:g} ms of one core", kStepDecodeSolver,
                                kStepSize.vertices(), kStepDecodeMs),
                    " ms");
}

GoalLine bound_goal(const StreamingReport& report) {
  size_t count = 0;
  size_t kept = 0;
  double largest = 0.0;
  for (const StreamingRow& row : report.rows) {
    if (!row.is_ours) continue;
    ++count;
    kept += row.keeps_bound() ? 1 : 0;
    largest = std::max(largest, row.max_error_m / row.bound_m);
  }
  return {"every vertex of every frame within the bound, at every bound, with every codec of ours",
          fmt::format("{} of {} runs; the largest error is {:.4f} of its bound", kept, count, largest),
          count == 0      ? Verdict::NotMeasured
          : kept == count ? Verdict::Met
                          : Verdict::Missed};
}

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::Met:
      return "met";
    case Verdict::Missed:
      return "missed";
    case Verdict::NotMeasured:
      return "not measured";
  }
  return "";
}

const StreamingRow* best_peer(const StreamingReport& report, const StreamingRow& ours, PeerKind kind) {
  const StreamingRow* best = nullptr;
  for (const StreamingRow& row : report.rows) {
    const bool is_candidate = !row.is_ours && !row.is_bound_free && row.is_same_recording(ours) &&
                              row.bound_m == ours.bound_m && row.keeps_bound() &&
                              row.is_temporal == (kind == PeerKind::Temporal);
    if (is_candidate && (best == nullptr || row.bits < best->bits)) best = &row;
  }
  return best;
}

std::vector<GoalLine> judge_streaming(const StreamingReport& report) {
  // On an idle machine the clock says less than the processor time, which all cores share. Where it says
  // more, other work was in the way, and the processor time is the nearest that is known from above.
  const auto encode_ms = [](const StreamingRow& row) {
    return std::min(row.encode_wall_ms, row.encode_cpu_ms);
  };
  std::vector<GoalLine> lines = {
      bound_goal(report),
      level_goal(report, MotionLevel::Active, kActiveBits),
      level_goal(report, MotionLevel::Idle, kIdleBits),
      level_goal(report, MotionLevel::Violent, kViolentBits),
      wildest_goal(report),
      ratio_goal(report, PeerKind::Temporal),
      ratio_goal(report, PeerKind::Plain),
      join_goal(report),
      time_goal(report,
                fmt::format("tangent: decode {} vertices in {:g} ms of one core", kTimedVertices, kDecodeMs),
                kDecodeMs, [](const StreamingRow& row) { return row.decode_cpu_ms; }),
      time_goal(report,
                fmt::format(
                    "tangent: encode them in {:g} ms on {} cores (by the clock on {} here, or processor time "
                    "where that is less)",
                    kEncodeMs, kEncodeCores, report.processors),
                kEncodeMs, encode_ms)};
  for (const StepBitsGoal& goal : kStepBits) lines.push_back(step_bits_goal(report, goal));
  lines.push_back(step_ratio_goal(report));
  lines.push_back(step_decode_goal(report));
  return lines;
}

}  // namespace strandcast
