// The body's part of collider_bench: its four responses beside a step without a body.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"

namespace strandcast {

struct BodyBenchOptions {
  std::filesystem::path clip;  // .bvh with the usual joints
  std::string strands, vertices, solver, device;
  int steps = 300;
  int rest = 1200;
  std::filesystem::path picture;  // of the response "turn", a row of moments from the front and from the left
};

/// Hair of 35 cm on a ball that moves as the clip's head does, above the clip's neck, chest, shoulders and
/// arms. Prints for each response: CPU time, how deep vertices and middles are (most and 99 %), how far off
/// lengths are, rms speed at rest, and how far a belt carries strands of 0.5 m way by a friction of 1.
Status run_body_bench(const BodyBenchOptions& options);

}  // namespace strandcast
