// The performance tables of Zappe 2020 (tractrix hair) and Woodhouse 2017 (hair on OpenGL), in
// their own form: the same sets and components in the same order, their numbers as cited beside ours.
#pragma once

#include <filesystem>
#include <string>

#include "common/gl/egl_context.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

struct ThesisOptions {
  int steps = 60;
  std::filesystem::path mohawk;         // Ratboy_mohawk.tfx; empty: a groom of the same size
  std::filesystem::path naive_shaders;  // folder of naive_*.comp
  std::filesystem::path scene;          // of 242 strands x 8 vertices, for the drawing
  gl::DeviceInfo device;                // of the current context
};

/// Prints, with a current context: the executor's where it has one. Lines for a CSV file are appended to
/// `csv` (section, set, model, measure, value).
Status print_tables_of_zappe(const ThesisOptions& options, Executor& executor, std::string& csv);
Status print_tables_of_woodhouse(const ThesisOptions& options, Executor& executor, std::string& csv);

}  // namespace strandcast
