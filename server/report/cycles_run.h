// CyclesRun: truths by Blender's Cycles on the processors. Jobs are files in a folder, which one run of
// Blender reads (server/report/truth/cycles.py); what it draws comes back as cells. One thread.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/picture_size.h"
#include "common/groom/mesh.h"
#include "common/render/drawn_strands.h"
#include "common/scene/scene_desc.h"
#include "server/report/truth_views.h"

namespace strandcast {

struct CyclesSettings {
  std::string program = "blender";  // a path, or what PATH has
  std::filesystem::path script;
  uint32_t samples = 64;  // of a pixel
  uint32_t threads = 1;
};

/// What is drawn; strands and head turned as the world is, about the head's joint.
struct CyclesJob {
  std::string name;
  const SceneDesc* scene = nullptr;  // look and camera
  const DrawnStrands* strands = nullptr;
  const Mesh* head = nullptr;
  RenderSize size{kTruthWidthPx, kTruthHeightPx};
  uint32_t seed = 0;
  bool has_cover = true;  // its cover is wanted too
  uint32_t samples = 0;   // other than the settings'; 0: theirs
};

struct CyclesPicture {
  ViewTruth truth;
  double cpu_s = 0.0;  // of the processors, for the light alone
};

class CyclesRun {
 public:
  /// Begins an empty run in a folder, which is made.
  static Result<CyclesRun> make(const std::filesystem::path& folder, const CyclesSettings& settings);

  /// Writes the files of a job.
  Status add(const CyclesJob& job);
  /// Draws all jobs and waits. NotFound if the program does not start, Internal with its last words if it
  /// fails.
  Status run();
  /// Returns the picture of a job that was run; without a cover it has none.
  Result<CyclesPicture> picture(const std::string& name) const;

 private:
  struct Added {
    std::string name;
    RenderSize size;
    bool has_cover = false;
  };

  std::filesystem::path folder_;
  CyclesSettings settings_;
  std::vector<Added> added_;
  std::string jobs_;  // JSON, a job a line
};

}  // namespace strandcast
