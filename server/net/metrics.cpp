#include "server/net/metrics.h"

namespace strandcast {

std::string format_metric(const std::string& name, const char* type, double value) {
  return fmt::format("# TYPE strandcast_{0} {1}\nstrandcast_{0} {2:.10g}\n", name, type, value);
}

std::string format_metrics(const NetCounters& counters) {
  struct Row {
    const char* name;
    uint64_t NetCounters::*field;
  };
  constexpr Row kGauges[] = {{"net_open_sessions", &NetCounters::open_sessions},
                             {"net_joined_sessions", &NetCounters::joined_sessions}};
  constexpr Row kTotals[] = {{"net_connections_total", &NetCounters::connections},
                             {"net_accept_errors_total", &NetCounters::accept_errors},
                             {"net_refused_full_total", &NetCounters::refused_full},
                             {"net_refused_token_total", &NetCounters::refused_token},
                             {"net_refused_rate_total", &NetCounters::refused_rate},
                             {"net_refused_tls_total", &NetCounters::refused_tls},
                             {"net_refused_http_total", &NetCounters::refused_http},
                             {"net_bad_messages_total", &NetCounters::bad_messages},
                             {"net_stalled_total", &NetCounters::stalled},
                             {"net_timeouts_total", &NetCounters::timeouts},
                             {"net_messages_received_total", &NetCounters::messages_received},
                             {"net_frames_sent_total", &NetCounters::frames_sent},
                             {"net_frames_dropped_total", &NetCounters::frames_dropped},
                             {"net_chain_losses_total", &NetCounters::chain_losses},
                             {"net_keyframe_requests_total", &NetCounters::keyframe_requests},
                             {"net_class_changes_total", &NetCounters::class_changes},
                             {"net_mode_changes_total", &NetCounters::mode_changes},
                             {"net_sent_bytes_total", &NetCounters::bytes_sent}};
  std::string text;
  for (const Row& row : kGauges)
    text += format_metric(row.name, "gauge", static_cast<double>(counters.*row.field));
  for (const Row& row : kTotals)
    text += format_metric(row.name, "counter", static_cast<double>(counters.*row.field));
  return text;
}

}  // namespace strandcast
