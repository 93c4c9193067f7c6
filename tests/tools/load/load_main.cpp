// strandcast-load: many viewers at once against a running server; prints what they saw, as key=value lines.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string_view>

#include "client/app/stop_signal.h"
#include "client/net/http_get.h"
#include "common/base/profile.h"
#include "common/base/quantile.h"
#include "common/base/text.h"
#include "common/client/client_token.h"
#include "common/kernels/step_speed.h"
#include "tests/tools/load/load_options.h"
#include "tests/tools/load/load_viewers.h"

namespace {

using namespace strandcast;
using namespace strandcast::load;

constexpr int64_t kWatchMs = 100;  // how often stops and the server's process are looked at

/// Resident memory, KiB, and open file descriptors of a process; zeros when it cannot be seen.
struct ProcessState {
  double rss_kib = 0.0;
  size_t descriptors = 0;
};
ProcessState process_state(int pid) {
  ProcessState state;
  if (pid == 0) return state;
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string text; std::getline(status, text);)
    if (text.starts_with("VmRSS:")) state.rss_kib = std::stod(text.substr(6));
  std::error_code error;
  for (std::filesystem::directory_iterator item(fmt::format("/proc/{}/fd", pid), error), end;
       !error && item != end; item.increment(error))
    ++state.descriptors;
  return state;
}

void print(const char* key, double value) {
  std::cout << fmt::format("{}={:.3f}\n", key, value);
}

/// The server's own counters, "strandcast_" replaced by "server_".
void print_metrics(const Address& address, const HttpAccess& access) {
  const auto answer = http_get(address, "/metrics", std::chrono::seconds(5), access);
  if (!answer) return;
  constexpr std::string_view kPrefix = "strandcast_";
  constexpr size_t kMaxShownChars = 200;
  std::istringstream lines(answer->body);
  for (std::string raw; std::getline(lines, raw);) {
    const std::string text = one_line(raw, kMaxShownChars);
    const size_t space = text.find(' ');
    if (text.starts_with("#") || space == std::string::npos) continue;
    const size_t begin = text.starts_with(kPrefix) ? kPrefix.size() : 0;
    std::cout << "server_" << text.substr(begin, space - begin) << '=' << text.substr(space + 1) << '\n';
  }
}

void print_measures(const LoadMeasures& measures, size_t viewers, double seconds) {
  print("frames_per_s_and_viewer",
        static_cast<double>(measures.frames) / seconds / static_cast<double>(std::max<size_t>(viewers, 1)));
  print("mbit_per_s", static_cast<double>(measures.bytes) * 8e-6 / seconds);
  print("keyframes", static_cast<double>(measures.keyframes));
  print("chain_errors", static_cast<double>(measures.chain_errors));
  print("quality_changes", static_cast<double>(measures.quality_changes));
  print("newest_strand_share", static_cast<double>(measures.newest_quality.strand_share));
  print("newest_rate_divisor", measures.newest_quality.rate_divisor);
  print("newest_bound_mm", static_cast<double>(measures.newest_quality.bound_m) * 1e3);
  print("newest_quality_after_ms", static_cast<double>(measures.newest_quality_ms));
  print("joined", static_cast<double>(measures.joined));
  for (const auto& [codec, count] : measures.joined_by_codec)
    std::cout << fmt::format("joined_by_{}={}\n", one_line(codec, kMaxNameChars), count);
  print("ended_by_server", static_cast<double>(measures.ended));
  for (const auto& [code, count] : measures.close_codes)
    std::cout << fmt::format("close_{}={}\n", code, count);
  if (!measures.last_goodbye.empty()) std::cout << "last_goodbye=" << measures.last_goodbye << '\n';
  for (const auto& [name, values] :
       {std::pair{"interval", &measures.interval_ms}, {"latency", &measures.latency_ms}})
    for (const auto& [label, share] : {std::pair{"p50", 0.5}, {"p95", 0.95}, {"p99", 0.99}, {"max", 1.0}})
      std::cout << fmt::format("{}_ms_{}={:.3f}\n", name, label, quantile(*values, share));
}

Status join_all(LoadViewers& viewers, const LoadOptions& options) {
  const auto join = [&](uint32_t count, ViewerPlan plan) -> Status {
    for (uint32_t i = 0; i < count; ++i) {
      ASSIGN_OR_RETURN([[maybe_unused]] const uint64_t number, viewers.join(plan));
      viewers.run_for(1);
    }
    return {};
  };
  RETURN_IF_ERROR(join(options.stalled_viewers, {StreamMode::Strands, true, false}));
  RETURN_IF_ERROR(join(options.silent_viewers, {StreamMode::Strands, false, true}));
  RETURN_IF_ERROR(join(options.frame_viewers, {StreamMode::Frames, true, true}));
  return join(options.viewers, {});
}

Status run(LoadOptions options) {
  ASSIGN_OR_RETURN(Address address, parse_address(options.connect));
  address.is_tls = address.is_tls || options.is_tls || !options.tls_authorities.empty();
  if (!options.token_file.empty()) {
    ASSIGN_OR_RETURN(options.token, load_token(options.token_file, Role::Viewer));
  }
  const std::atomic<bool>& stop = catch_stop_signals();
  std::optional<Encryption> encryption;
  if (address.is_tls) encryption = Encryption{options.tls_authorities};
  LoadViewers viewers(
      {address.host, address.port, options.token, encryption, measured_step_ns(), address.folder()});
  RETURN_IF_ERROR(join_all(viewers, options));
  for (const int64_t begin_ns = now_ns();
       !stop && static_cast<double>(now_ns() - begin_ns) * 1e-9 < options.warm_up_s;)
    viewers.run_for(std::min<int64_t>(kWatchMs, static_cast<int64_t>(options.warm_up_s * 1e3)));
  if (viewers.measures().joined == 0)
    return make_error(
        ErrorCode::Unavailable, "nobody was let in by {}: {}", address.to_string(),
        viewers.measures().last_goodbye.empty() ? "no answer" : viewers.measures().last_goodbye);
  viewers.reset_measures();

  const int64_t begin_ns = now_ns();
  const auto elapsed_s = [&] { return static_cast<double>(now_ns() - begin_ns) * 1e-9; };
  const ProcessState first = process_state(options.server_pid);
  ProcessState most = first;
  uint64_t turns = 0;
  while (!stop && elapsed_s() < options.seconds && viewers.open_count() > 0) {
    viewers.run_for(options.churn_ms > 0 ? options.churn_ms : kWatchMs);
    const ProcessState now = process_state(options.server_pid);
    most.rss_kib = std::max(most.rss_kib, now.rss_kib);
    most.descriptors = std::max(most.descriptors, now.descriptors);
    if (options.churn_ms == 0) continue;
    viewers.leave(viewers.oldest(), ++turns % 2 == 0);
    ASSIGN_OR_RETURN([[maybe_unused]] const uint64_t number, viewers.join({}));
  }
  const ProcessState last = process_state(options.server_pid);
  std::cout << "viewers_open=" << viewers.open_count() << '\n';
  print_measures(viewers.measures(), viewers.open_count(), elapsed_s());
  if (options.server_pid != 0) {
    print("server_rss_mib_first", first.rss_kib / 1024.0);
    print("server_rss_mib_most", most.rss_kib / 1024.0);
    print("server_rss_mib_last", last.rss_kib / 1024.0);
    print("server_descriptors_first", static_cast<double>(first.descriptors));
    print("server_descriptors_most", static_cast<double>(most.descriptors));
    print("server_descriptors_last", static_cast<double>(last.descriptors));
  }
  if (!stop) print_metrics(address, {options.tls_authorities, options.token});
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Strandcast load: many viewers against a running server, and what they saw.",
               "strandcast-load");
  LoadOptions options;
  declare_load(app, options);
  CLI11_PARSE(app, argc, argv);
  if (const Status status = run(options); !status) {
    std::cerr << "strandcast-load: " << status.error().to_string() << '\n';
    return 2;
  }
  return 0;
}
