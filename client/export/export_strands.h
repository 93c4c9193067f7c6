// export_strands: states of a source, resampled and written as a file for other programs. One thread, which
// it keeps until the end.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/export/export_options.h"
#include "client/export/export_source.h"
#include "common/base/result.h"

namespace strandcast {

struct ExportReport {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  uint64_t frame_count = 0;  // besides the rest shape
  double first_s = 0.0;      // simulated time of the first frame
  uint64_t file_count = 0;
  uint64_t bytes = 0;
  std::filesystem::path last_path;   // of the file, or the last of them
  std::vector<std::string> remarks;  // a sentence for each thing that a person should know
};

/// BadInput or Unsupported where the file's extension or a setting cannot be had; says what to do instead.
Status check_export(const ExportOptions& options);

/// Writes what the source gives until it ends, the range does or `stop` is set; what was written by then is
/// whole. Errors of the source count only while there is no frame; later they are remarks.
Result<ExportReport> export_strands(ExportSource& source, const ExportOptions& options,
                                    const std::atomic<bool>& stop);

}  // namespace strandcast
