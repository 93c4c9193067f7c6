// Pictures of hair that the report holds against a path tracer: where from, which hair, which light. A truth
// is kept for each in server/report/truth: light and cover by cells, and strands in motion. Any thread.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/strands/scene_asset.h"
#include "common/strands/snapshot.h"
#include "server/report/picture_measure.h"

namespace strandcast {

struct TruthView {
  std::string camera;
  std::string color;  // of hair, with "wet " before it where it is wet
  std::string light;
  std::string pose = "rest";  // "rest", "walk", "shake"
  bool is_fitted = false;     // shading may be fitted to it; the others are held out

  std::string name() const;
  /// Returns the name of what this view covers, which colour and light do not change.
  std::string cover_name() const { return camera + "_" + pose; }
  /// Returns the fields of a scene that make the view.
  std::vector<std::string> overrides() const;
};
const std::vector<TruthView>& truth_views();

/// Pixels of a truth, a multiple of the cell's.
inline constexpr uint32_t kTruthWidthPx = 320;
inline constexpr uint32_t kTruthHeightPx = 240;

/// A truth's light over nothing, premultiplied, and what covers its cells.
struct ViewTruth {
  LightCells light;
  CoverCells cover;
};

/// Returns the folder of kept truths: of the sources this program was built from, or installed beside it.
std::filesystem::path default_truth_folder();
/// Load and keep what belongs to a view, in 16-bit PNG of linear light over kMostLight. Light above is cut.
inline constexpr float kMostLight = 8.0f;
Result<ViewTruth> load_truth(const std::filesystem::path& folder, const TruthView& view);
Status keep_truth(const std::filesystem::path& folder, const TruthView& view, const ViewTruth& truth);

/// Loads strands in motion, as the codec `tangent` keeps them, of the built-in scene's asset.
Result<std::shared_ptr<const Snapshot>> load_pose(const std::filesystem::path& folder,
                                                  const std::string& pose, const SceneAsset& asset);
/// Simulates the built-in scene under a built-in motion, step by step on the processors, and keeps the state.
Status keep_pose(const std::filesystem::path& folder, const std::string& pose);

}  // namespace strandcast
