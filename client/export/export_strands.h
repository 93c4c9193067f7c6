// export_strands: resamples the states of a source and writes them to a file for other programs. One thread,
// which it occupies until the end.
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
  double fps = 0.0;
  std::string first_timecode;  // of the first frame; empty: frames are not by timecode
  uint64_t file_count = 0;
  uint64_t bytes = 0;
  std::filesystem::path last_path;   // of the file, or the last of them
  std::vector<std::string> remarks;  // a sentence for each thing that a person should know
};

/// Checks the options. BadInput or Unsupported for a file extension or setting that is impossible; the error
/// names an alternative.
Status check_export(const ExportOptions& options);

/// Writes the states until the source or the range ends or `stop` is set; the file is complete up to then. An
/// error of the source is returned if there is no frame yet or only a whole file is wanted, else it is a
/// remark.
Result<ExportReport> export_strands(ExportSource& source, const ExportOptions& options,
                                    const std::atomic<bool>& stop);

}  // namespace strandcast
