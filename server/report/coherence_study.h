// Measurements of strandcast-report coherence: a shake of the head for every strand model with a kernel. Each
// model runs alone and with the forces between hairs and air; the study measures how much of the hair moves
// together.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/picture_size.h"
#include "common/math/coherence.h"
#include "common/pictures/image_codec.h"
#include "common/scene/scene_desc.h"
#include "server/report/hair_reality.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Shake of the head: amplitude to either side, and frequency.
inline constexpr double kShakeYawDeg = 55.0;
inline constexpr double kShakeHz = 2.2;

/// A model with the settings that it runs with.
struct CoherenceRow {
  std::string name;
  std::string solver;
  HairCompany company;
  double step_rate_hz = 60.0;
  bool is_main = false;         // it has pictures and a line in plots
  uint32_t least_substeps = 1;  // more where its model cannot bear so few
};
/// Returns the rows: every model with a kernel alone, then `direct_rod` with all forces. `is_whole` adds
/// every model with all forces that it tolerates, and other step rates.
std::vector<CoherenceRow> coherence_rows(bool is_whole);

struct CoherenceStudyDesc {
  SceneDesc scene;  // hair, head and look; wind, solver and volume are those of a row
  std::vector<CoherenceRow> rows = coherence_rows(true);
  double shake_s = 4.0;
  double settle_s = 2.0;  // first part of the shake, which is not measured
  double hold_s = 9.0;    // after the shake
  double look_s = 0.5;    // last part of that: hair at rest
  uint32_t moments = 20;  // of the shake, evenly spaced, that are measured
  bool has_pictures = true;
  RenderSize picture_size{320, 320};
  HairRealityDesc reality;
};

/// Measured share at one moment.
struct CoherenceMoment {
  double time_s = 0.0;
  double incoherent_share = 0.0;
};

struct CoherenceOutcome {
  CoherenceRow row;
  uint32_t substeps = 1;
  Coherence coherence;
  std::vector<CoherenceMoment> moments;
  double fastest_over_scalp = 0.0;  // fastest vertex over the fastest root, world
  double rest_rms_m = 0.0;          // off the groom
  double rest_speed_mps = 0.0;      // root mean square
  double step_cpu_ms = 0.0;         // mean over all steps
};

struct CoherenceStudy {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::string device;
  std::vector<CoherenceOutcome> outcomes;
  Image sheet;                          // a line of pictures for each main row; empty without pictures
  std::vector<std::string> sheet_rows;  // from above
  std::vector<double> sheet_times_s;    // from the left
  HairReality reality;
};

/// Returns the head's pose in a shake of `shake_s`, which starts and ends smoothly within a quarter of a
/// second.
Pose yawed_head(double time_s, double shake_s);

/// Returns the scene of a row: its solver, no wind, and enough substeps for its stable range. If the model
/// supports it, the groom's shape carries all of its weight.
Result<SceneDesc> scene_of_row(const CoherenceRow& row, const SceneDesc& scene);

/// Measures one row. BadInput if the scene or the model does not support it.
Result<CoherenceOutcome> measure_row(const CoherenceStudyDesc& desc, const CoherenceRow& row,
                                     Executor& executor);

/// Receives a description of each part when it begins.
using CoherenceProgress = std::function<void(const std::string&)>;

Result<CoherenceStudy> run_coherence_study(const CoherenceStudyDesc& desc, Executor& executor,
                                           const CoherenceProgress& progress);

// Files of strandcast-report coherence: CSV table, page with plots and pictures, and printed text. Pure
// functions of a CoherenceStudy, except saving.

inline constexpr const char* kCoherencePage = "coherence.html";

/// Returns the tables as text for a terminal.
std::string coherence_text(const CoherenceStudy& study);
/// Returns a CSV line for each row of the shake.
std::string coherence_csv(const CoherenceStudy& study);
/// Returns a bar chart of the incoherent share of each row.
std::string coherence_bars(const CoherenceStudy& study);
/// Returns a plot of the incoherent share against processor time, a dot per row.
std::string coherence_cost_plot(const CoherenceStudy& study);
/// Returns a plot of the incoherent share over the time of the shake, a line per main row of the study.
std::string coherence_time_plot(const CoherenceStudy& study);
std::string coherence_page(const CoherenceStudy& study);

Status save_coherence_study(const CoherenceStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
