// How far a solver may be off in the tests, by the name of its row. What a server or a report needs to know
// of a model (its stretch, whether it comes to rest) is in the row itself.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "server/sim/solver_registry.h"

namespace strandcast {

struct SolverBounds {
  /// Lengths are exact too when both ends of a strand are held; only for rows with exact lengths.
  bool has_exact_held_length = true;
  /// How far the shape at rest of strands of 0.25 m may differ between substeps of 1/60 s and 1/240 s.
  double settled_spread_m = 5e-3;
  /// How many times as large a rounding may become within a step: constraints that are solved in turn pass it
  /// on, and segments under pressure fold to either side.
  double rounding_growth = 1.0;
  /// How far a rounding may move a strand whose segments are shorter than the way they are pushed along in a
  /// step: each push by a segment's length lets the angle to it grow e times, and rounding decides how the
  /// segment turns around. 0 = no more than rounding_growth says.
  double folding_spread_m = 0.0;
  /// How deep a vertex may end a step inside a collider.
  double collider_depth_m = 1e-6;
  /// Rounding of the segments' stiffness, which the whole strand takes part in: m per vertex count squared.
  double stiff_rounding_m = 0.0;
};

inline const std::map<std::string, SolverBounds>& solver_bounds() {
  static const std::map<std::string, SolverBounds> bounds = {
      {"dftl", {}},
      // Iterated placement leaves a rest; the finish shifts vertices after the last contact.
      {"dftl_parallel", {.has_exact_held_length = false, .collider_depth_m = 4e-3}},
      {"ftl", {}},
      // Stiffness per substep, so smaller ones make stiffer strands.
      {"pbd", {.settled_spread_m = 0.02, .rounding_growth = 1.6}},
      // What the iterations leave of the stretch differs.
      {"xpbd", {.settled_spread_m = 0.01, .rounding_growth = 2.2}},
      {"mass_spring", {}},
      // A tenth of stretch on strands of 0.25 m: smaller substeps leave less of it and hold the shape more
      // often.
      {"shape_constraints", {.settled_spread_m = 1.5 * 0.1 * 0.25, .rounding_growth = 1.6}},
      // 64 vertices in 0.25 m, a head that moves by two segments a step: measured 0.011 m after six steps.
      {"tractrix_emulation", {.folding_spread_m = 0.03}},
      {"tractrix_split", {}},
      {"tractrix_hybrid", {.settled_spread_m = 0.01, .rounding_growth = 2.2}},
      // Every sweep passes on a rounding; held at both ends, segments under pressure fold.
      {"angular_projection", {.rounding_growth = 1.2}},
      {"articulated", {}},
      // A penalty: 7e-5 m where a strand is thrown onto a collider. Few arcs touch a sphere at few points;
      // this is how near the others of its vertices come.
      {"super_helix", {.has_exact_held_length = false, .collider_depth_m = 1e-3}},
      // The matrix holds edges that are 3 n^2 times as stiff as a vertex is heavy: one rounding of the edge
      // is so much of the vertex's motion, here the length of a strand at most, at either end of the edge.
      {"direct_rod", {.stiff_rounding_m = 2.0 * 3.0 * 6e-8 * 0.25}},
  };
  return bounds;
}

/// A row that is missing here fails the test, with bounds that are as strict as any.
inline const SolverBounds& bounds_of(const SolverRow& row) {
  static const SolverBounds strictest;
  const auto found = solver_bounds().find(row.name);
  if (found != solver_bounds().end()) return found->second;
  ADD_FAILURE() << "tests/support/solver_bounds.h has no row for solver " << row.name;
  return strictest;
}

}  // namespace strandcast
