// Options of an export. Plain data.
#pragma once

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>

#include "common/base/frame_rate.h"
#include "common/base/timecode.h"

namespace strandcast {

enum class ExportUp { Y, Z };
enum class ExportSpace { Head, World };
/// What Unreal uses the curves for.
enum class ExportRole {
  Strands,    // hair that is drawn
  Guides,     // hair that drives other hair
  Followers,  // simulated strands are guides, and those that are drawn between them are hair
};

struct ExportOptions {
  std::filesystem::path path;  // .usda, .usdc, .usdz, .abc, .ply or .csv
  FrameRate fps;               // without has_fps: that of the states' timecode, if they carry one
  bool has_fps = false;
  double unit_m = 0.01;  // metres per unit of the file
  ExportUp up = ExportUp::Y;
  /// From the space to the file's points, for unit and axis too; empty: as these two say.
  std::optional<glm::dmat4> file_from_space = {};
  ExportSpace space = ExportSpace::Head;
  ExportRole role = ExportRole::Strands;
  double from_s = 0.0;         // after the first state
  std::optional<double> to_s;  // likewise; empty: to the last state
  // Instead of seconds; empty: these. With from_timecode alone to_s counts from there.
  std::string from_timecode = {}, to_timecode = {};
  int64_t first_number = 1;   // of the first frame: frames since midnight, where states carry timecode
  bool has_head = false;      // the head as a mesh, too; not for .csv
  bool is_one_frame = false;  // the one at from_s, without the rest shape (.ply)
  bool is_whole = false;      // all frames of the range or no file: an error of the source ends it
  bool is_quiet = false;      // no progress on standard error
};

}  // namespace strandcast
