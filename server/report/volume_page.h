// Files of strandcast-report volume: CSV tables, plots and one page. Pure functions of a VolumeStudy, except
// saving.
#pragma once

#include <filesystem>
#include <string>

#include "server/report/volume_study.h"

namespace strandcast {

inline constexpr const char* kVolumePage = "volume.html";

/// Returns a recommendation in some sentences.
std::string volume_summary(const VolumeStudy& study);

std::string volume_error_csv(const VolumeStudy& study);
std::string volume_scatter_csv(const VolumeStudy& study);
std::string volume_outcome_csv(const VolumeStudy& study);
/// Returns a plot of density error against the time of a step, with a line per number of smoothings and
/// choice of hairs.
std::string volume_plot(const VolumeStudy& study);
std::string volume_page(const VolumeStudy& study);

Status save_volume_study(const VolumeStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
