// Files of strandcast-report coherence: CSV table, page with plots and pictures, and printed text. Pure
// functions of a CoherenceStudy, except saving.
#pragma once

#include <filesystem>
#include <string>

#include "server/report/coherence_study.h"

namespace strandcast {

inline constexpr const char* kCoherencePage = "coherence.html";

/// Returns the tables as text for a terminal.
std::string coherence_text(const CoherenceStudy& study);
/// Returns a CSV line for each row of the shake.
std::string coherence_csv(const CoherenceStudy& study);
/// Returns a bar chart of the incoherent share of each row.
std::string coherence_bars(const CoherenceStudy& study);
/// Returns a plot of the incoherent share against processor time, a dot per row.
std::string coherence_cost_plot(const CoherenceStudy& study);
/// Returns a plot of the incoherent share over the time of the shake, a line per main row of the study.
std::string coherence_time_plot(const CoherenceStudy& study);
std::string coherence_page(const CoherenceStudy& study);

Status save_coherence_study(const CoherenceStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
