// StrandWriter: writes frames of strands to a file of some format, one by one, so that memory does not grow
// with the length of an export. One thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/export/export_options.h"
#include "client/export/strand_set.h"
#include "common/base/result.h"

namespace strandcast {

/// A frame in the file's units and axes.
struct ExportFrame {
  int64_t number = 0;                  // from ExportOptions::first_number on
  double time_s = 0.0;                 // simulated
  std::span<const glm::dvec3> points;  // strand after strand, root first
  Pose world_from_head = {};
};

struct WrittenBytes {
  uint64_t files = 0;
  uint64_t bytes = 0;
  std::filesystem::path last_path;
};

/// Returns the decimals of a coordinate in text: steps of kExportStepM or finer.
inline int export_decimals(double unit_m) {
  constexpr double kAlmost = 1e-6;
  return std::clamp(static_cast<int>(std::ceil(std::log10(unit_m / kExportStepM) - kAlmost)), 0, 9);
}

class StrandWriter {
 public:
  virtual ~StrandWriter() = default;
  virtual Status write(const ExportFrame& frame) = 0;
  /// Completes the file; nothing may be written afterwards.
  virtual Result<WrittenBytes> finish() = 0;
};

/// Names that `.usda` and `.usdc` share: version of Unreal's groom convention, schemas of the curve
/// physics.
inline constexpr int kUsdGroomMajor = 1, kUsdGroomMinor = 5;
inline constexpr const char* kUsdCurvesSchema = "PhysicsCurvesDeformableSimAPI";
inline constexpr const char* kUsdMaterialSchema = "PhysicsCurvesDeformableMaterialAPI";
inline constexpr const char* kUsdBindingSchema = "MaterialBindingAPI";
inline constexpr const char* kUsdBinding = "material:binding:physics";
/// Returns what hair is made of, as numbers of a material.
std::vector<std::pair<std::string, double>> usd_material(const StrandSet& strands);
std::string usd_description(const ExportOptions& options, const StrandSet& strands);

/// Make the writer of each format; the rest shape is written as the frame before the first. `strands` must
/// outlive them.
Result<std::unique_ptr<StrandWriter>> make_abc_writer(const ExportOptions& options, const StrandSet& strands);
Result<std::unique_ptr<StrandWriter>> make_usda_writer(const ExportOptions& options,
                                                       const StrandSet& strands);
Result<std::unique_ptr<StrandWriter>> make_usdc_writer(const ExportOptions& options,
                                                       const StrandSet& strands);  // .usdz, too
Result<std::unique_ptr<StrandWriter>> make_ply_writer(const ExportOptions& options, const StrandSet& strands);
Result<std::unique_ptr<StrandWriter>> make_csv_writer(const ExportOptions& options, const StrandSet& strands);

}  // namespace strandcast
