// Options of the reports, and which command line option sets which. Parsing only: what a report makes of them
// is in its own files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "server/report/collision_study.h"
#include "server/report/pictures_study.h"
#include "server/report/pruning.h"
#include "server/report/recommend.h"
#include "server/report/rendering.h"
#include "server/report/scalp.h"
#include "server/report/stability.h"
#include "server/report/streaming.h"
#include "server/report/work_precision.h"

namespace CLI {
class App;
}

namespace strandcast {

struct CoherenceOptions {
  std::filesystem::path scene_path;  // empty: the built-in scene, here and below
  std::vector<std::string> overrides;
  std::filesystem::path out;  // folder for what is written, here and below
  ExecutorConfig device{"lanes", "auto", {}};
  bool is_quick = false;
  bool has_pictures = true;
};

struct CollisionOptions {
  std::filesystem::path scene_path;
  std::vector<std::string> overrides;
  std::filesystem::path out;
  ExecutorConfig device;
  CollisionStudyDesc desc;  // all but its scene
  bool is_quick = false;
};

struct PicturesOptions {
  std::filesystem::path scene_path;
  std::vector<std::string> overrides;
  std::filesystem::path out;
  PicturesDesc desc;  // all but its scratch folder and script
};

struct PruningOptions {
  std::filesystem::path scenes = "deploy/scenes";
  std::vector<std::string> only;  // names of scenes; empty: all
  std::vector<double> shares{0.5, 0.25, 0.125};
  std::filesystem::path out;
  ExecutorConfig device;
  int steps = PruningDesc().steps;
  bool has_pictures = true;
};

struct RenderingOptions {
  std::filesystem::path scene_path;
  std::vector<std::string> overrides;
  std::filesystem::path out;
  std::string size = "1280x720";
  RenderingReportDesc desc;  // all but its scene and size
};

struct ScalpOptions {
  std::filesystem::path scene_path;
  std::vector<std::string> overrides;
  std::filesystem::path motion_path;  // empty: the built-in walk
  MotionFileOptions motion_file;
  std::filesystem::path out;
  ExecutorConfig device;
  double seconds = ScalpRunDesc().seconds;
  double every_s = ScalpRunDesc().every_s;
};

struct VolumeReportOptions {
  std::filesystem::path scene_path;
  std::vector<std::string> overrides;
  std::filesystem::path out;
  ExecutorConfig device;
  uint32_t guides = 2'000;
  bool is_quick = false;
};

// Each adds the options of its command to `command`, which stores pointers into `options`.
/// Adds the options of strandcast-report coherence.
void declare_coherence(CLI::App& command, CoherenceOptions& options);
/// Adds the options of strandcast-report collisions.
void declare_collisions(CLI::App& command, CollisionOptions& options);
/// Adds the options of strandcast-report pictures.
void declare_pictures(CLI::App& command, PicturesOptions& options);
/// Adds the options of strandcast-report pruning.
void declare_pruning(CLI::App& command, PruningOptions& options);
/// Adds the options of strandcast-report recommend.
void declare_recommend(CLI::App& command, RecommendOptions& options);
/// Adds the options of strandcast-report rendering.
void declare_rendering(CLI::App& command, RenderingOptions& options);
/// Adds the options of strandcast-report scalp.
void declare_scalp(CLI::App& command, ScalpOptions& options);
/// Adds the options of strandcast-report stability.
void declare_stability(CLI::App& command, StabilityOptions& options);
/// Adds the options of strandcast-report streaming.
void declare_streaming(CLI::App& command, StreamingOptions& options);
/// Adds the options of strandcast-report volume.
void declare_volume(CLI::App& command, VolumeReportOptions& options);
/// Adds the options of strandcast-report work-precision.
void declare_work_precision(CLI::App& command, WorkPrecisionOptions& options);

}  // namespace strandcast
