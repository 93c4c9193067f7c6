// Measures what leaving out unneeded parts of a scene saves. Every fact that is false is forced true
// (RuntimeFacts::forced), and both versions run in turns under the same head motion; hair must be equal bit
// for bit. Also measures what letting most strands follow others costs in millimetres and bytes. Runs on the
// executor's thread.
#pragma once

#include <string>
#include <vector>

#include "common/gl/pass_list.h"
#include "common/pictures/picture_error.h"
#include "common/scene/features.h"
#include "server/report/stream_motion.h"
#include "server/scene/scene_content.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Tolerance for OpenGL compilers that round a kernel differently if another part is left out; a larger
/// distance is a real difference.
inline constexpr double kRoundingMm = 0.01;

struct PruningDesc {
  SceneDesc scene;
  StreamMotion motion;
  int steps = 180;
  bool has_pictures = true;  // compared at the end; what pictures take is measured too
};

/// A pass that the simulation of a scene leaves out.
struct PrunedPass {
  std::string pass;
  std::string reason;          // why it is left out
  double without_ms = 0.0;     // median of a whole step
  double with_ms = 0.0;        // likewise, with the pass forced
  uint64_t without_bytes = 0;  // all that solver and step keep
  uint64_t with_bytes = 0;
  bool is_same_hair = false;  // state hashes of all steps
  double largest_mm = 0.0;    // distance of a vertex between the two, of all steps
  bool has_pictures = false;
  bool is_same_picture = false;  // bytes of the last one
  std::string note;              // why it could not be forced; then nothing else is told
};

/// A pass that runs only for readers, with its cost if there are some.
struct ReaderPass {
  std::string pass;
  double ms = 0.0;
  uint64_t bytes = 0;
};

struct PruningRun {
  std::string scene;
  std::vector<PrunedPass> passes;
  std::vector<ReaderPass> reader_passes;  // left out while nobody reads
  bool is_same_unread = false;            // hair after all steps, whether or not states were published
};

/// Share of a scene's hair that is simulated.
struct FollowedDesc {
  double share = 1.0;            // of the strands
  bool has_every_vertex = true;  // else as DetailLevel::FewerVertices has them, which has no volume either
  bool has_volume = false;       // the scene as it is, or without forces between strands
};

/// Comparison of hair that is partly simulated with hair that is fully simulated.
struct FollowedRun {
  std::string scene;
  FollowedDesc part;
  uint32_t simulated = 0;
  double all_step_ms = 0.0;  // medians
  double step_ms = 0.0;
  double follow_ms = 0.0;  // of a published state
  uint64_t all_bytes = 0;  // of the solver
  uint64_t bytes = 0;
  double all_mbit_per_s = 0.0;  // deltas of the scene's codec at 60 states a second
  double mbit_per_s = 0.0;
  double rms_mm = 0.0;  // of the vertices that follow, from where they are with all of it simulated
  double p95_mm = 0.0;
};

Result<PruningRun> run_pruning(const PruningDesc& desc, Executor& executor);
Result<FollowedRun> run_followed(const PruningDesc& desc, const FollowedDesc& part, Executor& executor);

std::string pruning_text(const std::vector<PruningRun>& runs, const std::vector<FollowedRun>& followed);
std::string pruning_csv(const std::vector<PruningRun>& runs);
std::string followed_csv(const std::vector<FollowedRun>& followed);
std::string pruning_page(const std::vector<PruningRun>& runs, const std::vector<FollowedRun>& followed);
/// Returns a sentence for each left-out pass that changes the result; empty if none does.
std::vector<std::string> pruning_breaks(const std::vector<PruningRun>& runs);

}  // namespace strandcast
