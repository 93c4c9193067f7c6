// Chooses the strand codec of a scene that names none. It is "step", which takes the fewest bits, unless a
// GPU simulates, whose states have to be encoded, and this machine has no time for that beside the
// simulation.
#pragma once

#include <cstddef>
#include <string>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Number of vertices that any two processors can encode in time; up to it nothing is measured.
inline constexpr size_t kAlwaysFewestBitsVertices = 64'000;
/// Largest share of the processors' time between two states that encoding may take.
inline constexpr double kEncodeShare = 2.0 / 3.0;

/// Returns how many states of strands a scene publishes per second.
double states_per_second(const SceneDesc& scene);

struct CodecChoice {
  std::string codec;
  std::string reason;  // a sentence for log and --explain
};

/// Measured costs that decide the choice.
struct EncodeCost {
  double cpu_ms = 0.0;  // processor time of all threads for one state with "tangent"
  unsigned processors = 1;
  double states_hz = 60.0;
};
CodecChoice choose_codec(const EncodeCost& cost);

/// Returns a scene's own codec if it names one. Otherwise chooses by size or, above
/// kAlwaysFewestBitsVertices, by what simulates: viewers share the states of lanes, and those of a GPU are
/// encoded, some here, which takes about half a second.
Result<CodecChoice> choose_codec(const SceneDesc& scene, const SceneAsset& asset,
                                 const ExecutorConfig& executor);

}  // namespace strandcast
