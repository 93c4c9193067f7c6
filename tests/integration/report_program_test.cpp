// strandcast-report as a person runs it: a very small work-precision and streaming, their files, and bad
// input.
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

#include "common/base/file.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::report_program_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

struct Outcome {
  int exit_code = -1;
  std::string output;  // standard output and error
};

Outcome run_report(const TemporaryFolder& folder, const std::string& arguments) {
  const auto log = folder.path() / "log";
  const std::string command =
      fmt::format("'{}' {} >'{}' 2>&1", STRANDCAST_REPORT_PROGRAM, arguments, log.string());
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, load_text(log, 1u << 20).value()};
}

/// Rows of a CSV by column name; cells may be quoted.
std::vector<std::map<std::string, std::string>> parse_csv(const std::string& text) {
  std::vector<std::vector<std::string>> lines(1, {""});
  bool is_quoted = false;
  for (const char c : text) {
    if (c == '"') {
      is_quoted = !is_quoted;
    } else if (c == ',' && !is_quoted) {
      lines.back().emplace_back();
    } else if (c == '\n' && !is_quoted) {
      lines.push_back({""});
    } else {
      lines.back().back() += c;
    }
  }
  lines.pop_back();
  std::vector<std::map<std::string, std::string>> rows;
  for (size_t i = 1; i < lines.size(); ++i) {
    EXPECT_EQ(lines[i].size(), lines[0].size()) << "line " << i;
    std::map<std::string, std::string> row;
    for (size_t k = 0; k < std::min(lines[i].size(), lines[0].size()); ++k) row[lines[0][k]] = lines[i][k];
    rows.push_back(std::move(row));
  }
  return rows;
}

class ReportProgram : public testing::Test {
 protected:
  const std::map<std::string, std::string>& row_of(const std::string& test) const {
    static const std::map<std::string, std::string> kNone;
    for (const auto& row : rows_)
      if (row.at("test") == test) return row;
    ADD_FAILURE() << "no run of " << test;
    return kNone;
  }
  static double number(const std::map<std::string, std::string>& row, const std::string& column) {
    const auto cell = row.find(column);
    return cell == row.end() || cell->second.empty() ? NAN : std::stod(cell->second);
  }

  TemporaryFolder folder_;
  std::vector<std::map<std::string, std::string>> rows_;
};

// A scene that needs nothing: all that a step can be without is named, and none of it is missed.
TEST_F(ReportProgram, PruningOfTheBarestScene) {
  const auto out = folder_.path() / "pruning";
  const std::string scenes = (std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy" / "scenes").string();
  const Outcome done =
      run_report(folder_, fmt::format("pruning --scenes '{}' --scene minimal --steps 10 --no-pictures "
                                      "--sim-device lanes --out '{}'",
                                      scenes, out.string()));
  ASSERT_EQ(done.exit_code, 0) << done.output;
  EXPECT_THAT(done.output, HasSubstr("scene/bend_limit"));
  rows_ = parse_csv(load_text(out / "pruning.csv", 1u << 20).value());
  std::set<std::string> passes;
  for (const auto& row : rows_) {
    passes.insert(row.at("pass"));
    EXPECT_TRUE(row.at("same_hair") == "yes" || !row.at("note").empty()) << row.at("pass");
  }
  for (const char* pass : {"scene/wind", "scene/gusts", "scene/colliders", "scene/follicle_limit",
                           "scene/bend_limit", "scene/distance_field", "sim/volume"})
    EXPECT_TRUE(passes.contains(pass)) << pass;
  EXPECT_TRUE(std::filesystem::exists(out / "pruning.html"));
  EXPECT_EQ(run_report(folder_, fmt::format("pruning --scene nowhere --out '{}'", out.string())).exit_code,
            2);
}

// One model, one size, half a second of motion: what the numbers must be by the laws of rods and chains.
TEST_F(ReportProgram, ASmallWorkPrecisionKeepsTheLaws) {
  const auto out = folder_.path() / "report";
  const Outcome outcome =
      run_report(folder_, fmt::format("work-precision --quick --solver direct_rod --vertices 32 --rate 240 "
                                      "--seconds 0.5 --hair straight --hair curled --out '{}'",
                                      out.string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("run 1 of "));
  EXPECT_THAT(outcome.output,
              AllOf(HasSubstr("On straight hair, built-in head motion: does any other model beat direct_rod"),
                    HasSubstr("On curled hair, built-in head motion: does any other")));

  rows_ = parse_csv(load_text(out / "work_precision.csv", 1u << 20).value());
  for (const auto& row : rows_) {
    EXPECT_EQ(row.at("solver"), "direct_rod");
    EXPECT_THAT(row.at("note"), IsEmpty());
    EXPECT_LE(number(row, "largest_stretch"), 1e-3) << row.at("test");
  }
  EXPECT_LE(number(row_of("T4, T7"), "period_error"), 0.01);
  EXPECT_NEAR(number(row_of("T4, T7"), "exact"), 0.91380, 1e-5) << "period of a heavy chain of 0.3 m, s";
  EXPECT_LE(number(row_of("T5"), "period_error"), 0.01);
  EXPECT_NEAR(number(row_of("T1 Gamma 10"), "droop"), 0.7002, 0.0025);
  EXPECT_LE(number(row_of("T9"), "error"), 0.01);
  EXPECT_NEAR(number(row_of("T10"), "value"), 7.83735, 0.08);

  for (const char* hair : {"motion, straight hair", "motion, curled hair"}) {
    SCOPED_TRACE(hair);
    const auto& motion = row_of(hair);
    EXPECT_GT(number(motion, "us_per_strand_frame"), 0.0);
    EXPECT_LE(number(motion, "error"), 0.01);
    EXPECT_GT(number(motion, "error"), 0.0);
    EXPECT_LE(number(motion, "float_error"), 1e-3);
    // The distances of a triangle: run, model refined, rod.
    EXPECT_LE(number(motion, "error"),
              1.01 * (number(motion, "model_error") + number(motion, "discretisation_error")));
  }

  const std::string page = load_text(out / "work_precision.html", 1u << 24).value();
  EXPECT_THAT(page, HasSubstr("How far the reference is from"));
  EXPECT_THAT(page, HasSubstr("</html>"));
  for (const char* loader : {"src=", "href=", "@import", "url(", "<script"})
    EXPECT_THAT(page, Not(HasSubstr(loader)));
  EXPECT_THAT(load_text(out / "work_precision_curled.svg", 1u << 24).value(), HasSubstr("direct_rod"));
}

// Each executor runs the same settings, with the same errors but for float, and has a front and files of its
// own.
TEST_F(ReportProgram, WorkPrecisionRunsOnEveryExecutorBesideEachOther) {
  const auto out = folder_.path() / "report";
  const Outcome outcome =
      run_report(folder_, fmt::format("work-precision --quick --solver dftl --vertices 8 "
                                      "--rate 30 --seconds 0.2 --hair straight --sim-device all --out '{}'",
                                      out.string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output,
              AllOf(HasSubstr("built-in head motion, on gl: does any"),
                    HasSubstr("built-in head motion, on lanes: does any"), HasSubstr("lanes take ")));
  std::map<std::string, std::map<std::string, double>> errors;  // of each setting, by device
  rows_ = parse_csv(load_text(out / "work_precision.csv", 1u << 20).value());
  for (const auto& row : rows_) {
    EXPECT_THAT(row.at("note"), IsEmpty());
    if (row.at("test") != "motion, straight hair") continue;
    EXPECT_GT(number(row, "us_per_strand_frame"), 0.0);
    EXPECT_LE(number(row, "float_error"), 1e-3) << row.at("device");
    const std::string setting =
        fmt::format("{}, {}, {}", row.at("solver"), row.at("material"), row.at("effort"));
    EXPECT_TRUE(errors[setting].emplace(row.at("device"), number(row, "error")).second) << setting;
  }
  EXPECT_EQ(errors.size(), 2u) << "a chain and as shipped";
  for (const auto& [setting, of_device] : errors) {
    ASSERT_EQ(of_device.size(), 2u) << setting;
    EXPECT_NEAR(of_device.at("gl"), of_device.at("lanes"), 2e-3) << setting;
  }
  for (const char* name : {"work_precision_straight_gl.svg", "work_precision_straight_lanes.svg"})
    EXPECT_THAT(load_text(out / name, 1u << 24).value(), HasSubstr("dftl")) << name;
  EXPECT_THAT(load_text(out / "work_precision_straight.svg", 1u << 24).value(), HasSubstr(">lanes</text>"));
  EXPECT_THAT(load_text(out / "work_precision.html", 1u << 24).value(),
              HasSubstr("gl, lanes beside each other"));
}

// Few strands, half a second: every codec at every bound, and none of ours beyond it.
TEST_F(ReportProgram, ASmallStreamingReportKeepsItsBounds) {
  const auto out = folder_.path() / "report";
  const Outcome outcome = run_report(
      folder_,
      fmt::format(
          "streaming --quick --size 60x8 --seconds 0.5 --view 160x90 --solver dftl --solver mass_spring "
          "--clips /nonexistent --gl-device none --out '{}'",
          out.string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("run 1 of "));

  std::map<std::string, std::set<std::string>> bounds_mm;  // of each codec of ours
  std::set<std::tuple<std::string, std::string, std::string>> clips;
  rows_ = parse_csv(load_text(out / "streaming.csv", 1u << 20).value());
  for (const auto& row : rows_) {
    clips.emplace(row.at("clip"), row.at("part"), row.at("solver"));
    if (row.at("solver") != "dftl") {
      EXPECT_EQ(row.at("kind"), "ours");
    }
    EXPECT_EQ(row.at("strands"), "60");
    for (const char* column : {"bits_per_vertex", "keyframe_bits_per_vertex", "mbit_per_s", "encode_wall_ms"})
      EXPECT_GT(number(row, column), 0.0) << row.at("codec") << ", " << column;
    // 60 x 8 vertices, 60 times a second.
    EXPECT_NEAR(number(row, "mbit_per_s"), number(row, "bits_per_vertex") * 60.0 * 8.0 * 60.0 * 1e-6,
                1e-4 * number(row, "mbit_per_s"));
    EXPECT_LE(number(row, "rms_error_mm"), number(row, "max_error_mm"));
    if (row.at("kind") != "ours") continue;
    bounds_mm[row.at("codec")].insert(row.at("bound_mm"));
    EXPECT_EQ(row.at("keeps_bound"), "yes") << row.at("codec");
    EXPECT_LE(number(row, "max_error_mm"), 1.0001 * number(row, "bound_mm")) << row.at("codec");
  }
  EXPECT_EQ(clips.size(), 12u) << "the median and the wildest part of three motions, with two solvers";
  const std::set<std::string> all_bounds = {"0.02", "0.05", "0.1", "0.2", "0.5"};
  for (const char* codec : {"tangent", "delta", "raw"}) EXPECT_EQ(bounds_mm[codec], all_bounds) << codec;

  const std::string page = load_text(out / "streaming.html", 1u << 24).value();
  for (const char* part :
       {"</html>", "walking and turning: at most 3.5 bits per vertex", "idle: at most 1.8",
        "violent: at most 6", "wildest part of any motion: at most 6", "at least 2 times fewer bits",
        "at least 6 times fewer bits", "decode 160000 vertices in 12 ms", "encode them in 16 ms",
        "at most 13 bits", "every vertex of every frame within the bound", "TCP on loopback",
        "60 strands of 8 vertices take", "All heads are built in", "How it looks", "Strands or pictures?",
        "mass_spring"})
    EXPECT_THAT(page, HasSubstr(part));
  for (const char* plot : {"streaming_bound.svg", "streaming_time.svg", "streaming_motion.svg"})
    EXPECT_THAT(load_text(out / plot, 1u << 24).value(), HasSubstr("tangent")) << plot;
  EXPECT_THAT(load_text(out / "streaming_view.svg", 1u << 24).value(), HasSubstr("from 3 m"));
  rows_ = parse_csv(load_text(out / "streaming_view.csv", 1u << 20).value());
  EXPECT_EQ(rows_.size(), 2 * 2 * all_bounds.size()) << "near and far, two codecs";
  EXPECT_THAT(load_text(out / "streaming_playout.csv", 1u << 20).value(), HasSubstr("cubic"));
  rows_ = parse_csv(load_text(out / "streaming_pixels.csv", 1u << 20).value());
  EXPECT_GT(rows_.size(), 0u);
}

// Few hairs and short runs: a volume asked of all hairs as the truth is has no error, guides have one, every
// way to scatter but hashing is a sum of the same samples, and hair keeps more of its volume with it than
// without.
TEST_F(ReportProgram, ASmallVolumeReportKeepsTheLaws) {
  const auto out = folder_.path() / "report";
  const Outcome outcome = run_report(
      folder_, fmt::format("volume --quick --set groom.procedural.strand_count=600 --guides 150 --out '{}'",
                           out.string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("150 guides know the density of 600 hairs within "));

  rows_ = parse_csv(load_text(out / "volume_error.csv", 1u << 20).value());
  std::map<std::string, double> error;  // of the truth's cells and smoothing
  for (const auto& row : rows_) {
    EXPECT_GT(number(row, "cpu_ms"), 0.0);
    const bool is_like_truth =
        row.at("resolution") == "64" && row.at("smoothing") == "1" && row.at("interval") == "1";
    if (is_like_truth)
      error[row.at("hairs")] = number(row, "density");
    else
      EXPECT_GT(number(row, "density"), 0.01) << row.at("resolution") << ' ' << row.at("smoothing");
  }
  EXPECT_EQ(error.at("all hairs"), 0.0);
  EXPECT_GT(error.at("guides"), 0.05);

  rows_ = parse_csv(load_text(out / "volume_scatter.csv", 1u << 20).value());
  std::set<std::string> names;
  for (const auto& row : rows_) {
    const std::string name = row.at("scatter");
    names.insert(name);
    EXPECT_TRUE(row.at("in_use") == "0" || row.at("repeatable") == "1") << name;
    if (name == "hashing") {
      EXPECT_GT(number(row, "density"), 0.01) << "what lies across a plane is missed";
    } else {
      // Places have the roundings of floats that count cells from the head joint: 64 of them, to 2^-24 each.
      EXPECT_LT(number(row, "density"), 1e-5) << name;
      EXPECT_LT(number(row, "momentum"), 1e-4) << name;
      EXPECT_EQ(number(row, "lost_share"), 0.0) << name;
    }
  }
  EXPECT_THAT(names,
              testing::UnorderedElementsAre("host", "sort", "atomics", "raster", "counting", "hashing"));

  rows_ = parse_csv(load_text(out / "volume_outcome.csv", 1u << 20).value());
  std::map<std::string, double> share;
  for (const auto& row : rows_) share[row.at("volume")] = number(row, "volume_share");
  EXPECT_GT(share.at("as shipped"), share.at("no volume") + 0.05);
  const std::string page = load_text(out / "volume.html", 1u << 24).value();
  EXPECT_THAT(page, AllOf(HasSubstr("</html>"), HasSubstr("Breaking (Sams 2014, 4.2)")));
}

TEST_F(ReportProgram, RefusesBadInputInOneSentence) {
  const std::string out = (folder_.path() / "report").string();
  folder_.write("file", "");
  folder_.write("bad.bvh", "HIERARCHY\nROOT");
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"", "subcommand"},
      {"work-precision", "--out"},
      {fmt::format("work-precision --out '{}' --solver nonsense", out), "unknown solver 'nonsense' (known: "},
      {fmt::format("work-precision --out '{}' --hair red", out), "unknown --hair 'red'"},
      {fmt::format("work-precision --out '{}' --rate 50", out), "--rate is 50 Hz"},
      {fmt::format("work-precision --out '{}' --vertices 65", out), "--vertices is 65"},
      {fmt::format("work-precision --out '{}' --seconds 1e9", out), "--seconds is 1e+09"},
      {fmt::format("work-precision --out '{}' --motion '{}'", out, (folder_.path() / "bad.bvh").string()),
       "bad.bvh"},
      {fmt::format("work-precision --out '{}' --gl-device nonsense", out), "nonsense"},
      {fmt::format("stability --out '{}' --sim-device nonsense", out), "nonsense"},
      {fmt::format("stability --out '{}' --sim-device all", out), "all"},
      {fmt::format("work-precision --out '{}'", (folder_.path() / "file").string()), "folder"},
      {"streaming", "--out"},
      {fmt::format("streaming --out '{}' --size 10", out), "--size is '10'"},
      {fmt::format("streaming --out '{}' --size 10x65", out), "--size is '10x65'"},
      {fmt::format("streaming --out '{}' --seconds 0.1", out), "--seconds is 0.1"},
      {fmt::format("streaming --out '{}' --view 10x10", out), "--view is '10x10'"},
      {fmt::format("streaming --out '{}' --view 641x360", out), "--view is '641x360'"},
      {fmt::format("streaming --out '{}' --clips . --motion x.bvh", out), "excludes"},
      {fmt::format("streaming --out '{}' --solver nonsense", out), "unknown solver 'nonsense' (known: "},
      {fmt::format("streaming --out '{}' --motion '{}'", out, (folder_.path() / "bad.bvh").string()),
       "bad.bvh"},
      {fmt::format("volume --out '{}' --set groom.procedural.strand_count=10 --guides 11", out),
       "11 guides of 10 hairs"},
      {fmt::format("streaming --out '{}' --size 200000x64 --gl-device none", out), "MiB"},
  };
  for (const auto& [arguments, part] : bad) {
    const Outcome outcome = run_report(folder_, arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_THAT(outcome.output, HasSubstr(part)) << arguments;
    EXPECT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 1) << outcome.output;
  }
}

}  // namespace
}  // namespace strandcast::report_program_test
