// Which strand codec a scene gets that names none: "step", which takes the fewest bits, unless this
// machine cannot encode so many vertices as often as the scene steps, with room left for the simulation.
#pragma once

#include <cstddef>
#include <string>

#include "common/base/result.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Any two processors encode so few in time: nothing is measured.
inline constexpr size_t kAlwaysFewestBitsVertices = 64'000;
/// Of the processors' time between two states, what encoding may take.
inline constexpr double kEncodeShare = 2.0 / 3.0;

/// States of strands that a scene publishes.
double states_per_second(const SceneDesc& scene);

struct CodecChoice {
  std::string codec;
  std::string reason;  // a sentence for log and --explain
};

/// What decides, measured.
struct EncodeCost {
  double cpu_ms = 0.0;  // processor time of all threads for one state with "tangent"
  unsigned processors = 1;
  double states_hz = 60.0;
};
CodecChoice choose_codec(const EncodeCost& cost);

/// For a scene and what it loaded: its own codec when it names one, else the choice by size or, above
/// kAlwaysFewestBitsVertices, by encoding some states of it, which takes about half a second.
Result<CodecChoice> choose_codec(const SceneDesc& scene, const SceneAsset& asset);

}  // namespace strandcast
