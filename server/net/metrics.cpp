#include "server/net/metrics.h"

namespace strandcast {
namespace {

struct Row {
  const char* name;
  const char* help;
  uint64_t NetCounters::*field;
};

constexpr Row kGauges[] = {
    {"net_open_sessions", "WebSocket sessions, joined or not.", &NetCounters::open_sessions},
    {"net_joined_sessions", "Sessions whose Hello was accepted.", &NetCounters::joined_sessions}};

constexpr Row kTotals[] = {
    {"net_connections_total", "TCP connections accepted.", &NetCounters::connections},
    {"net_accept_errors_total", "Connections that could not be accepted, for want of descriptors.",
     &NetCounters::accept_errors},
    {"net_refused_full_total", "Refused for want of a place.", &NetCounters::refused_full},
    {"net_refused_token_total", "Wrong tokens, and roles that a token is not good for.",
     &NetCounters::refused_token},
    {"net_refused_rate_total", "Too many connections of one address, and tokens after too many wrong ones.",
     &NetCounters::refused_rate},
    {"net_refused_tls_total", "Failed TLS handshakes, and requests without TLS.", &NetCounters::refused_tls},
    {"net_refused_http_total", "Wrong path, Host, Origin, request or PROXY header.",
     &NetCounters::refused_http},
    {"net_bad_messages_total", "Messages that were malformed, out of order, of a wrong role or too many.",
     &NetCounters::bad_messages},
    {"net_stalled_total", "Sessions dropped because they took or answered nothing.", &NetCounters::stalled},
    {"net_timeouts_total", "Connections without a Hello or request in time.", &NetCounters::timeouts},
    {"net_messages_received_total", "Messages of clients.", &NetCounters::messages_received},
    {"net_unknown_messages_total", "Messages of a kind that this version does not know, ignored.",
     &NetCounters::unknown_messages},
    {"net_frames_sent_total", "Media frames written whole.", &NetCounters::frames_sent},
    {"net_frames_dropped_total", "Media frames that a session was too slow for.",
     &NetCounters::frames_dropped},
    {"net_chain_losses_total", "Times that a session had to wait for a keyframe.",
     &NetCounters::chain_losses},
    {"net_keyframe_requests_total", "Keyframes asked for.", &NetCounters::keyframe_requests},
    {"net_class_changes_total", "Changes of a viewer's strand class or picture step.",
     &NetCounters::class_changes},
    {"net_codec_changes_total", "Changes of the codec of a viewer's strands.", &NetCounters::codec_changes},
    {"net_mode_changes_total", "Changes of a viewer between strands and frames.", &NetCounters::mode_changes},
    {"net_sent_bytes_total", "WebSocket payload written.", &NetCounters::bytes_sent}};

std::string head(std::string_view name, const char* type, const char* help) {
  return fmt::format("# HELP strandcast_{0} {2}\n# TYPE strandcast_{0} {1}\n", name, type, help);
}

}  // namespace

std::string label_value(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\' || c == '"' || c == '\n') result += '\\';
    result += c == '\n' ? 'n' : c;
  }
  return result;
}

std::string format_metric(std::string_view name, const char* type, const char* help, double value) {
  return head(name, type, help) + fmt::format("strandcast_{} {}\n", name, value);
}

std::string format_histogram(std::string_view name, const char* help, const Histogram& histogram) {
  std::string text = head(name, "histogram", help);
  uint64_t count = 0;
  for (size_t i = 0; i < Histogram::kBoundsMs.size(); ++i) {
    count += histogram.count(i);
    text += fmt::format("strandcast_{}_bucket{{le=\"{}\"}} {}\n", name, Histogram::kBoundsMs[i], count);
  }
  count += histogram.count(Histogram::kBoundsMs.size());
  return text +
         fmt::format(
             "strandcast_{0}_bucket{{le=\"+Inf\"}} {1}\nstrandcast_{0}_sum {2}\nstrandcast_{0}_count {1}\n",
             name, count, histogram.sum_ms());
}

std::string format_info(std::string_view name, const char* help,
                        std::initializer_list<std::pair<const char*, std::string>> labels) {
  std::string text;
  for (const auto& [label, value] : labels)
    text += fmt::format("{}{}=\"{}\"", text.empty() ? "" : ",", label, label_value(value));
  return head(name, "gauge", help) + fmt::format("strandcast_{}{{{}}} 1\n", name, text);
}

std::string format_build_info(const char* version) {
  return format_info("build_info", "Always 1; the label says which version runs.", {{"version", version}});
}

std::string format_metrics(const NetCounters& counters) {
  std::string text;
  for (const Row& row : kGauges)
    text += format_metric(row.name, "gauge", row.help, static_cast<double>(counters.*row.field));
  for (const Row& row : kTotals)
    text += format_metric(row.name, "counter", row.help, static_cast<double>(counters.*row.field));
  return text;
}

}  // namespace strandcast
