// ViewReport: what a viewer measured, for people, for scripts and for tests. Pure text, any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/app/live_connection.h"

namespace strandcast {

/// One measured value; `text` is a plain number or word.
struct ReportEntry {
  std::string key;  // snake_case with its unit
  std::string text;
  bool is_number = true;
};
using ViewReport = std::vector<ReportEntry>;

/// What a report covers besides its session.
struct ReportScope {
  SessionTotals earlier;          // of the sessions before
  uint64_t reconnects = 0;        // how often the server was found again
  double outage_s = 0.0;          // without a connection
  std::optional<double> whole_s;  // from the first Welcome on; none: as long as the session
};
ReportScope scope_of(const LiveConnection& live);

/// Everything that was measured, without render times: counts of all sessions, medians of the last.
ViewReport make_report(ViewerSession& session, const ReportScope& scope = {});
/// In place of the server's reason.
void set_mode_reason(ViewReport& report, const std::string& reason);
/// Fills in the render times of a report.
void set_render_times(ViewReport& report, const StageTimer& render_timer);
/// Fills in how many pictures were made in which way between states, and which way most were.
void set_interpolation(ViewReport& report, uint64_t linear_count, uint64_t cubic_count);
/// Adds how long a window took from waking up (a key, say) to the picture that answers.
void add_answer_times(ViewReport& report, const StageTimer& answer_timer);

/// key=value lines.
std::string to_lines(const ViewReport& report);
/// One flat JSON object.
std::string to_json(const ViewReport& report);
/// Writes JSON when the file ends in .json, else key=value lines.
Status save_report(const std::filesystem::path& path, const ViewReport& report);

/// A short paragraph for the end of a run.
std::string to_summary(const ViewReport& report);

}  // namespace strandcast
