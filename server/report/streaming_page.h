// Files of a streaming report: streaming.csv, three plots and one page. Any thread.
#pragma once

#include <filesystem>
#include <string>

#include "server/report/html_page.h"
#include "server/report/streaming.h"

namespace strandcast {

inline constexpr const char* kStreamingCsv = "streaming.csv";
inline constexpr const char* kStreamingPage = "streaming.html";

std::string streaming_csv(const StreamingReport& report);
/// Return plots at the first size: bits against the bound, bits against time, bits of each motion.
std::string streaming_bound_plot(const StreamingReport& report);
std::string streaming_time_plot(const StreamingReport& report);
std::string streaming_motion_plot(const StreamingReport& report);
std::string streaming_page(const StreamingReport& report);
/// Returns the goals with their verdicts for a terminal.
std::string streaming_summary(const StreamingReport& report);

/// Writes everything into the folder.
Status save_streaming(const StreamingReport& report, const std::filesystem::path& folder);

/// Returns Mbit/s and milliseconds of both sides, at the goals' bound, of each of our codecs and of the best
/// peers. For the built-in scene and the largest number of vertices, in the first recording of each class.
HtmlTable needs_table(const StreamingReport& report);
/// Returns every codec beside the others, at the goals' bound: bits, Mbit/s of more and fewer strands,
/// milliseconds, and how many strands a phone's browser has time for. Of walking at the largest size.
HtmlTable reach_table(const StreamingReport& report);
/// Returns the conclusion in words: the codec with the fewest bits.
std::string needs_text(const StreamingReport& report);
/// Returns bits per vertex by bound, of every clip, part, strand model, codec of ours and wind, at the first
/// size.
HtmlTable case_table(const StreamingReport& report);
/// Returns which clips were available.
std::string clips_text(const StreamingReport& report);

}  // namespace strandcast
