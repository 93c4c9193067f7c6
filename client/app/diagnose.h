// strandcast-view --diagnose: what a session with a server needs, what of it is here, and the way out for
// what is missing. Looks at this machine, then connects as the viewer would and watches for a moment.
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

/// For a server's answer, at each step of connecting; and how long what it sends is watched.
inline constexpr std::chrono::milliseconds kDiagnosisTimeout{3000};
inline constexpr std::chrono::milliseconds kDiagnosisWatch{1500};

/// Takes some seconds at most; `stop` ends it early.
Diagnosis diagnose(const ViewOptions& options, const std::atomic<bool>& stop);
/// Whether nothing is missing.
bool would_work(const Diagnosis& diagnosis);
/// A line for each, and one that sums up.
std::string to_text(const Diagnosis& diagnosis);

}  // namespace strandcast
