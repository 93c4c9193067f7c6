// Motions that codec_bench measures codecs on, recorded once so that every codec gets the same: the codec
// tests' own chains, and scenes as the server runs them (head motion, gusts, a strand model in double
// precision, publishing), the head moved by the built-in motion or by motion capture.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/strands/snapshot.h"
#include "tests/support/hair_motion.h"

namespace strandcast {

/// Consecutive states at 60 Hz on a lattice much finer than any bound.
struct Recording {
  std::vector<glm::vec3> rest_in_head_m;  // (vertex_count x strand_count), strand fastest
  std::vector<Snapshot> states;
};

/// A state on a lattice of another step.
Snapshot on_lattice(const Snapshot& state, float quantum_m);

/// `warm_up` steps that are not recorded, then `count` that are.
struct RecordedSpan {
  int warm_up = 60;
  int count = 120;
};

Recording record_chains(const HairMotionDesc& desc, const RecordedSpan& part);

/// A scene of procedural hair in the built-in breeze.
struct SimulatedMotion {
  std::string solver;
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::filesystem::path clip;  // .bvh; empty: the built-in head motion
  double clip_begin_s = 0.0;
};

/// Errors name the clip.
Result<Recording> record_simulation(const SimulatedMotion& motion, const RecordedSpan& part);

}  // namespace strandcast
