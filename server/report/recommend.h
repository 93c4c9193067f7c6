// strandcast-report recommend: finds the most exact strand model and setting that simulates a scene's strands
// within a time budget on this machine. Times are of the scene's own strands; errors are of the motion set's
// hair that is most similar in shape.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "server/report/motion_set.h"

namespace strandcast {

struct RecommendOptions {
  std::filesystem::path scene_path;    // empty: the built-in scene
  std::vector<std::string> overrides;  // path=value
  std::vector<std::string> solvers;    // rows to choose from; empty = all
  double budget_ms = 0.0;              // of simulation per step of the scene
  ExecutorConfig device;               // kAllDevices: on each executor, beside each other
};

/// One setting of one row for the scene.
struct Candidate {
  RunSetting setting;
  SimDevice device = SimDevice::Gl;  // what its time was measured on
  double ms_per_step = 0.0;          // on the scene's own strands
  double error = 0.0;  // relative RMS on the motion set's hair, at the scene's vertices and rate
};

struct Recommendation {
  std::vector<ExecutorInfo> executors;     // that times were measured on
  MotionHair hair = MotionHair::Straight;  // of the motion set, nearest to the scene's: what errors are of
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::vector<Candidate> fitting;  // within the budget, the most exact first; of equals the fastest
  Candidate next;                  // the least slow beyond the budget; row is nullptr when all fit
  std::string scene_lines;         // of the first, to paste into a scene file
};

/// Measures the rows that a server can run. If none fits the budget, LimitExceeded names the fastest, its
/// time, and how many strands would fit.
Result<Recommendation> recommend(const SceneDesc& scene, const RecommendOptions& options);

/// Returns the text for a person.
std::string recommendation_text(const Recommendation& recommendation, const SceneDesc& scene,
                                double budget_ms);

}  // namespace strandcast
