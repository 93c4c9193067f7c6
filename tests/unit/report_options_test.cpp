// Every option of every command of strandcast-report: the field that it sets, and that it sets no other.
#include "server/report/report_options.h"

#include <CLI/CLI.hpp>

#include "tests/support/option_table.h"

namespace strandcast::test {

inline void tell(FieldTexts&, const std::string&, const SceneDesc&) {}  // of --scene and --set
inline void tell(FieldTexts& told, const std::string& where, const ExecutorConfig& all) {
  OPTION_FIELDS(all, sim_device, gl_device, shader_folder);
}
inline void tell(FieldTexts& told, const std::string& where, const MotionFileOptions& all) {
  OPTION_FIELDS(all, unit_m, up, joint, fps, has_body, body_joints, is_filtering_glitches,
                is_keeping_first_frames, prefix);
}
inline void tell(FieldTexts& told, const std::string& where, const RenderSize& all) {
  OPTION_FIELDS(all, width, height);
}
inline void tell(FieldTexts& told, const std::string& where, const CoherenceOptions& all) {
  OPTION_FIELDS(all, scene_path, overrides, out, device, is_quick, has_pictures);
}
inline void tell(FieldTexts& told, const std::string& where, const CollisionStudyDesc& all) {
  OPTION_FIELDS(all, scene, resolutions, shake_steps, rest_steps, clip, clip_options, body_steps,
                body_rest_steps, has_pictures);
}
inline void tell(FieldTexts& told, const std::string& where, const CollisionOptions& all) {
  OPTION_FIELDS(all, scene_path, overrides, out, device, desc, is_quick);
}
inline void tell(FieldTexts& told, const std::string& where, const CyclesSettings& all) {
  OPTION_FIELDS(all, program, script, samples, threads);
}
inline void tell(FieldTexts& told, const std::string& where, const PicturesDesc& all) {
  OPTION_FIELDS(all, truths, scratch, scene, only, rounds, has_methods, has_blender, is_keeping, cycles,
                gl_device, on_progress);
}
inline void tell(FieldTexts& told, const std::string& where, const PicturesOptions& all) {
  OPTION_FIELDS(all, scene_path, overrides, out, desc);
}
inline void tell(FieldTexts& told, const std::string& where, const PruningOptions& all) {
  OPTION_FIELDS(all, scenes, only, shares, out, device, steps, has_pictures);
}
inline void tell(FieldTexts& told, const std::string& where, const RecommendOptions& all) {
  OPTION_FIELDS(all, scene_path, overrides, solvers, budget_ms, device);
}
inline void tell(FieldTexts& told, const std::string& where, const RenderingReportDesc& all) {
  OPTION_FIELDS(all, scene, size, rounds, far_factor, gl_device, on_progress);
}
inline void tell(FieldTexts& told, const std::string& where, const RenderingOptions& all) {
  OPTION_FIELDS(all, scene_path, overrides, out, size, desc);
}
inline void tell(FieldTexts& told, const std::string& where, const ScalpOptions& all) {
  OPTION_FIELDS(all, scene_path, overrides, motion_path, motion_file, out, device, seconds, every_s);
}
inline void tell(FieldTexts& told, const std::string& where, const StabilityOptions& all) {
  OPTION_FIELDS(all, out, solvers, device, is_quick);
}
inline void tell(FieldTexts& told, const std::string& where, const StreamingOptions& all) {
  OPTION_FIELDS(all, out, motions, motion_file, clips, sizes, solvers, device, seconds, view, is_quick);
}
inline void tell(FieldTexts& told, const std::string& where, const VolumeReportOptions& all) {
  OPTION_FIELDS(all, scene_path, overrides, out, device, guides, is_quick);
}
inline void tell(FieldTexts& told, const std::string& where, const WorkPrecisionOptions& all) {
  OPTION_FIELDS(all, out, solvers, motion, motion_file, device, is_quick, vertices, rates_hz, hairs,
                motion_s);
}

}  // namespace strandcast::test

namespace strandcast::report_options_test {
namespace {

using test::Arguments;
using test::OptionRow;
using Rows = std::vector<OptionRow>;

const OptionRow kScene = {"--scene", {"x.textproto"}, {{"scene_path", "x.textproto"}}};
const OptionRow kSet = {"--set", {"a=1", "--set", "b=2"}, {{"overrides", "a=1 b=2"}}};
const OptionRow kQuick = {"--quick", {}, {{"is_quick", "true"}}};
const OptionRow kSolver = {"--solver", {"dftl", "--solver", "pbd"}, {{"solvers", "dftl pbd"}}};

/// Those of add_sim_device_options().
Rows device_rows(const std::string& sim_device) {
  return {{"--sim-device", {sim_device}, {{"device.sim_device", sim_device}}},
          {"--gl-device", {"software"}, {{"device.gl_device", "software"}}}};
}

/// Those of add_motion_file_options(), of a field of this name.
Rows motion_file_rows(const std::string& field) {
  return {{"--unit", {"0.5"}, {{field + ".unit_m", "0.5"}}},
          {"--up", {"z"}, {{field + ".up", "z"}}},
          {"--joint", {"Skull"}, {{field + ".joint", "Skull"}}},
          {"--filter-glitches", {}, {{field + ".is_filtering_glitches", "true"}}},
          {"--keep-first-frames", {}, {{field + ".is_keeping_first_frames", "true"}}}};
}

Rows joined(std::initializer_list<Rows> parts) {
  Rows all;
  for (const Rows& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// `needed`: what no command line of it is without.
template <class Options>
void expect_table(void (*declare)(CLI::App&, Options&), Rows rows, const OptionRow& needed) {
  const auto fields_with = [&](Arguments arguments) {
    CLI::App app("", "strandcast-report");
    Options options;
    declare(app, options);
    std::reverse(arguments.begin(), arguments.end());
    std::optional<test::FieldTexts> told;
    try {
      app.parse(arguments);
      told.emplace();
      tell(*told, {}, options);
    } catch (const CLI::ParseError& failure) {
      ADD_FAILURE() << failure.what();
    }
    return told;
  };
  for (OptionRow& row : rows) {
    row.beside = {needed.option};
    row.beside.insert(row.beside.end(), needed.values.begin(), needed.values.end());
  }
  test::expect_changes(rows, fields_with);
  test::FieldTexts first;
  tell(first, {}, Options());
  Arguments arguments = needed.values;
  arguments.insert(arguments.begin(), needed.option);
  const auto with_needed = fields_with(arguments);
  ASSERT_TRUE(with_needed);
  EXPECT_EQ(test::difference_of(first, *with_needed), needed.changed);
  rows.push_back(needed);
  CLI::App app("", "strandcast-report");
  Options options;
  declare(app, options);
  test::expect_all_options(rows, app.help());
}

const OptionRow kOut = {"--out", {"o"}, {{"out", "o"}}};

TEST(ReportOptionTable, OfCoherence) {
  expect_table(
      declare_coherence,
      joined({{kScene, kSet, kQuick, {"--no-pictures", {}, {{"has_pictures", "false"}}}}, device_rows("gl")}),
      kOut);
}

TEST(ReportOptionTable, OfCollisions) {
  expect_table(declare_collisions,
               joined({{kScene,
                        kSet,
                        kQuick,
                        {"--motion", {"a.bvh"}, {{"desc.clip", "a.bvh"}}},
                        {"--no-pictures", {}, {{"desc.has_pictures", "false"}}}},
                       motion_file_rows("desc.clip_options"),
                       device_rows("lanes")}),
               kOut);
}

TEST(ReportOptionTable, OfPictures) {
  expect_table(declare_pictures,
               {kScene,
                kSet,
                {"--only", {"a", "--only", "b"}, {{"desc.only", "a b"}}},
                {"--methods", {}, {{"desc.has_methods", "true"}}},
                {"--truths", {"t"}, {{"desc.truths", "t"}}},
                {"--blender", {}, {{"desc.has_blender", "true"}}},
                {"--blender-program", {"b"}, {{"desc.cycles.program", "b"}}},
                {"--samples", {"17"}, {{"desc.cycles.samples", "17"}}},
                {"--threads", {"7"}, {{"desc.cycles.threads", "7"}}},
                {"--keep", {}, {{"desc.is_keeping", "true"}}},
                {"--rounds", {"7"}, {{"desc.rounds", "7"}}},
                {"--gpu", {"software"}, {{"desc.gl_device", "software"}}},
                {"--gl-device", {"software"}, {{"desc.gl_device", "software"}}}},
               kOut);
}

TEST(ReportOptionTable, OfPruning) {
  expect_table(declare_pruning,
               joined({{{"--scenes", {"s"}, {{"scenes", "s"}}},
                        {"--scene", {"a", "--scene", "b"}, {{"only", "a b"}}},
                        {"--share", {"0.75", "--share", "1"}, {{"shares", "0.75 1"}}},
                        {"--steps", {"17"}, {{"steps", "17"}}},
                        {"--no-pictures", {}, {{"has_pictures", "false"}}}},
                       device_rows("lanes")}),
               kOut);
}

TEST(ReportOptionTable, OfRecommend) {
  expect_table(declare_recommend, joined({{kScene, kSet, kSolver}, device_rows("all")}),
               {"--budget-ms", {"1.5"}, {{"budget_ms", "1.5"}}});
}

TEST(ReportOptionTable, OfRendering) {
  expect_table(declare_rendering,
               {kScene,
                kSet,
                {"--size", {"64x36"}, {{"size", "64x36"}}},
                {"--rounds", {"7"}, {{"desc.rounds", "7"}}},
                {"--gpu", {"software"}, {{"desc.gl_device", "software"}}},
                {"--gl-device", {"software"}, {{"desc.gl_device", "software"}}}},
               kOut);
}

TEST(ReportOptionTable, OfScalp) {
  expect_table(declare_scalp,
               joined({{kScene,
                        kSet,
                        {"--motion", {"a.bvh"}, {{"motion_path", "a.bvh"}}},
                        {"--seconds", {"2.5"}, {{"seconds", "2.5"}}},
                        {"--every-s", {"1.5"}, {{"every_s", "1.5"}}}},
                       motion_file_rows("motion_file"),
                       device_rows("lanes")}),
               kOut);
}

TEST(ReportOptionTable, OfStability) {
  expect_table(declare_stability, joined({{kSolver, kQuick}, device_rows("lanes")}), kOut);
}

TEST(ReportOptionTable, OfStreaming) {
  expect_table(declare_streaming,
               joined({{kSolver,
                        kQuick,
                        {"--motion", {"a.bvh", "--motion", "b.bvh"}, {{"motions", "a.bvh b.bvh"}}},
                        {"--size", {"9x8", "--size", "7x6"}, {{"sizes", "9x8 7x6"}}},
                        {"--clips", {"c"}, {{"clips", "c"}}},
                        {"--view", {"64x36"}, {{"view", "64x36"}}},
                        {"--seconds", {"2.5"}, {{"seconds", "2.5"}}}},
                       motion_file_rows("motion_file"),
                       device_rows("lanes")}),
               kOut);
}

TEST(ReportOptionTable, OfVolume) {
  expect_table(
      declare_volume,
      joined({{kScene, kSet, kQuick, {"--guides", {"17"}, {{"guides", "17"}}}}, device_rows("lanes")}), kOut);
}

TEST(ReportOptionTable, OfWorkPrecision) {
  expect_table(declare_work_precision,
               joined({{kSolver,
                        kQuick,
                        {"--motion", {"a.bvh"}, {{"motion", "a.bvh"}}},
                        {"--hair", {"straight", "--hair", "curled"}, {{"hairs", "straight curled"}}},
                        {"--vertices", {"9", "--vertices", "8"}, {{"vertices", "9 8"}}},
                        {"--rate", {"90", "--rate", "60"}, {{"rates_hz", "90 60"}}},
                        {"--seconds", {"2.5"}, {{"motion_s", "2.5"}}}},
                       motion_file_rows("motion_file"),
                       device_rows("all")}),
               kOut);
}

}  // namespace
}  // namespace strandcast::report_options_test
