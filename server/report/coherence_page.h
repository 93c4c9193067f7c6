// The files of strandcast-report coherence: a table as CSV, plots and pictures on one page, and what it
// prints. Pure functions of a CoherenceStudy but for saving.
#pragma once

#include <filesystem>
#include <string>

#include "server/report/coherence_study.h"

namespace strandcast {

inline constexpr const char* kCoherencePage = "coherence.html";

/// The tables as text, for a terminal.
std::string coherence_text(const CoherenceStudy& study);
/// A line for each row of the shake.
std::string coherence_csv(const CoherenceStudy& study);
/// Incoherent share of each row, as bars.
std::string coherence_bars(const CoherenceStudy& study);
/// Incoherent share against processor time, a dot for each row.
std::string coherence_cost_plot(const CoherenceStudy& study);
/// Incoherent share over the time of the shake, of the main rows.
std::string coherence_time_plot(const CoherenceStudy& study);
std::string coherence_page(const CoherenceStudy& study);

Status save_coherence_study(const CoherenceStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
