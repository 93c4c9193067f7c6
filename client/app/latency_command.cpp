#include "client/app/latency_command.h"

#include <iostream>

#include "client/app/ctl_commands.h"
#include "client/app/frame_trace.h"
#include "client/app/live_connection.h"
#include "client/app/view_options.h"
#include "common/base/file.h"
#include "common/base/units.h"
#include "common/kernels/step_speed.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

/// A folder that cannot be written to is better known before than after.
Status open_files(const LatencyOptions& options, FrameTrace& trace) {
  if (options.out.empty()) return {};
  std::error_code failure;
  std::filesystem::create_directories(options.out, failure);
  return trace.open(options.out / "frames.csv");
}

Status save(const LatencyOptions& options, FrameTrace& trace, const std::vector<StageTimes>& stages) {
  const std::string csv = to_csv(stages);
  RETURN_IF_ERROR(save_file(options.out / "latency.csv", std::as_bytes(std::span(csv))));
  return trace.close();
}

}  // namespace

int run_latency(const CtlTarget& target, const LatencyOptions& options, const std::atomic<bool>& stop) {
  auto config = client_config_for(target, Role::Viewer);
  if (!config) return ctl_failure(config.error(), kBadInputExit);
  const auto mode = parse_mode(options.mode);
  if (!mode) return ctl_failure(mode.error(), kBadInputExit);
  config->hello.mode = *mode;
  config->hello.step_ns = measured_step_ns();
  const auto trace = std::make_shared<FrameTrace>();
  if (const Status opened = open_files(options, *trace); !opened)
    return ctl_failure(opened.error(), kBadInputExit);
  const auto live = LiveConnection::open(*config);
  if (!live) return ctl_failure(live.error(), kBadInputExit);
  trace->want_states(true);
  (*live)->set_trace(trace);
  const int64_t end_ns = now_ns() + static_cast<int64_t>(options.seconds * kNsPerS);
  while (!stop && now_ns() < end_ns) {
    (*live)->pump(milliseconds(20));
    if ((*live)->final_error()) return ctl_failure(*(*live)->final_error(), kRefusedExit);
  }
  const std::vector<StageTimes> stages = stage_times(trace->frames());
  std::cout << to_table(stages);
  ViewerSession& session = (*live)->session();
  const ClockOffset clock = session.client().clock();
  std::cout << fmt::format(
      "clocks agree within {:.3f} ms; the server takes {:.2f} ms for a step and {:.2f} ms to encode\n",
      static_cast<double>(clock.error_ns()) * 1e-6, session.status().sim_ms, session.status().encode_ms);
  if ((*live)->outage_s() > 0.0)
    std::cout << fmt::format("reconnects {}, outage_s {:.1f}\n", (*live)->reconnects(), (*live)->outage_s());
  if (!options.out.empty()) {
    if (const Status saved = save(options, *trace, stages); !saved)
      return ctl_failure(saved.error(), kBadInputExit);
    std::cout << fmt::format("saved {} and {}\n", (options.out / "latency.csv").string(),
                             (options.out / "frames.csv").string());
  }
  if (trace->frames().empty())
    return ctl_failure(make_error(ErrorCode::Timeout, "no frame came in {:g} s", options.seconds),
                       kRefusedExit);
  return kDoneExit;
}

}  // namespace strandcast
