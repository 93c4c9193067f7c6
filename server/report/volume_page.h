// The files of strandcast-report volume: tables as CSV, plots, and one page. Pure functions of a VolumeStudy
// but for saving.
#pragma once

#include <filesystem>
#include <string>

#include "server/report/volume_study.h"

namespace strandcast {

inline constexpr const char* kVolumePage = "volume.html";

/// What to pick, in some sentences.
std::string volume_summary(const VolumeStudy& study);

std::string volume_error_csv(const VolumeStudy& study);
std::string volume_scatter_csv(const VolumeStudy& study);
std::string volume_outcome_csv(const VolumeStudy& study);
/// Error of the density against the time of a step, a line for each number of smoothings and who is asked.
std::string volume_plot(const VolumeStudy& study);
std::string volume_page(const VolumeStudy& study);

Status save_volume_study(const VolumeStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
