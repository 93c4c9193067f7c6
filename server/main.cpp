// strandcast-server: reads the command line, serves until a signal. Exit code 0 after a clean stop, 1 where
// the simulation failed or a recording is not whole, 2 for bad input.
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <optional>
#include <thread>

#include "common/base/file.h"
#include "common/base/output_file.h"
#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/client/client_token.h"
#include "common/groom/groom_asset.h"
#include "common/log/line_writer.h"
#include "common/log/log.h"
#include "common/scene/scene_file.h"
#include "server/app/codec_choice.h"
#include "server/app/explain.h"
#include "server/app/groom_check.h"
#include "server/app/live_manager.h"
#include "server/app/options.h"
#include "server/app/server_passes.h"
#include "server/app/service_manager.h"
#include "server/app/viewer_codec.h"
#include "server/net/token_file.h"
#include "server/record/replay.h"
#include "server/relay/relay.h"

namespace strandcast {
namespace {

constexpr int kExitBadInput = 2;
constexpr int kExitFailure = 1;
constexpr int kExitEarly = 0;  // somebody wanted it to end
constexpr long kPollNs = 100'000'000;
/// Between two looks at what a service manager is told.
constexpr int64_t kServiceNs = 500'000'000;

/// Where nobody reads, the program ends all the same.
void tell(std::string_view sentence) {
  LineWriter(STDERR_FILENO).write(fmt::format("strandcast-server: {}\n", sentence));
}

int fail(const Error& error) {
  tell(error.to_string());
  return kExitBadInput;
}

/// Those that stop the server, and SIGHUP, which means that files are to be read again.
sigset_t handled_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGHUP);
  return signals;
}

/// Ends the program at a signal that comes before the server has begun to wait for them: a scene takes long
/// to be built, and a pipe is read for ever.
class EarlyEnd {
 public:
  EarlyEnd() : thread_([this] { run(); }) {}
  ~EarlyEnd() { stop(); }
  EarlyEnd(const EarlyEnd&) = delete;
  EarlyEnd& operator=(const EarlyEnd&) = delete;

  /// From now on signals wait for somebody else.
  void stop() {
    is_over_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    const timespec poll{0, kPollNs / 5};
    while (!is_over_) {
      if (sigtimedwait(&signals, nullptr, &poll) < 0) continue;
      tell("stopped before it served");
      std::_Exit(kExitEarly);
    }
  }

  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

int explain_head(const ServerOptions& options, ServerConfig config) {
  const Result<SceneContent> content = load_scene_content(config.scene);
  if (!content) return fail(content.error());
  RuntimeFacts facts;
  facts.strand_viewers = 1;
  facts.frame_viewers = options.explained_frame_viewers;
  const SceneAsset asset = make_scene_asset(content->groom, content->head);
  const auto choice =
      choose_codec(config.scene, asset, {config.sim_device, config.gl_device, config.shader_folder});
  if (!choice) return fail(choice.error());
  config.scene.stream.codec = choice->codec;
  auto measured =
      measure_passes(config.scene, *content, facts,
                     {config.sim_device, config.gl_device, config.renderer, config.shader_folder});
  const std::optional<Error> unmeasured = measured ? std::nullopt : std::optional(measured.error());
  if (unmeasured && unmeasured->code == ErrorCode::Unavailable) {
    auto planned = plan_server(config.scene, asset, facts);
    if (!planned) return fail(planned.error());
    measured = Measured{{}, std::move(planned).value()};
  }
  if (!measured) return fail(measured.error());
  const auto notes = explain_groom(config.scene, content->groom);
  if (!notes) return fail(notes.error());
  const auto text = explain_scene(config.scene, asset, facts, *measured, *notes);
  if (!text) return fail(text.error());
  const auto codec = strand_codec_info(choice->codec);
  if (!codec) return fail(codec.error());
  const auto served = served_codecs(*codec, config.scene.stream.bound_m);
  if (!served) return fail(served.error());
  fmt::print("{}{}\n{}\n", *text, choice->reason, explain_viewer_codecs(*served));
  const auto inputs = explain_live(config.scene.live, config.live_allowed);
  if (!inputs) return fail(inputs.error());
  if (!inputs->empty()) fmt::print("\nLive inputs\n");
  for (const std::string& input : *inputs) fmt::print("  {}\n", input);
  if (unmeasured) fmt::print("Times were not measured: {}\n", unmeasured->to_string());
  return 0;
}

int explain_command(const ServerOptions& options, const ServerConfig& config) {
  if (config.scene.heads.empty()) return explain_head(options, config);
  std::vector<SceneDesc> scenes = config.scene.heads;
  scenes.insert(scenes.begin(), config.scene);
  scenes.front().heads.clear();
  for (const SceneDesc& scene : scenes) {
    ServerConfig of_head = config;
    of_head.scene = scene;
    fmt::print("Head '{}':\n", scene.name);
    if (const int code = explain_head(options, of_head); code != 0) return code;
  }
  return 0;
}

int check_command(const ServerOptions& options, const ServerConfig& config) {
  if (!config.scene.heads.empty())
    return fail(make_error(ErrorCode::Unsupported,
                           "--check draws the hair of one head, and this scene has {}: name a hair file "
                           "without it (--check FILE), or a scene of that head alone",
                           config.scene.heads.size() + 1));
  const auto text = check_groom(config.scene, options.check_folder,
                                {config.sim_device, config.gl_device, config.renderer, config.shader_folder},
                                [](const std::string& sentence) { tell(sentence); });
  if (!text) return fail(text.error());
  fmt::print("{}", *text);
  return 0;
}

std::atomic<bool> is_replay_stopped{false};

int replay_command(const ServerOptions& options) {
  const ServerConfig& server = options.config;
  ReplayConfig config;
  config.recording = options.replay_path;
  config.device = {server.sim_device, server.gl_device, server.shader_folder};
  config.pace = options.replay_pace;
  config.on_note = [](const std::string& sentence) { tell(sentence); };
  config.on_progress = [](const ReplayProgress& progress) {
    tell(progress.recorded > 0
             ? fmt::format("step {}: {} of {} states compared", progress.tick, progress.compared,
                           progress.recorded)
             : fmt::format("step {}: {} states compared", progress.tick, progress.compared));
  };
  config.stop = &is_replay_stopped;
  const auto stop = [](int) { is_replay_stopped = true; };
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  const auto result = replay_recording(config);
  if (!result) return fail(result.error());
  fmt::print("{}: {} ({:.1f} s)\n", options.replay_path.string(), to_sentence(*result), result->seconds);
  return result->is_equal() ? 0 : kExitFailure;
}

Status write_port(const std::filesystem::path& path, uint16_t port) {
  if (path.empty()) return {};
  const std::string text = fmt::format("{}\n", port);
  return save_file(path, std::as_bytes(std::span(text)));
}

/// From all lines on standard error.
void hide(const std::vector<AccessToken>& tokens) {
  std::vector<std::string> secrets;
  for (const AccessToken& token : tokens) secrets.push_back(token.secret);
  hide_in_lines(secrets);
}

/// The tokens of the file; new ones are shown on the terminal, this once.
Result<std::vector<AccessToken>> load_tokens(const ServerOptions& options) {
  if (options.token_path.empty()) return std::vector<AccessToken>{};
  ASSIGN_OR_RETURN(TokenFile file, open_token_file(options.token_path));
  hide(file.tokens);
  if (file.is_new) {
    fmt::print("New tokens, stored in {} and shown this once:\n{}", options.token_path.string(),
               to_text(file.tokens));
    std::fflush(stdout);  // whatever becomes of the start
  }
  return std::move(file.tokens);
}

template <class Served>
void reload_tokens(Served& server, const std::filesystem::path& path) {
  std::error_code failure;
  // Tokens that nobody saw would be made anew where the file is gone.
  if (!std::filesystem::exists(path, failure))
    return log_error("app", "the old tokens stay: there is no file {}", path.string());
  auto file = open_token_file(path);
  if (file) hide(file->tokens);
  const Status status = file ? server.set_tokens(std::move(file->tokens)) : Status(file.error());
  if (!status) return log_error("app", "the old tokens stay: {}", status.error().to_string());
  log_info("app", "tokens read again: who joins needs one of them, and sessions without one end");
}

template <class Served>
void reload_certificate(Served& server) {
  if (const Status status = server.reload_tls(); !status)
    return log_error("app", "the old certificate stays: {}", status.error().to_string());
  log_info("app", "certificate read again");
}

template <class Served>
void reload(Served& server, const ServerOptions& options, const NetConfig& net) {
  if (!options.token_path.empty()) reload_tokens(server, options.token_path);
  if (net.tls) reload_certificate(server);
  if (!net.tls && options.token_path.empty())
    log_info("app", "SIGHUP: there is no certificate and no token file that could be read again");
}

/// What a service manager is told.
struct ServiceState {
  uint32_t viewers = 0;
  int64_t busy_ns = 0;
};
ServiceState state_of(const Server& server) {
  const ServerCounters counters = server.counters();
  return {counters.viewers, counters.sim.busy_ns};
}
/// A relay that waits for its server does well.
ServiceState state_of(const Relay& relay) {
  return {relay.viewer_count(), 0};
}

std::string service_status(const std::string& title, uint32_t viewers) {
  return fmt::format("{}, {} viewer{}", title, viewers, viewers == 1 ? "" : "s");
}

/// Tells the service manager how it goes, now and again.
template <class Served>
void tell_service(ServiceManager& service, const Served& server, const std::string& title, int64_t& told_ns) {
  const int64_t time_ns = now_ns();
  if (!service.is_there() || time_ns - told_ns < kServiceNs) return;
  told_ns = time_ns;
  const ServiceState state = state_of(server);
  service.tell_status(service_status(title, state.viewers));
  service.beat(time_ns, state.busy_ns);
}

/// A port that was opened for the server goes before the one of the command line.
Status use_passed_socket(NetConfig& net) {
  ASSIGN_OR_RETURN(const auto passed, take_passed_socket());
  if (!passed) return {};
  net.socket = passed->descriptor;
  net.address = passed->address;
  net.port = passed->port;
  return {};
}

/// Runs what has started until a signal, the end of the time or a failure. `what`: for people, and whose.
template <class Served>
int run_until_end(Served& server, const ServerOptions& options, const NetConfig& net, const std::string& what,
                  ServiceManager& service) {
  const sigset_t signals = handled_signals();
  if (const Status status = write_port(options.port_path, server.port()); !status)
    return fail(status.error());
  const std::string title = fmt::format("{} on {} port {}", what, net.address, server.port());
  fmt::print("{}\n", title);
  std::fflush(stdout);
  service.tell_ready(service_status(title, 0));
  int64_t told_ns = 0;
  const int64_t begin_ns = now_ns();
  const timespec poll{0, kPollNs};
  while (!server.failure() && !server.is_shut_down_wanted()) {
    const int signal = sigtimedwait(&signals, nullptr, &poll);
    if (signal == SIGHUP) reload(server, options, net);
    tell_service(service, server, title, told_ns);
    if (signal > 0 && signal != SIGHUP) break;
    if (options.run_s > 0.0 && static_cast<double>(now_ns() - begin_ns) / kNsPerS >= options.run_s) break;
  }
  // A second signal ends the process at once.
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  std::signal(SIGHUP, SIG_IGN);
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
  const std::optional<Error> failure = server.failure();
  service.tell_stopping();
  server.stop();
  if (failure) {
    tell(failure->to_string());
    return kExitFailure;
  }
  if constexpr (requires { server.recording_failure(); }) {
    if (const std::optional<Error> lost = server.recording_failure()) {
      tell(fmt::format("the recording is not whole: {}", lost->to_string()));
      return kExitFailure;
    }
  }
  return 0;
}

/// What a server and a relay have in common before they start.
Status prepare(const ServerOptions& options, NetConfig& net) {
  RETURN_IF_ERROR(use_passed_socket(net));
  ASSIGN_OR_RETURN(net.tokens, load_tokens(options));
  std::signal(SIGXFSZ, SIG_IGN);  // a recording that may not grow any more ends, and the server goes on
  return {};
}

/// The signals are blocked in every thread.
int serve(const ServerOptions& options, ServerConfig config, EarlyEnd& early_end) {
  ServiceManager service = ServiceManager::of_environment();
  if (const Status status = prepare(options, config.net); !status) return fail(status.error());
  auto server = Server::start(config);
  if (!server) return fail(server.error());
  early_end.stop();
  return run_until_end(**server, options, config.net,
                       fmt::format("Serving '{}'", names_of_heads(config.scene)), service);
}

int relay(const ServerOptions& options, EarlyEnd& early_end) {
  ServiceManager service = ServiceManager::of_environment();
  RelayConfig config{options.config.net, {}};
  const UpstreamOptions& upstream = *options.upstream;
  config.upstream = {upstream.address, upstream.tls_authorities, {}, upstream.head};
  if (!upstream.token_path.empty()) {
    auto token = load_token(upstream.token_path, Role::Viewer);
    if (!token) return fail(token.error());
    hide_in_lines({*token});
    config.upstream.token = std::move(token).value();
  }
  if (const Status status = prepare(options, config.net); !status) return fail(status.error());
  auto relay = Relay::start(config);
  if (!relay) return fail(relay.error());
  early_end.stop();
  return run_until_end(**relay, options, config.net, "Relaying " + upstream.address.to_string(), service);
}

int run(int argc, const char* const* argv) {
  const Result<ServerOptions> options = parse_options(argc, argv);
  if (!options) return fail(options.error());
  if (!options->help.empty()) return fmt::print("{}", options->help), 0;
  if (options->is_listing_solvers) return fmt::print("{}", list_solvers()), 0;
  init_log(options->log_level, options->has_json_log ? LogFormat::Json : LogFormat::Text);
  // Before anything takes time: a reload of the service may come right after its start.
  if (!options->replay_path.empty()) return replay_command(*options);
  const bool is_serving = !options->is_printing_scene && !options->is_explaining && !options->is_checking;
  const sigset_t signals = handled_signals();
  std::optional<EarlyEnd> early_end;
  if (is_serving) {
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    early_end.emplace();
  }
  if (options->upstream) return relay(*options, *early_end);
  const Result<ServerConfig> config = load_config(*options);
  if (!config) return fail(config.error());
  if (options->is_printing_scene) return fmt::print("{}", to_text(config->scene)), 0;
  if (options->is_checking) return check_command(*options, *config);
  if (options->is_explaining) return explain_command(*options, *config);
  return serve(*options, *config, *early_end);
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  strandcast::open_standard_files();
  try {
    return strandcast::run(argc, argv);
  } catch (const std::exception& exception) {
    strandcast::tell(exception.what());
    return strandcast::kExitFailure;
  }
}
