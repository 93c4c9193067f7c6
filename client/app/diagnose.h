// strandcast-view --diagnose: checks what a session with a server needs and states remedies for what is
// missing. It examines this machine, connects like the viewer and watches for a moment.
#pragma once

#include <atomic>
#include <chrono>
#include <string>
#include <vector>

#include "client/app/view_options.h"

namespace strandcast {

enum class Finding { Ok, Note, Missing };  // Note: works, but a person may want to know

struct DiagnosisLine {
  Finding finding = Finding::Ok;
  std::string subject;  // "drawing", "server", "role"
  std::string text;
  std::string way_out;  // may be empty
};
using Diagnosis = std::vector<DiagnosisLine>;

/// Time limits: for the server's answer at each step of connecting, and for watching what it sends.
inline constexpr std::chrono::milliseconds kDiagnosisTimeout{3000};
inline constexpr std::chrono::milliseconds kDiagnosisWatch{1500};

/// Runs all checks, which takes some seconds; `stop` ends them early.
Diagnosis diagnose(const ViewOptions& options, const std::atomic<bool>& stop);
/// Returns whether nothing is missing.
bool would_work(const Diagnosis& diagnosis);
/// Formats a line per finding and a summary.
std::string to_text(const Diagnosis& diagnosis);

}  // namespace strandcast
