// Loads head motion from a user's file, and judges its frames, with sentences that state the assumptions
// made. Feeder, bake and reports use it. Any thread.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/motion/bvh.h"

namespace strandcast {

/// Options of loading, with the names of the matching command line options.
struct MotionFileOptions {
  double unit_m = 0.0;                        // --unit; 0 = guessed
  std::string up;                             // --up: y or z; empty = guessed
  std::string joint;                          // --joint; empty = found by name
  double fps = 0.0;                           // --fps, --motion-fps: of a file that states none; 0 = refused
  bool has_body = false;                      // joints of the body too, as far as their names are known
  std::vector<std::string> body_joints = {};  // --body-joint: these besides
  bool is_filtering_glitches = false;         // --filter-glitches
  bool is_keeping_first_frames = false;       // --keep-first-frames
  std::string prefix = "--";                  // of the names of unit and up, as a person gives them
};

struct MotionFile {
  MotionClip clip;
  std::vector<std::string> notes;     // each begins with the file's name
  std::vector<std::string> unlikely;  // those of them that no head or body fits: a check refuses these
};

/// Leaves out frames before the motion and filters glitches, as the options say, of whatever file the clip
/// came from. Adds sentences. Returns the number of frames that were left out.
uint32_t judge_frames(MotionFile& file, const std::string& name, const MotionFileOptions& options);

/// Loads a file. Returns the errors of load_bvh(), and BadInput for an unknown axis.
Result<MotionFile> load_motion_file(const std::filesystem::path& path, const MotionFileOptions& options);

}  // namespace strandcast
