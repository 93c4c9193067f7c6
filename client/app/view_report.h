// ViewReport: a viewer's measurements for people, scripts and tests. Pure text, any thread.
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

/// Reports everything that was measured, except render times: counts of all sessions, medians of the last.
ViewReport make_report(ViewerSession& session, const ReportScope& scope = {});
/// Replaces the reason of the mode, which by default is the server's.
void set_mode_reason(ViewReport& report, const std::string& reason);
/// Adds the render times to a report.
void set_render_times(ViewReport& report, const StageTimer& render_timer);
/// Adds how many pictures were interpolated linearly and cubically, and the more frequent kind.
void set_interpolation(ViewReport& report, uint64_t linear_count, uint64_t cubic_count);
/// Adds the time from a window's waking up (for example by a key) to the picture that answers.
void add_answer_times(ViewReport& report, const StageTimer& answer_timer);

/// Formats key=value lines.
std::string to_lines(const ViewReport& report);
/// Formats one flat JSON object.
std::string to_json(const ViewReport& report);
/// Writes JSON if the file's name ends in .json, otherwise key=value lines.
Status save_report(const std::filesystem::path& path, const ViewReport& report);

/// Formats a short paragraph for the end of a run.
std::string to_summary(const ViewReport& report);

}  // namespace strandcast
