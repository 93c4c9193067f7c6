#include "client/app/ctl_table.h"

#include <CLI/CLI.hpp>
#include <utility>

#include "client/app/recording_commands.h"
#include "client/app/script_command.h"
#include "client/app/step_command.h"
#include "client/app/stop_signal.h"
#include "common/base/command_line_error.h"
#include "common/base/frame_rate.h"
#include "common/motion/mocap_packet.h"

namespace strandcast {
namespace {

using Stop = std::atomic<bool>;
using Line = CtlCommandLine;

// ---- arguments ----

void declare_feed(CLI::App& app, CtlCommandLine& line) {
  constexpr double kMaxSpeed = 100.0;
  FeedOptions& feed = line.feed;
  app.add_option("--motion", feed.motion, "BVH file, .abc of the hair that moves as one, builtin or none")
      ->capture_default_str();
  app.add_option("--wind", feed.wind, "CSV file, gusts or none")->capture_default_str();
  declare_motion_file(app, feed.motion_file, "--");
  app.add_flag("--check", feed.is_checking,
               "Say what the files are taken for and leave, with exit code 1 for what no head does; without "
               "a server, but for .abc");
  app.add_flag("--keep-facing", feed.is_keeping_facing,
               "Do not turn a BVH file that looks aside so that it looks ahead on the mean");
  app.add_flag("--loop", feed.is_looped,
               "Start over at the end of the files; the head is led back to where the motion begins");
  app.add_flag(
      "--live", feed.is_live,
      "Go on in real time when the simulation is slower, as a stage does (default: as slowly as it)");
  app.add_option("--speed", feed.speed, "Playing speed")
      ->check(without_nan(CLI::Range(1e-3, kMaxSpeed)))
      ->capture_default_str();
  app.add_option(
         "--seconds", feed.seconds,
         "Stop after this long (default: at the end of the motion file; without one, or with --loop, never)")
      ->check(without_nan(CLI::Range(0.0, 1e6)));
  app.add_option("--rate", feed.rate_hz, "Samples per second, such as 120, 59.94 or 60000/1001")
      ->transform(CLI::Validator(
          [](std::string& text) { return make_frame_rate(text, kMinFeedRateHz, kMaxDatagramRateHz); }, ""))
      ->capture_default_str();
  auto* timecode = app.add_option("--timecode", feed.timecode,
                                  "Timecode of the motion's beginning, which the hair carries: 01:00:00:00, "
                                  "or 01:00:00;00 for drop-frame");
  auto* ltc = app.add_option(
      "--ltc", feed.ltc, "Linear timecode, which the hair carries: a WAV file, or - for sound as it comes");
  timecode->excludes(ltc);
  app.add_option(
         "--fps", feed.fps,
         "Frames per second that --timecode or --ltc counts, such as 23.976 or 24000/1001 (default: 24, and "
         "of sound its own), "
         "and those of a BVH file that states none")
      ->check(CLI::Validator(
          [](std::string text) { return make_frame_rate(text, kLeastFrameRate, kMostFrameRate); }, ""));
  app.add_option_function<std::vector<float>>(
         "--wind-mean",
         [&feed](const std::vector<float>& mps) { feed.wind_mps = glm::vec3(mps[0], mps[1], mps[2]); },
         "Mean of the gusts, x y z in m/s")
      ->expected(3);
  app.add_option("--gust-intensity", feed.gust_intensity,
                 "Standard deviation of the gusts over their mean speed")
      ->check(without_nan(CLI::Range(0.0f, 2.0f)))
      ->capture_default_str();
  app.add_option("--seed", feed.seed, "Seed of the gusts")->capture_default_str();
  auto* as = app.add_option(
      "--as", feed.as, "Send packets of motion capture instead, as a stage would: " + mocap_encoding_names());
  app.add_option("--to", feed.to, "Who gets them, as HOST or HOST:PORT")->needs(as)->capture_default_str();
}

void declare_latency(CLI::App& app, CtlCommandLine& line) {
  LatencyOptions& latency = line.latency;
  app.add_option("--seconds", latency.seconds, "For so long")
      ->check(without_nan(CLI::Range(0.1, 1e6)))
      ->capture_default_str();
  app.add_option("--mode", latency.mode, "strands or frames")
      ->check(CLI::IsMember({"strands", "frames"}))
      ->capture_default_str();
  app.add_option("--out", latency.out,
                 "Folder for latency.csv (percentiles) and frames.csv (times of every frame)");
}

void declare_params(CLI::App& app, CtlCommandLine& line) {
  ParameterOptions& params = line.params;
  app.add_option("prefix", params.prefix, "Those whose path begins so: look.shading, solver (default: all)");
  app.add_flag("--watch", params.is_watching, "Stay, and print what changes, until stopped");
  app.add_flag("--live", params.is_live_only, "Those alone that can be set while the server runs");
}

void declare_test(CLI::App& app, CtlCommandLine& line) {
  TestOptions& test = line.test;
  app.add_option("--scenario", test.scenarios,
                 "Scenario file (protobuf text), or a folder of them; repeatable")
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
  app.add_option("--jobs", test.jobs, "Scenarios at the same time, each with a server of its own")
      ->check(CLI::Range(1u, kMaxTestJobs))
      ->capture_default_str();
  app.add_flag("--watch", test.is_watching, "Run again after each change of a file or of the server program");
}

void declare_monitor(CLI::App& app, CtlCommandLine& line) {
  app.add_option("--seconds", line.monitor_s, "Stop after this long")
      ->check(without_nan(CLI::Range(0.0, 1e6)));
}

void declare_step(CLI::App& app, CtlCommandLine& line) {
  app.add_option("count", line.step_count,
                 "So many steps, however long they take (default: one, answered at once)")
      ->check(CLI::Range(1u, kMaxStepCount));
}

void declare_set(CLI::App& app, CtlCommandLine& line) {
  app.add_option(
         "assignment", line.assignment,
         "path=value, for example solver.name=dftl, look.hair_color=red, look.shading.wetness=0.5 or "
         "\"camera.offset_m={ x: 0 y: 0.1 z: 0.7 }\"; a wrong path is answered with those that can change")
      ->required();
}

void declare_subject(CLI::App& app, CtlCommandLine& line) {
  app.add_option("name", line.subject,
                 "As monitor lists them; empty: one called head, else the first one seen");
}

void declare_save(CLI::App& app, CtlCommandLine& line) {
  app.add_option("file", line.scene_path, "Where to; a file of this name is replaced")->required();
}

void declare_cameras(CLI::App& app, CtlCommandLine& line) {
  declare_camera(app, line.camera);
}

void declare_bundled(CLI::App& app, CtlCommandLine& line) {
  declare_bundle(app, line.bundle);
}
void declare_baked(CLI::App& app, CtlCommandLine& line) {
  declare_bake(app, line.bake);
}
void declare_exported(CLI::App& app, CtlCommandLine& line) {
  declare_export(app, line.exported);
}

void declare_check(CLI::App& app, CtlCommandLine& line) {
  app.add_option("recording", line.recording, "Recording to look at, instead of a server");
  app.add_option("--frames", line.check_frames, "Frames to decode")
      ->check(CLI::Range(uint64_t{2}, uint64_t{1'000'000}))
      ->capture_default_str();
  app.add_option("--timeout", line.check_timeout_s, "Seconds to wait for them")
      ->check(without_nan(CLI::Range(0.1, 1e6)))
      ->capture_default_str();
}

void declare_record_start(CLI::App& app, CtlCommandLine& line) {
  app.add_option("name", line.recording_name,
                 "Of the file, in the folder of the server's --record-dir (default: slate and take, else "
                 "scene, date and time)");
  app.add_option("--slate", line.slate, "As on the clapperboard; the file says it, too");
  app.add_option("--take", line.take, "Of the slate")->check(CLI::Range(1u, kMaxTake));
}

void declare_kick(CLI::App& app, CtlCommandLine& line) {
  app.add_option("session", line.session, "Its number, as listed by sessions")->required();
  app.add_option("--ban", line.ban_s, "And let nobody of its address in for so many seconds")
      ->check(without_nan(CLI::Range(0.0, kMaxBanS)));
}

void declare_info(CLI::App& app, CtlCommandLine& line) {
  app.add_option("recording", line.recording, "File of strandcast-server --record")->required();
}

void declare_recover(CLI::App& app, CtlCommandLine& line) {
  app.add_option("recording", line.recording, "What is left")->required();
  app.add_option("out", line.other_recording, "The new file (default: NAME.recovered.mcap)");
}

void declare_compare(CLI::App& app, CtlCommandLine& line) {
  app.add_option("recording", line.recording, "One")->required();
  app.add_option("other", line.other_recording, "And another")->required();
}

/// All that stands behind its name is the script's.
void declare_script(CLI::App& app, CtlCommandLine& line) {
  app.fallthrough(false);
  app.prefix_command();
  app.parse_complete_callback([&app, &line] { line.script_words = app.remaining(); });
}

// ---- functions ----

int start_check(const Line& line, const Stop&) {
  return line.recording.empty() ? run_check(line.target, line.check_frames, line.check_timeout_s)
                                : run_recording_check(line.recording);
}

int start_step(const Line& line, const Stop& stop) {
  if (line.step_count == 0) return run_command(line.target, ControlCommand{Command::StepOnce});
  return run_step(line.target, line.step_count, stop);
}

template <Command kCommand>
ClientMessage control(const Line&) {
  return ControlCommand{kCommand};
}

ClientMessage assign(const Line& line) {
  return SetParameter{line.assignment};
}

template <LiveAction kAction>
ClientMessage live(const Line& line) {
  return LiveCommand{kAction, line.subject};
}

template <bool kIsWanted>
ClientMessage record(const Line& line) {
  return RecordCommand{kIsWanted, line.recording_name, line.slate, line.take};
}

template <AdminAction kAction>
ClientMessage admin(const Line& line) {
  return AdminCommand{kAction, line.session, line.ban_s};
}

// clang-format off
constexpr CtlCommand kCommands[] = {
    {"feed", "Send head motion and wind in real time, to all heads of a server or to --head", declare_feed,
     [](const Line& line, const Stop& stop) { return run_feed(line.target, line.feed, stop); }},
    {"monitor", "Print the server's status twice a second", declare_monitor,
     [](const Line& line, const Stop& stop) { return run_monitor(line.target, line.monitor_s, stop); }},
    {"pause", "Halt the simulation", nullptr, nullptr, control<Command::Pause>},
    {"resume", "Let the simulation run", nullptr, nullptr, control<Command::Resume>},
    {"step", "Simulation steps while paused, or in lockstep", declare_step, start_step},
    {"reset", "Set every strand to rest", nullptr, nullptr, control<Command::Reset>},
    {"set", "Change a scene parameter", declare_set, nullptr, assign},
    {"camera", "Where viewers look from: all of them, or one; each can move on from there", declare_cameras,
     [](const Line& line, const Stop&) { return run_camera(line.target, line.camera); }},
    {"mocap", "Live motion capture: who drives the head, and what is rest", nullptr, nullptr},
    {"mocap subject", "Choose who drives the head", declare_subject, nullptr, live<LiveAction::ChooseSubject>},
    {"mocap calibrate", "What is seen now is the head at rest: look straight ahead", nullptr, nullptr,
     live<LiveAction::Calibrate>},
    {"mocap reset", "Undo calibrate", nullptr, nullptr, live<LiveAction::Reset>},
    {"record", "Recordings of a server that was started with --record-dir: of all its heads, or of --head", nullptr,
     nullptr},
    {"record start", "Begin one: inputs, steps, states and strands from now on", declare_record_start, nullptr,
     record<true>},
    {"record stop", "End it, and say what is in it", nullptr, nullptr, record<false>},
    {"params", "List the scene's parameters: value, unit, range, default, and what can be set", declare_params,
     [](const Line& line, const Stop& stop) { return run_params(line.target, line.params, stop); }},
    {"save", "Keep the scene as it runs, look and all, as a scene file", declare_save,
     [](const Line& line, const Stop&) { return run_save(line.target, line.scene_path); }},
    {"export", "Write the strands as curves for other programs", declare_exported,
     [](const Line& line, const Stop& stop) { return run_export(line.target, line.exported, stop); }},
    {"bake", "Simulate hair through a clip, and write it as curves for other programs; runs its own server", declare_baked,
     [](const Line& line, const Stop& stop) { return run_bake(line.bake, stop); }},
    {"bundle", "Make one HTML file of a recording or a scene, which browsers play without a server", declare_bundled,
     [](const Line& line, const Stop& stop) { return run_bundle(line.bundle, stop); }},
    {"check", "Decode frames with two viewers and compare their states; or look whether a recording is sound",
     declare_check, start_check},
    {"sessions", "List who is connected (needs an admin's token)", nullptr, nullptr, admin<AdminAction::ListSessions>},
    {"kick", "End one session (needs an admin's token)", declare_kick, nullptr, admin<AdminAction::Kick>},
    {"shutdown", "End the server (needs an admin's token)", nullptr, nullptr, admin<AdminAction::ShutDown>},
    {"info", "Say what a recording holds", declare_info,
     [](const Line& line, const Stop&) { return run_recording_info(line.recording); }},
    {"recover", "Make a whole recording of one that was cut off or damaged", declare_recover,
     [](const Line& line, const Stop&) { return run_recover(line.recording, line.other_recording); }},
    {"compare", "Say where two recordings first differ, and by how much", declare_compare,
     [](const Line& line, const Stop&) { return run_compare(line.recording, line.other_recording); }},
    {"latency", "Watch for a while, and say how long each part of the way takes", declare_latency,
     [](const Line& line, const Stop& stop) { return run_latency(line.target, line.latency, stop); }},
    {"test", "Carry out scenarios and check what they expect of a server", declare_test,
     [](const Line& line, const Stop& stop) { return run_test(line.target, line.test, stop); }},
    {"fleet", "Sessions on a cluster: fleet start NAME, list, stop NAME, drain NAME, tend, proxy-config", declare_script,
     [](const Line& line, const Stop&) { return run_script("strandcast-fleet", line.script_words); }},
    {"grid", "A report as an array of a cluster's jobs: grid work-precision --out FOLDER, grid stability --out FOLDER",
     declare_script,
     [](const Line& line, const Stop&) { return run_script("strandcast-grid", line.script_words); }},
    {"health", "Ask /healthz", nullptr,
     [](const Line& line, const Stop&) { return run_health(line.target); }},
};
// clang-format on

}  // namespace

std::span<const CtlCommand> ctl_commands() {
  return kCommands;
}

int carry_out(const CtlCommand& command, const CtlCommandLine& line, const std::atomic<bool>& stop) {
  const auto run = [&] {
    if (command.run != nullptr) return command.run(line, stop);
    const ClientMessage message = command.message(line);
    const auto* order = std::get_if<AdminCommand>(&message);
    return order != nullptr ? run_admin(line.target, *order) : run_command(line.target, message);
  };
  const int code = run();
  return stop && code != kDoneExit ? stopped_exit_code() : code;
}

}  // namespace strandcast
