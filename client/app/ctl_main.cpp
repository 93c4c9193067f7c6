// strandcast-ctl: feeds, watches, steers and checks a running server from the command line.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "client/app/ctl_commands.h"
#include "client/app/export_command.h"
#include "client/app/feed.h"
#include "client/app/latency_command.h"
#include "client/app/parameter_command.h"
#include "client/app/recording_commands.h"
#include "client/app/scenario/test_command.h"
#include "client/app/stop_signal.h"
#include "client/app/view_options.h"
#include "common/base/version.h"
#include "common/log/log.h"

namespace {

using namespace strandcast;

struct CommandLine {
  CtlTarget target{"127.0.0.1:" + std::to_string(kDefaultPort), {}, {}, false, {}, nullptr};
  std::string log_level = "warn";
  FeedOptions feed;
  std::vector<float> wind_mps;
  double monitor_s = 0.0;
  std::string assignment;
  std::string subject;
  uint64_t check_frames = 120;
  double check_timeout_s = 60.0;
  uint64_t session = 0;
  double ban_s = 0.0;
  std::string scene_path;
  ExportCommand exported;
  std::string recording;
  std::string other_recording;
  uint32_t step_count = 0;
  TestOptions test;
  ParameterOptions params;
  LatencyOptions latency;
};

void declare_feed(CLI::App& app, CommandLine& line) {
  constexpr double kMaxSpeed = 100.0;
  FeedOptions& feed = line.feed;
  app.add_option("--motion", feed.motion, "BVH file, builtin or none")->capture_default_str();
  app.add_option("--wind", feed.wind, "CSV file, gusts or none")->capture_default_str();
  app.add_option("--unit", feed.motion_file.unit_m,
                 "Metres per unit of the BVH file, 0 = guessed from the length of the bones")
      ->check(CLI::Range(0.0, 1e3))
      ->capture_default_str();
  app.add_option("--up", feed.motion_file.up, "Up axis of the BVH file (default: guessed from the rest pose)")
      ->check(CLI::IsMember({"y", "z"}));
  app.add_option("--joint", feed.motion_file.joint, "Head joint of the BVH file (default: found by name)");
  app.add_option("--body-joint", feed.motion_file.body_joints,
                 "Joints of the BVH file to send besides neck, chest, shoulders and elbows, by their names");
  app.add_flag("--filter-glitches", feed.motion_file.is_filtering_glitches,
               "Take steps out of the BVH file that are faster than any head moves");
  app.add_flag("--loop", feed.is_looped, "Start over at the end of the files");
  app.add_flag(
      "--live", feed.is_live,
      "Go on in real time when the simulation is slower, as a stage does (default: as slowly as it)");
  app.add_option("--speed", feed.speed, "Playing speed")
      ->check(CLI::Range(1e-3, kMaxSpeed))
      ->capture_default_str();
  app.add_option("--seconds", feed.seconds, "Stop after this long (default: the length of the motion file)")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--rate", feed.rate_hz, "Samples per second")
      ->check(CLI::Range(kMinFeedRateHz, kMaxDatagramRateHz))
      ->capture_default_str();
  app.add_option("--wind-mean", line.wind_mps, "Mean of the gusts, x y z in m/s")->expected(3);
  app.add_option("--gust-intensity", feed.gust_intensity,
                 "Standard deviation of the gusts over their mean speed")
      ->check(CLI::Range(0.0f, 2.0f))
      ->capture_default_str();
  app.add_option("--seed", feed.seed, "Seed of the gusts")->capture_default_str();
  auto* as = app.add_option(
      "--as", feed.as, "Send packets of motion capture instead, as a stage would: vmc, opentrack or freed");
  app.add_option("--to", feed.to, "Who gets them, as HOST or HOST:PORT")->needs(as)->capture_default_str();
}

void declare_latency(CLI::App& app, CommandLine& line) {
  LatencyOptions& latency = line.latency;
  app.add_option("--seconds", latency.seconds, "For so long")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  app.add_option("--mode", latency.mode, "strands or frames")
      ->check(CLI::IsMember({"strands", "frames"}))
      ->capture_default_str();
  app.add_option("--out", latency.out,
                 "Folder for latency.csv (percentiles) and frames.csv (times of every frame)");
}

void declare_params(CLI::App& app, CommandLine& line) {
  ParameterOptions& params = line.params;
  app.add_option("prefix", params.prefix, "Those whose path begins so: look.shading, solver (default: all)");
  app.add_flag("--watch", params.is_watching, "Stay, and print what changes, until stopped");
  app.add_flag("--live", params.is_live_only, "Those alone that can be set while the server runs");
}

void declare_test(CLI::App& app, CommandLine& line) {
  TestOptions& test = line.test;
  app.add_option("--scenario", test.scenarios, "Scenario file (protobuf text); repeatable")
      ->expected(1)
      ->take_all()
      ->required();
  app.add_option("--junit", test.junit, "Write the results to this file as JUnit XML");
  app.add_option("--out", test.out, "Folder for pictures, plot and log of what failed")
      ->capture_default_str();
  app.add_option(
      "--server", test.server,
      "Server program (default: strandcast-server beside this one); with --connect none is started");
  app.add_flag("--renew", test.renews_goldens, "Write the golden pictures instead of comparing with them");
}

/// What to say when no command was understood but there are words left; empty otherwise.
std::string unknown_command(const CLI::App& app) {
  const std::vector<std::string> words = app.remaining();
  if (!app.get_subcommands().empty() || words.empty()) return {};
  std::string known;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    known += (known.empty() ? "" : ", ") + command->get_name();
  return fmt::format("unknown command or option '{}' (commands: {}; --help says more)", words.front(), known);
}

int run(int argc, char** argv) {
  CLI::App app("Strandcast control: feeds, watches, steers and checks a running strandcast-server.",
               "strandcast-ctl");
  app.set_version_flag("--version", fmt::format("strandcast-ctl {}", version()));
  CommandLine line;
  app.require_subcommand(1);
  app.fallthrough();  // --connect may stand behind the sub-command too
  app.add_option("--connect", line.target.connect, "Server as HOST:PORT")->capture_default_str();
  app.add_option("--token-file", line.target.token_file,
                 "File with the token: the token alone, or lines 'role token'");
  app.add_option("--token", line.target.token, kTokenHelp)->envname(kTokenVariable);
  app.add_flag("--tls", line.target.is_tls, "Encrypt the connection, as an address with wss:// does");
  app.add_option("--tls-ca", line.target.tls_authorities, kTlsAuthoritiesHelp);
  app.add_option("--log", line.log_level, "error, warn, info, debug or off")->capture_default_str();

  CLI::App* feed = app.add_subcommand("feed", "Send head motion and wind in real time");
  declare_feed(*feed, line);
  CLI::App* monitor = app.add_subcommand("monitor", "Print the server's status twice a second");
  monitor->add_option("--seconds", line.monitor_s, "Stop after this long")->check(CLI::Range(0.0, 1e6));
  CLI::App* pause = app.add_subcommand("pause", "Halt the simulation");
  CLI::App* resume = app.add_subcommand("resume", "Let the simulation run");
  CLI::App* step = app.add_subcommand("step", "Simulation steps while paused, or in lockstep");
  step->add_option("count", line.step_count,
                   "So many steps; the answer comes when they are done (default: one, answered at once)")
      ->check(CLI::Range(1u, kMaxStepCount));
  CLI::App* reset = app.add_subcommand("reset", "Set every strand to rest");
  CLI::App* set = app.add_subcommand("set", "Change a scene parameter");
  set->add_option(
         "assignment", line.assignment,
         "path=value, for example solver.name=dftl, look.hair_color=red, look.shading.wetness=0.5 or "
         "\"camera.offset_m={ x: 0 y: 0.1 z: 0.7 }\"; a wrong path is answered with those that can change")
      ->required();
  CLI::App* mocap = app.add_subcommand("mocap", "Live motion capture: who drives the head, and what is rest");
  mocap->require_subcommand(1);
  CLI::App* mocap_subject = mocap->add_subcommand("subject", "Choose who drives the head");
  mocap_subject->add_option("name", line.subject,
                            "As monitor lists them; empty: one called head, else the first one seen");
  CLI::App* mocap_calibrate =
      mocap->add_subcommand("calibrate", "What is seen now is the head at rest: look straight ahead");
  CLI::App* mocap_reset = mocap->add_subcommand("reset", "Undo calibrate");
  CLI::App* params = app.add_subcommand(
      "params", "List the scene's parameters: value, unit, range, default, and what can be set");
  declare_params(*params, line);
  CLI::App* save = app.add_subcommand("save", "Keep the scene as it runs, look and all, as a scene file");
  save->add_option("file", line.scene_path, "Where to; a file of this name is replaced")->required();
  CLI::App* exported = app.add_subcommand("export", "Write the strands as curves for other programs");
  declare_export(*exported, line.exported);
  CLI::App* check = app.add_subcommand(
      "check",
      "Decode frames with two viewers and compare their states; or look whether a recording is sound");
  check->add_option("recording", line.recording, "Recording to look at, instead of a server");
  check->add_option("--frames", line.check_frames, "Frames to decode")
      ->check(CLI::Range(uint64_t{2}, uint64_t{1'000'000}))
      ->capture_default_str();
  check->add_option("--timeout", line.check_timeout_s, "Seconds to wait for them")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  CLI::App* sessions = app.add_subcommand("sessions", "List who is connected (needs an admin's token)");
  CLI::App* kick = app.add_subcommand("kick", "End one session (needs an admin's token)");
  kick->add_option("session", line.session, "Its number, as listed by sessions")->required();
  kick->add_option("--ban", line.ban_s, "And let nobody of its address in for so many seconds")
      ->check(CLI::Range(0.0, kMaxBanS));
  CLI::App* shutdown = app.add_subcommand("shutdown", "End the server (needs an admin's token)");
  CLI::App* info = app.add_subcommand("info", "Say what a recording holds");
  info->add_option("recording", line.recording, "File of strandcast-server --record")->required();
  CLI::App* recover =
      app.add_subcommand("recover", "Make a whole recording of one that was cut off or damaged");
  recover->add_option("recording", line.recording, "What is left")->required();
  recover->add_option("out", line.other_recording, "The new file (default: NAME.recovered.mcap)");
  CLI::App* compare = app.add_subcommand("compare", "Say where two recordings first differ, and by how much");
  compare->add_option("recording", line.recording, "One")->required();
  compare->add_option("other", line.other_recording, "And another")->required();
  CLI::App* latency =
      app.add_subcommand("latency", "Watch for a while, and say how long each part of the way takes");
  declare_latency(*latency, line);
  CLI::App* test = app.add_subcommand("test", "Carry out scenarios and check what they expect of a server");
  declare_test(*test, line);
  CLI::App* health = app.add_subcommand("health", "Ask /healthz");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& problem) {
    if (const std::string unknown = unknown_command(app); !unknown.empty()) {
      std::cerr << "strandcast-ctl: " << unknown << '\n';
      return kBadInputExit;
    }
    return app.exit(problem) == 0 ? kDoneExit : kBadInputExit;
  }
  if (!init_log(line.log_level)) {
    std::cerr << "strandcast-ctl: unknown log level '" << line.log_level
              << "' (known: error, warn, info, debug, off)\n";
    return kBadInputExit;
  }
  if (line.wind_mps.size() == 3)
    line.feed.wind_mps = glm::vec3(line.wind_mps[0], line.wind_mps[1], line.wind_mps[2]);

  const auto& stop = catch_stop_signals();
  line.target.stop = &stop;
  if (*feed) return run_feed(line.target, line.feed, stop);
  if (*monitor) return run_monitor(line.target, line.monitor_s, stop);
  if (*pause) return run_command(line.target, ControlCommand{Command::Pause});
  if (*resume) return run_command(line.target, ControlCommand{Command::Resume});
  if (*step) return run_command(line.target, ControlCommand{Command::StepOnce, line.step_count});
  if (*reset) return run_command(line.target, ControlCommand{Command::Reset});
  if (*set) return run_command(line.target, SetParameter{line.assignment});
  if (*mocap_subject) return run_command(line.target, LiveCommand{LiveAction::ChooseSubject, line.subject});
  if (*mocap_calibrate) return run_command(line.target, LiveCommand{LiveAction::Calibrate, {}});
  if (*mocap_reset) return run_command(line.target, LiveCommand{LiveAction::Reset, {}});
  if (*params) return run_params(line.target, line.params, stop);
  if (*save) return run_save(line.target, line.scene_path);
  if (*exported) return run_export(line.target, line.exported, stop);
  if (*check && !line.recording.empty()) return run_recording_check(line.recording);
  if (*check) return run_check(line.target, line.check_frames, line.check_timeout_s);
  if (*sessions) return run_admin(line.target, {AdminAction::ListSessions, 0});
  if (*kick) return run_admin(line.target, {AdminAction::Kick, line.session, line.ban_s});
  if (*shutdown) return run_admin(line.target, {AdminAction::ShutDown, 0});
  if (*info) return run_recording_info(line.recording);
  if (*recover) return run_recover(line.recording, line.other_recording);
  if (*compare) return run_compare(line.recording, line.other_recording);
  if (*latency) return run_latency(line.target, line.latency, stop);
  if (*test) {
    line.test.uses_running = app.count("--connect") > 0;
    return run_test(line.target, line.test, stop);
  }
  if (*health) return run_health(line.target);
  return kBadInputExit;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& failure) {
    std::cerr << "strandcast-ctl: " << failure.what() << '\n';
    return strandcast::kBadInputExit;
  }
}
