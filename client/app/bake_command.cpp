#include "client/app/bake_command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <utility>

#include "client/app/baked_states.h"
#include "client/app/scenario/server_process.h"
#include "common/base/command_line_error.h"
#include "common/base/frame_rate.h"
#include "common/groom/groom_file.h"

namespace strandcast {
namespace {

constexpr const char* kStillAir = "none";
constexpr const char* kSceneWind = "scene";
constexpr double kLongestLeadS = 60.0;

/// What is fed, in motion time, but for the motion of curves. Who names no motion holds the head still.
Result<FeedPlan> bake_plan(const BakeCommand& command) {
  FeedOptions options = command.feed;
  options.is_keeping_facing = true;  // for a program that has the clip itself
  options.blend_s = 0.0;             // the lead does that, so that frames stay at the clip's times
  if (options.wind == kSceneWind) options.wind = "none";
  if (is_of_curves(options.motion)) options.motion = "none";
  FeedPlan plan;
  if (options.motion != "none" || options.wind != "none") {
    ASSIGN_OR_RETURN(plan, make_feed_plan(options));
  }
  if (command.feed.wind == kStillAir) plan.wind = [](double) { return glm::vec3(0.0f); };
  if (!plan.motion) plan.motion = [](double) { return Pose(); };
  return plan;
}

/// Where it ends: at what is asked for, else with the motion.
Result<ExportOptions> bake_export(const BakeCommand& command, double motion_s) {
  ExportCommand exported = command.exported;
  // Curves say where hair is in their own space.
  if (!exported.space && is_of_curves(command.feed.motion)) exported.space = "world";
  ASSIGN_OR_RETURN(ExportOptions options, export_options(exported));
  options.is_whole = true;
  // A clip's frames are numbered files of .ply.
  if (!exported.at_s && motion_s > 0.0) options.is_one_frame = false;
  if (options.is_one_frame) options.to_s = options.from_s;
  if (!options.to_s && motion_s > 0.0) options.to_s = std::max(motion_s, options.from_s);
  if (!options.to_s)
    return make_error(ErrorCode::BadInput,
                      "this motion has no end: say --seconds, or give a clip with --motion FILE.bvh");
  return options;
}

Result<std::optional<HairOrigin>> origin_of(const BakedStates& states) {
  const auto* const files = std::get_if<FileGroomDesc>(&states.simulated().groom);
  if (files == nullptr) return std::optional<HairOrigin>();
  ASSIGN_OR_RETURN(HairOrigin origin, load_origin(*files, *states.scene().asset));
  return std::optional(std::move(origin));
}

/// Whether a path may be a frame of the numbered files that a clip in .ply is.
bool is_frame_of(const std::filesystem::path& path, const std::filesystem::path& out) {
  std::error_code failure;
  const std::string name = path.stem().string(), begin = out.stem().string() + "_";
  return out.extension() == ".ply" && path.extension() == ".ply" && name.starts_with(begin) &&
         name.find_first_not_of("0123456789", begin.size()) == std::string::npos &&
         std::filesystem::equivalent(std::filesystem::absolute(path).parent_path(),
                                     std::filesystem::absolute(out).parent_path(), failure);
}

/// No file of a person's is written over: neither one that is read, nor, unasked, one that stands where the
/// file to write was left out.
Status check_paths(const BakeCommand& command) {
  const std::vector<std::string>& paths = command.exported.paths;
  const std::string out = paths.back();
  const std::vector<std::string> hair(paths.begin(), paths.end() - 1);
  const bool names_none =
      hair.empty() && command.scene.empty() &&
      std::none_of(command.overrides.begin(), command.overrides.end(),
                   [](const std::string& assignment) { return assignment.starts_with("groom."); });
  std::error_code failure;
  const auto motion = std::find_if(hair.begin(), hair.end(), [](const std::string& path) {
    return std::filesystem::path(path).extension() == ".bvh";
  });
  if (motion != hair.end())
    return make_error(ErrorCode::BadInput, "{} is motion, not hair: --motion {}", *motion, *motion);
  if (std::filesystem::is_directory(out, failure))
    return make_error(ErrorCode::BadInput, "{} is a folder: name the file to write", out);
  std::vector<std::string> read = hair;
  read.insert(read.end(), {command.feed.motion, command.feed.wind});
  for (const std::string& path : read)
    if (std::filesystem::equivalent(path, out, failure) || (!command.exported.at_s && is_frame_of(path, out)))
      return make_error(ErrorCode::BadInput,
                        "{} is read, and would be written over: name another file to write", path);
  if (command.is_replacing || !std::filesystem::exists(out, failure)) return {};
  return names_none
             ? make_error(ErrorCode::BadInput,
                          "{} is there already, and no file to write stands after it: bake {} OUT.abc bakes "
                          "its hair (--replace bakes the built-in hair into it)",
                          out, out)
             : make_error(ErrorCode::BadInput,
                          "{} is there already: --replace writes over it; hair is what stands before the "
                          "file to write",
                          out);
}

Result<ExportReport> bake(const BakeCommand& command, const std::atomic<bool>& stop) {
  RETURN_IF_ERROR(check_paths(command));
  ASSIGN_OR_RETURN(FeedPlan plan, bake_plan(command));
  std::optional<CurveMotion> curves;
  if (is_of_curves(command.feed.motion)) {
    ASSIGN_OR_RETURN(curves, load_abc_motion(command.feed.motion));
  }
  ASSIGN_OR_RETURN(ExportOptions options,
                   bake_export(command, curves ? curves->duration_s() : plan.motion_s));
  ASSIGN_OR_RETURN(const std::filesystem::path server, find_server_program(command.server));
  ASSIGN_OR_RETURN(auto states, BakedStates::start(server, server_words(command), stop));
  for (const std::string& note : states->hair_notes()) std::cerr << note << '\n';
  ASSIGN_OR_RETURN(std::optional<HairOrigin> origin, origin_of(*states));
  if (curves) {
    if (!origin)
      return make_error(ErrorCode::BadInput,
                        "curves move the hair of a file: name it before the file to write");
    MotionFile head = head_motion(*curves, *origin, command.feed.motion, command.feed.motion_file);
    for (const std::string& note : head.notes) std::cerr << note << '\n';
    origin->is_world_at_rest = true;
    ASSIGN_OR_RETURN(options, bake_export(command, head.clip.duration_s()));
    plan.motion = [clip = std::move(head.clip)](double t_s) { return clip.sample(t_s); };
  }
  states->begin({plan, command.lead_s, options.fps.hz()});
  const LookDesc look = states->simulated().look;
  return export_dressed(std::move(states), {std::move(origin), look}, command.exported, options, stop);
}

}  // namespace

void declare_motion_file(CLI::App& app, MotionFileOptions& options, const std::string& prefix) {
  options.prefix = prefix;
  app.add_option(prefix + "unit", options.unit_m,
                 "Metres per unit of the BVH file, 0 = guessed from the length of the bones")
      ->check(without_nan(CLI::Range(0.0, 1e3)))
      ->capture_default_str();
  app.add_option(prefix + "up", options.up, "Up axis of the BVH file (default: guessed from the rest pose)")
      ->check(CLI::IsMember({"y", "z"}));
  app.add_option("--joint", options.joint,
                 "Head joint of the BVH file, NAME#2 for the second of that name (default: found by name)");
  app.add_option("--body-joint", options.body_joints,
                 "Joints of the BVH file to send besides neck, chest, shoulders and elbows, by their names");
  app.add_flag("--filter-glitches", options.is_filtering_glitches,
               "Take steps out of the BVH file that are faster than any head moves");
  app.add_flag("--keep-first-frames", options.is_keeping_first_frames,
               "Keep frames of the BVH file that the head jumps from, as from a T-pose before the motion");
}

void declare_bake(CLI::App& app, BakeCommand& command) {
  FeedOptions& feed = command.feed;
  feed.motion = "none";
  feed.wind = kStillAir;
  app.add_option("paths", command.exported.paths,
                 "HAIR.ply [MORE.ply ..] OUT.abc: hair files as for strandcast-server --groom (without: the "
                 "scene's hair), and the file to write: .usda, .usdc, .usdz, .abc, .ply or .csv")
      ->required()
      ->expected(1, static_cast<int>(kMaxGroomFiles) + 1);
  app.add_option(
         "--motion", feed.motion,
         "Motion of the head: a BVH file, an .abc of animated hair that moves as one, builtin or none")
      ->capture_default_str();
  app.add_option("--wind", feed.wind, "CSV file, gusts, scene (what the scene says) or none")
      ->capture_default_str();
  declare_motion_file(app, feed.motion_file, "--motion-");
  app.add_option("--motion-fps", feed.fps, "Frames per second of a BVH file that states none")
      ->check(CLI::Validator(
          [](std::string text) { return make_frame_rate(text, kLeastFrameRate, kMostFrameRate); }, ""));
  app.add_option(
         "--lead", command.lead_s,
         "Seconds before the first frame, in which the head gets from rest to the motion's first speed")
      ->check(without_nan(CLI::Range(0.0, kLongestLeadS)))
      ->capture_default_str();
  app.add_flag("--replace", command.is_replacing, "Write over a file that is there");
  app.add_option("--scene", command.scene, "Scene file (default: the built-in scene in full quality)");
  app.add_option("--set", command.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all()
      ->allow_extra_args(false);
  app.add_option("--server", command.server, "Server program (default: strandcast-server beside this one)");
  declare_export_options(app, command.exported);
}

std::vector<std::string> server_words(const BakeCommand& command) {
  std::vector<std::string> words = {"--lockstep"};
  const auto set = [&](const std::string& assignment) { words.insert(words.end(), {"--set", assignment}); };
  if (command.scene.empty())
    set("quality=full");
  else
    words.insert(words.end(), {"--scene", command.scene.string()});
  const std::vector<std::string>& paths = command.exported.paths;
  for (size_t i = 0; i + 1 < paths.size(); ++i) words.insert(words.end(), {"--groom", paths[i]});
  // All strands at every step, as near to what was simulated as a stream gets.
  for (const char* const assignment : {"detail.mode=off", "detail.simulated_share=1", "stream.codec=delta",
                                       "stream.bound_m=1e-6", "stream.strand_rate_hz=0"})
    set(assignment);
  for (const std::string& assignment : command.overrides) set(assignment);
  return words;
}

int run_bake(const BakeCommand& command, const std::atomic<bool>& stop) {
  const auto report = bake(command, stop);
  if (!report) return ctl_failure(report.error());
  print_export(*report);
  return kDoneExit;
}

}  // namespace strandcast
