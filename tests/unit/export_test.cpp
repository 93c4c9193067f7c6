// Exports: files that come back as what went in.
#include <algorithm>
#include <cmath>

#include "client/export/export_strands.h"
#include "client/export/frame_sampler.h"
#include "client/export/strand_writer.h"
#include "common/base/crc32.h"
#include "common/base/file.h"
#include "common/groom/abc_curves.h"
#include "common/groom/abc_tree.h"
#include "common/groom/groom_file.h"
#include "common/groom/usd_stage.h"
#include "tests/support/made_states.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/usdc_found.h"

namespace strandcast::export_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kReimportM = 1e-6;

const std::atomic<bool> kNeverStopped{false};

ExportReport exported(MadeStates& states, ExportOptions options) {
  options.is_quiet = true;
  const auto report = export_strands(states, options, kNeverStopped);
  EXPECT_TRUE(report) << report.error().to_string();
  return report ? *report : ExportReport{};
}

/// Strands of a file as head space, strand after strand.
Groom imported(const std::filesystem::path& path) {
  GroomFileOptions options;
  options.path = path;
  options.is_z_up.reset();
  const auto placed = load_placed_groom(options);
  EXPECT_TRUE(placed) << placed.error().to_string();
  return placed ? placed->groom : Groom{};
}

TEST(Export, EveryFormatUnitAxisAndSpaceComesBackWithinAMicrometre) {
  const TemporaryFolder folder;
  const std::vector<glm::vec3> at_a_fifth = positions_in_head(*state_at(12 * kStepNs));  // of a second
  for (const std::string extension : {".usda", ".usdc", ".usdz", ".abc", ".ply"}) {
    for (const double unit_m : {0.01, 1.0}) {
      for (const ExportUp up : {ExportUp::Y, ExportUp::Z}) {
        for (const ExportSpace space : {ExportSpace::Head, ExportSpace::World}) {
          MadeStates states(30);
          ExportOptions options;
          options.path = folder.path() / ("hair" + extension);
          options.unit_m = unit_m;
          options.up = up;
          options.space = space;
          options.from_s = 0.2;
          options.is_one_frame = true;
          const ExportReport report = exported(states, options);
          EXPECT_EQ(report.frame_count, 1u);
          EXPECT_EQ(report.strand_count, kStrands);
          const Groom groom = imported(options.path);
          ASSERT_EQ(groom.strand_count(), kStrands);
          ASSERT_EQ(groom.uniform_vertex_count(), kVertices);
          const bool is_rest = extension != ".ply";
          const Pose pose = space == ExportSpace::World ? pose_of(0.2) : Pose{};
          for (uint32_t strand = 0; strand < kStrands; ++strand) {
            for (uint32_t vertex = 0; vertex < kVertices; ++vertex) {
              const glm::vec3 sent =
                  is_rest ? place_of(strand, vertex, 0.0) : at_a_fifth[vertex * kStrands + strand];
              const glm::dvec3 found(groom.rest_position_m[groom.offset[strand] + vertex]);
              EXPECT_LT(glm::distance(found, pose * glm::dvec3(sent)), kReimportM);
            }
          }
        }
      }
    }
  }
}

/// Rows of a CSV file: numbers, NaN where there is nothing.
std::vector<std::vector<double>> rows_of(const std::filesystem::path& path) {
  const auto text = load_text(path, 1 << 24);
  EXPECT_TRUE(text);
  std::vector<std::vector<double>> rows;
  std::istringstream lines(*text);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "frame,time_s,strand,vertex,x_cm,y_cm,z_cm,width_cm");
  while (std::getline(lines, line)) {
    std::vector<double>& row = rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');)
      row.push_back(cell.empty() ? NAN : std::stod(cell));
  }
  return rows;
}

TEST(Export, CsvHasARowForEachVertexOfEachFrameInOrder) {
  const TemporaryFolder folder;
  MadeStates states(61);
  ExportOptions options;
  options.path = folder.path() / "new folder" / "hair.csv";
  options.fps = {24, 1};
  const ExportReport report = exported(states, options);
  EXPECT_EQ(report.frame_count, 25u);
  EXPECT_THAT(report.remarks, Contains("the source says so"));
  const auto rows = rows_of(options.path);
  ASSERT_EQ(rows.size(), 26u * kStrands * kVertices);
  for (size_t i = 0; i < rows.size(); ++i) {
    const auto& row = rows[i];
    ASSERT_EQ(row.size(), 8u);
    const auto frame = static_cast<double>(i / (kStrands * kVertices));
    EXPECT_EQ(row[0], frame);
    EXPECT_EQ(row[2], static_cast<double>(i / kVertices % kStrands));
    EXPECT_EQ(row[3], static_cast<double>(i % kVertices));
    const double t_s = (frame - 1.0) / 24.0;
    if (frame == 0.0)
      EXPECT_TRUE(std::isnan(row[1]));
    else
      EXPECT_NEAR(row[1], t_s, 1e-6);
    const glm::vec3 expected =
        place_of(static_cast<uint32_t>(row[2]), static_cast<uint32_t>(row[3]), std::max(t_s, 0.0));
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(row[4 + static_cast<size_t>(axis)], 100.0 * expected[axis], 100.0 * (kReimportM + 1e-4));
    // 0.4 mm at the root, a quarter of it at the tip.
    EXPECT_NEAR(row[7], 0.04 * (1.0 - 0.75 * row[3] / (kVertices - 1)), 1e-6);
  }
}

TEST(Export, UsdaSaysWhatProgramsGuessWrongOtherwise) {
  const TemporaryFolder folder;
  MadeStates states(61);
  ExportOptions options;
  options.path = folder.path() / "hair.usda";
  options.fps = {25, 1};
  options.up = ExportUp::Z;
  options.role = ExportRole::Guides;
  exported(states, options);
  const std::string text = *load_text(options.path, 1 << 24);
  for (const char* const said : {"#usda 1.0\n",
                                 "metersPerUnit = 0.01\n",
                                 "upAxis = \"Z\"\n",
                                 "startTimeCode = 1\n",
                                 "endTimeCode = 26 ",
                                 "timeCodesPerSecond = 25\n",
                                 "framesPerSecond = 25\n",
                                 "defaultPrim = \"Hair\"\n",
                                 "prepend apiSchemas = [\"GroomAPI\"]",
                                 "uniform token type = \"linear\"",
                                 "uniform token wrap = \"nonperiodic\"",
                                 "int[] curveVertexCounts = [5, 5, 5, 5, 5, 5, 5]",
                                 "userProperties:groom_version_major = 1",
                                 "userProperties:groom_version_minor = 5",
                                 "primvars:groom_guide = [1, 1, 1, 1, 1, 1, 1]",
                                 "primvars:groom_group_id = [0, 0, 0, 0, 0, 0, 0]",
                                 "primvars:groom_root_uv = [(",
                                 "float[] widths = [0.04, ",
                                 "\n            0: [(",
                                 "\n            26: [("})
    EXPECT_THAT(text, HasSubstr(said));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "hair.usda.part"));
}

// Rates of film and television: frames lie where the exact quotient says, over a minute and at its end.
TEST(Export, FramesOfRationalRatesAreAtTheirTimes) {
  for (const std::string asked : {"23.976", "24000/1001", "29.97", "59.94", "0.5", "240"}) {
    const TemporaryFolder folder;
    MadeStates states(61);
    ExportOptions options;
    options.path = folder.path() / "hair.csv";
    options.fps = *parse_frame_rate(asked);
    const ExportReport report = exported(states, options);
    EXPECT_EQ(report.frame_count, static_cast<uint64_t>(options.fps.hz() + 1e-9) + 1) << asked;
    const auto rows = rows_of(options.path);
    for (size_t i = kStrands * kVertices; i < rows.size(); i += kStrands * kVertices)
      EXPECT_NEAR(rows[i][1], (rows[i][0] - 1.0) / options.fps.hz(), 1e-6) << asked;
    options.path = folder.path() / "hair.usda";
    MadeStates same(61);
    exported(same, options);
    const std::string text = *load_text(options.path, 1 << 26);
    EXPECT_THAT(text, HasSubstr(fmt::format("timeCodesPerSecond = {}\n", options.fps.hz()))) << asked;
  }
}

/// A second from 01:02:03:04 at 23.976 frames a second on, and a quarter of a frame.
void count_timecode(MadeStates& states) {
  const Timecode first = advanced(*parse_timecode("01:02:03:04", {24000, 1001}), 0.25);
  for (const auto& state : states.states_) {
    const double passed_s = static_cast<double>(state->sim_time_ns) * 1e-9;
    states.timecodes_.add(state->sim_time_ns, advanced(first, passed_s * first.rate.hz()));
  }
}

TEST(Export, FilesBeginAtTheirFrameOfTimecode) {
  const TemporaryFolder folder;
  ExportOptions options;
  options.path = folder.path() / "hair.usda";
  MadeStates states(61);
  count_timecode(states);
  const ExportReport report = exported(states, options);
  EXPECT_EQ(report.first_timecode, "01:02:03:05") << "the first whole frame";
  EXPECT_NEAR(report.first_s, 0.75 * 1001.0 / 24000.0, 1e-8);
  EXPECT_EQ(report.frame_count, 24u) << "1.0 s has 24.2 frames from 0.25 on, of which 05 to 28 are whole";
  const std::string text = *load_text(options.path, 1 << 26);
  const int first = (3600 + 2 * 60 + 3) * 24 + 5;
  for (const std::string& said :
       {fmt::format("startTimeCode = {}\n", first), fmt::format("endTimeCode = {} ", first + 23),
        fmt::format("timeCodesPerSecond = {}\n", 24000.0 / 1001.0),
        fmt::format("\n            {}: [(", first - 1), fmt::format("\n            {}: [(", first)})
    EXPECT_THAT(text, HasSubstr(said));
  options.path = folder.path() / "hair.abc";
  MadeStates same(61);
  count_timecode(same);
  exported(same, options);
  const std::string bytes = *load_text(options.path, 1 << 26);
  for (const double s : {(first - 1) * 1001.0 / 24000.0, 1001.0 / 24000.0}) {
    const double nearby[] = {s, std::nextafter(s, 0.0), std::nextafter(s, 2.0 * s)};
    EXPECT_TRUE(std::any_of(std::begin(nearby), std::end(nearby), [&](double value) {
      return bytes.find(std::string(reinterpret_cast<const char*>(&value), sizeof(value))) !=
             std::string::npos;
    })) << s;
  }
}

TEST(Export, AnExportOfARunningServerBeginsAtAFrameOfItsTimecode) {
  const TemporaryFolder folder;
  ExportOptions options;
  options.path = folder.path() / "hair.csv";
  options.is_quiet = true;
  const FrameRate rate{24000, 1001};
  const Timecode first = advanced(*parse_timecode("01:02:03:04", rate), 0.25);
  const auto run = [&](const char* from, const char* to) {
    options.from_timecode = from;
    options.to_timecode = to;
    MadeStates states(61);
    states.counted_ = {3 * kStepNs, advanced(first, 3e-9 * static_cast<double>(kStepNs) * rate.hz())};
    return export_strands(states, options, kNeverStopped);
  };
  const auto whole = run("", "");
  ASSERT_TRUE(whole) << whole.error().to_string();
  EXPECT_EQ(whole->first_timecode, "01:02:03:05") << "the first whole frame";
  EXPECT_NEAR(whole->first_s, 0.75 / rate.hz(), 1e-8);
  EXPECT_EQ(whole->frame_count, 24u) << "as of a recording of the same states";
  EXPECT_EQ(rows_of(options.path)[0][0] + 1, (3600 + 2 * 60 + 3) * 24 + 5) << "the rest shape is before";
  const auto range = run("01:02:03:10", "01:02:03:15");
  ASSERT_TRUE(range) << range.error().to_string();
  EXPECT_EQ(range->frame_count, 6u);
  EXPECT_NEAR(range->first_s, 5.75 / rate.hz(), 1e-8);
  EXPECT_THAT(run("01:02:03:03", "").error().message, HasSubstr("it is 01:02:03:04 already"));
  EXPECT_THAT(run("01:02:03:10", "01:02:03:09").error().message, HasSubstr("before the beginning"));
  options.to_s = 0.5;  // of seconds, the usual wish
  EXPECT_EQ(run("", "")->frame_count, 12u) << "0.5 s have 11.99 frames; 0.75 of one is waited for";
  options.has_fps = true;
  EXPECT_EQ(run("", "")->first_timecode, "") << "30 frames a second are not those that are counted";
}

TEST(Export, WhereTimecodeJumpsAllIsExportedAtItsRateAndSaid) {
  const TemporaryFolder folder;
  ExportOptions options;
  options.path = folder.path() / "hair.csv";
  MadeStates states(61);
  count_timecode(states);
  states.timecodes_.add(states.states_.back()->sim_time_ns, *parse_timecode("05:00:00:00", {24000, 1001}));
  const ExportReport report = exported(states, options);
  EXPECT_EQ(report.frame_count, 24u) << "1.0 s at 23.976, the first at the first state";
  EXPECT_NEAR(report.fps, 24000.0 / 1001.0, 1e-9);
  EXPECT_THAT(report.remarks, testing::Contains(testing::AllOf(
                                  HasSubstr("frames count from 1, not by timecode"),
                                  HasSubstr("with 1 jump to 05:00:00:00"), HasSubstr("--from and --to"))));
}

TEST(Export, ARangeOfTimecodeIsKept) {
  const TemporaryFolder folder;
  ExportOptions options;
  options.path = folder.path() / "hair.csv";
  options.from_timecode = "01:02:03:10";
  options.to_timecode = "01:02:03:15";
  MadeStates states(61);
  count_timecode(states);
  EXPECT_EQ(exported(states, options).frame_count, 6u);
  options.to_timecode.clear();
  options.to_s = 5.0 * 1001.0 / 24000.0;
  MadeStates length(61);
  count_timecode(length);
  EXPECT_EQ(exported(length, options).frame_count, 6u) << "so long behind the timecode";
  options.to_s.reset();
  const auto rows = rows_of(options.path);
  EXPECT_EQ(rows[kStrands * kVertices][0], (3600 + 2 * 60 + 3) * 24 + 10);
  EXPECT_NEAR(rows[kStrands * kVertices][1], 5.75 * 1001.0 / 24000.0, 1e-6);
  const auto refusal = [&](const char* from, const char* to, MadeStates& source) {
    options.from_timecode = from;
    options.to_timecode = to;
    options.is_quiet = true;
    const auto report = export_strands(source, options, kNeverStopped);
    return report ? std::string() : report.error().to_string();
  };
  EXPECT_THAT(refusal("02:00:00:00", "", states),
              testing::AllOf(HasSubstr("they go from 01:02:03:04 to 01:02:04:"), Not(HasSubstr("jumps"))));
  EXPECT_THAT(refusal("01:02:03:20", "01:02:03:10", states), HasSubstr("before the beginning"));
  EXPECT_THAT(refusal("01:02:03:24", "", states), HasSubstr("23:59:59:23"));
  MadeStates none(61);
  EXPECT_THAT(refusal("01:02:03:10", "", none), HasSubstr("carry no timecode"));
  options.fps = {30, 1};
  options.has_fps = true;
  EXPECT_THAT(refusal("01:02:03:10", "", states), HasSubstr("count 23.976 frames per second"));
}

TEST(Export, UsdaFramesAreTheStatesAtTheirTimes) {
  const TemporaryFolder folder;
  MadeStates states(61);
  ExportOptions options;
  options.path = folder.path() / "hair.usda";
  options.space = ExportSpace::World;
  options.fps = {24, 1};
  options.from_s = 0.25;
  exported(states, options);
  const std::string text = *load_text(options.path, 1 << 24);
  const auto line_after = [&text](const std::string& begin) {
    const size_t at = text.find(begin) + begin.size();
    EXPECT_NE(text.find(begin), std::string::npos) << begin;
    return text.substr(at, text.find('\n', at) - at);
  };
  const std::string rest = line_after("point3f[] points = ");
  for (int frame = 1; frame <= 19; ++frame) {
    // As the file's points, which the reader takes.
    std::string still = text;
    std::string points = line_after(fmt::format("\n            {}: ", frame));
    points.pop_back();
    still.replace(still.find(rest), rest.size(), points);
    const Groom groom = imported(folder.write("still.usda", still));
    ASSERT_EQ(groom.strand_count(), kStrands);
    const double t_s = 0.25 + (frame - 1) / 24.0;
    for (uint32_t strand = 0; strand < kStrands; ++strand) {
      for (uint32_t vertex = 0; vertex < kVertices; ++vertex) {
        const glm::dvec3 expected = pose_of(t_s) * glm::dvec3(place_of(strand, vertex, t_s));
        const glm::dvec3 found(groom.rest_position_m[groom.offset[strand] + vertex]);
        // What the states' lattice and the line at the end add is not the file's.
        EXPECT_LT(glm::distance(found, expected), kReimportM + (frame < 19 ? 3.0 : 20.0) * kQuantumM)
            << frame;
      }
    }
  }
}

/// The one curves object of a file, by the reader's own parts.
struct AbcFound {
  explicit AbcFound(const std::filesystem::path& path)
      : archive(*AbcArchive::read(*AbcContainer::open(path))), tree(*AbcTree::read(archive)) {
    for (const AbcNode& node : tree.nodes())
      if (node.kind == AbcKind::Curves) reader.emplace(*AbcCurvesReader::open(archive, node.object));
  }
  AbcArchive archive;
  AbcTree tree;
  std::optional<AbcCurvesReader> reader;
};

TEST(Export, AbcSamplesAreTheFramesWithinAMicrometre) {
  const TemporaryFolder folder;
  for (const double unit_m : {0.01, 1.0}) {
    MadeStates states(61);
    ExportOptions options;
    options.path = folder.path() / "hair.abc";
    options.unit_m = unit_m;
    options.space = ExportSpace::World;
    options.fps = {24, 1};
    const ExportReport report = exported(states, options);
    EXPECT_EQ(report.frame_count, 25u);
    EXPECT_EQ(report.bytes, std::filesystem::file_size(options.path));
    FrameSampler sampler({{24, 1}, 0.0, {}}, StrandFill());
    for (const auto& state : states.states_) sampler.add(state);
    sampler.finish();
    std::optional<SampledFrame> frame = sampler.next();
    const StrandSet strands(states.scene(), options, frame->strands);
    const AbcFound found(options.path);
    ASSERT_EQ(found.reader->sample_count(), 26u);
    const auto expect_sample = [&](uint64_t sample, const std::vector<glm::dvec3>& expected) {
      EXPECT_NEAR(found.reader->time_s(sample), static_cast<double>(sample) / 24.0, 1e-12);
      const auto curves = found.reader->read(sample, kMaxStrandCount, kMaxGroomVertices);
      ASSERT_TRUE(curves) << curves.error().to_string();
      EXPECT_EQ(curves->vertex_counts, std::vector<uint32_t>(kStrands, kVertices));
      for (size_t i = 0; i < expected.size(); ++i)
        EXPECT_LT(glm::distance(glm::dvec3(curves->points[i]), expected[i]) * unit_m, kReimportM);
    };
    expect_sample(0, strands.rest_points());
    for (; frame; frame = sampler.next()) expect_sample(frame->index + 1, strands.points(frame->strands));
  }
}

TEST(Export, UsdcSamplesAreTheFramesWithinAMicrometre) {
  const TemporaryFolder folder;
  for (const double unit_m : {0.01, 1.0}) {
    MadeStates states(61);
    ExportOptions options;
    options.path = folder.path() / "hair.usdc";
    options.unit_m = unit_m;
    options.space = ExportSpace::World;
    options.fps = {24, 1};
    const ExportReport report = exported(states, options);
    EXPECT_EQ(report.frame_count, 25u);
    EXPECT_EQ(report.bytes, std::filesystem::file_size(options.path));
    FrameSampler sampler({{24, 1}, 0.0, {}}, StrandFill());
    for (const auto& state : states.states_) sampler.add(state);
    sampler.finish();
    std::optional<SampledFrame> frame = sampler.next();
    const StrandSet strands(states.scene(), options, frame->strands);
    const test::UsdcFound found(options.path);
    const UsdcValue samples = found.get("Strands", "points", "timeSamples");
    const UsdcValue boxes = found.get("Strands", "extent", "timeSamples");
    const auto expect_sample = [&](uint64_t sample, const std::vector<glm::dvec3>& expected) {
      const auto kept = *found.archive.sample(samples, sample);
      ASSERT_TRUE(kept);
      EXPECT_EQ(kept->time, static_cast<double>(sample));
      const auto points = *found.archive.points(kept->value, kMaxGroomVertices);
      ASSERT_EQ(points.size(), expected.size());
      const auto box = *found.archive.points((*found.archive.sample(boxes, sample))->value, 2);
      const double half_width = 0.5 * 0.0004 / unit_m;  // strands of 0.4 mm
      for (size_t i = 0; i < expected.size(); ++i) {
        EXPECT_LT(glm::distance(glm::dvec3(points[i]), expected[i]) * unit_m, kReimportM);
        EXPECT_TRUE(glm::all(glm::lessThanEqual(box[0], points[i])) &&
                    glm::all(glm::lessThanEqual(points[i], box[1])));
      }
      for (int axis = 0; axis < 3; ++axis) {
        const auto [low, high] = std::minmax_element(
            points.begin(), points.end(), [&](const auto& a, const auto& b) { return a[axis] < b[axis]; });
        EXPECT_NEAR(box[0][axis], (*low)[axis] - half_width, 0.1 * half_width);
        EXPECT_NEAR(box[1][axis], (*high)[axis] + half_width, 0.1 * half_width);
      }
    };
    expect_sample(0, strands.rest_points());
    for (; frame; frame = sampler.next()) expect_sample(frame->index + 1, strands.points(frame->strands));
    EXPECT_FALSE(*found.archive.sample(samples, 26));
  }
}

TEST(Export, UsdcSaysWhatUsdaSays) {
  const TemporaryFolder folder;
  ExportOptions options;
  options.fps = {25, 1};
  options.up = ExportUp::Z;
  options.role = ExportRole::Guides;
  auto origin = std::make_shared<ExportOrigin>();
  origin->object_name = {"fringe"};
  origin->object.assign(kStrands, 0);
  for (uint32_t strand = 0; strand < kStrands; ++strand) origin->place.push_back(strand);
  for (const char* const name : {"hair.usda", "hair.usdc"}) {
    MadeStates states(61);
    states.scene_.origin = origin;
    options.path = folder.path() / name;
    exported(states, options);
  }
  const std::string text = *load_text(folder.path() / "hair.usda", 1 << 24);
  const auto written = read_usda_stage(text);
  const auto read = read_usdc_stage(*GroomSource::open(options.path));
  ASSERT_TRUE(read) << read.error().to_string();
  EXPECT_EQ(read->meters_per_unit, written->meters_per_unit);
  EXPECT_EQ(read->is_z_up, written->is_z_up);
  ASSERT_EQ(read->prim.size(), written->prim.size());
  for (size_t i = 0; i < read->prim.size(); ++i) EXPECT_EQ(read->prim[i].name, written->prim[i].name);
  const UsdCurves &curves = *read->prim[1].curves, &expected = *written->prim[1].curves;
  EXPECT_EQ(curves.vertex_counts, expected.vertex_counts);
  EXPECT_EQ(curves.type, expected.type);
  EXPECT_EQ(curves.wrap, expected.wrap);
  EXPECT_EQ(curves.ids, expected.ids);
  EXPECT_EQ(curves.groups, expected.groups);
  ASSERT_EQ(curves.root_uv.size(), 2 * kStrands);
  for (size_t i = 0; i < curves.root_uv.size(); ++i)
    EXPECT_NEAR(curves.root_uv[i], expected.root_uv.at(i), 1e-5);
  ASSERT_EQ(curves.widths.size(), expected.widths.size());
  for (size_t i = 0; i < curves.widths.size(); ++i) EXPECT_NEAR(curves.widths[i], expected.widths[i], 1e-7);

  const test::UsdcFound found(options.path);
  const auto word = [&](const char* prim, const char* property, const char* field = "default") {
    return *found.archive.text(found.get(prim, property, field));
  };
  const auto number = [&](const char* prim, const char* property, const char* field = "default") {
    return found.archive.numbers(found.get(prim, property, field))->at(0);
  };
  EXPECT_EQ(word("", "", "defaultPrim"), "Hair");
  EXPECT_THAT(text, HasSubstr(fmt::format("doc = \"{}\"", word("", "", "documentation"))));
  EXPECT_EQ(number("", "", "startTimeCode"), 1.0);
  EXPECT_EQ(number("", "", "endTimeCode"), 26.0);
  EXPECT_EQ(number("", "", "timeCodesPerSecond"), 25.0);
  EXPECT_EQ(number("", "", "framesPerSecond"), 25.0);
  EXPECT_EQ(word("Hair", "", "kind"), "component");
  EXPECT_EQ(number("Strands", "userProperties:groom_version_major"), 1.0);
  EXPECT_EQ(number("Strands", "userProperties:groom_version_minor"), 5.0);
  EXPECT_EQ(word("Strands", "widths", "interpolation"), "vertex");
  EXPECT_EQ(word("Strands", "primvars:groom_root_uv", "interpolation"), "uniform");
  EXPECT_EQ(*found.archive.ints(found.get("Strands", "primvars:groom_guide"), kStrands),
            std::vector<int32_t>(kStrands, 1));
  EXPECT_EQ(*found.archive.ints(found.get("Strands", "primvars:groom_group_id"), kStrands),
            std::vector<int32_t>(kStrands, 0));
  // Every property of the text is in the binary form with the same type.
  for (const char* const typed :
       {"token type", "token wrap", "int[] curveVertexCounts", "float[] widths", "int[] primvars:groom_guide",
        "int[] primvars:groom_group_id", "int[] primvars:groom_id", "string[] primvars:groom_group_name",
        "texCoord2f[] primvars:groom_root_uv", "point3f[] points", "float3[] extent"}) {
    EXPECT_THAT(text, HasSubstr(fmt::format("{} = ", typed)));
    const std::string_view both = typed;
    const size_t space = both.find(' ');
    EXPECT_EQ(word("Strands", std::string(both.substr(space + 1)).c_str(), "typeName"),
              both.substr(0, space));
  }
}

TEST(Export, UsdzIsAPackageOfOneStoredFile) {
  const TemporaryFolder folder;
  ExportOptions options;
  std::string alone;
  for (const char* const name : {"hair.usdc", "hair.usdz"}) {
    MadeStates states(10);
    options.path = folder.path() / name;
    const ExportReport report = exported(states, options);
    EXPECT_EQ(report.bytes, std::filesystem::file_size(options.path));
    if (alone.empty()) alone = *load_text(options.path, 1 << 24);
  }
  const std::string zip = *load_text(options.path, 1 << 24);
  // APPNOTE 4.3.7 and 4.3.12: checksum and both sizes, before the member and in the list.
  const size_t begin = zip.find("PXR-USDC"), list = zip.rfind("PK\1\2");
  EXPECT_EQ(begin % 64, 0u) << "as usdz asks for";
  EXPECT_EQ(zip.substr(begin, alone.size()), alone);
  EXPECT_EQ(list, begin + alone.size());
  const auto size = static_cast<uint32_t>(alone.size());
  const uint32_t numbers[] = {crc32(std::as_bytes(std::span(alone))), size, size};
  const std::string_view expected(reinterpret_cast<const char*>(numbers), sizeof(numbers));
  EXPECT_EQ(zip.substr(14, expected.size()), expected);
  EXPECT_EQ(zip.substr(list + 16, expected.size()), expected);
  EXPECT_EQ(zip.substr(30, 9), "hair.usdc");
  EXPECT_EQ(zip.substr(zip.size() - 22, 4), "PK\5\6");
  // Cut off anywhere it is no file.
  for (size_t bytes = 0; bytes < begin + alone.size(); bytes += 97) {
    GroomFileOptions import;
    import.path = folder.write("cut.usdz", zip.substr(0, bytes));
    EXPECT_FALSE(load_groom(import)) << bytes;
  }
}

TEST(Export, AbcSaysWhatUnrealAsksOfAGroom) {
  const TemporaryFolder folder;
  for (const ExportRole role : {ExportRole::Strands, ExportRole::Guides}) {
    MadeStates states(3);
    ExportOptions options;
    options.path = folder.path() / "hair.abc";
    options.role = role;
    exported(states, options);
    const AbcFound found(options.path);
    const auto value = [&](const char* name, size_t element, uint32_t axis = 0) {
      const auto param = found.reader->param(name, 0);
      EXPECT_TRUE(param && param->has_value()) << name;
      EXPECT_EQ((*param)->stated_scope, std::string(name) == "width" ? "vtx" : "uni");
      return (*param)->number(element, axis);
    };
    const StrandSet strands(states.scene(), options, {pose_of(0.0), states.scene().asset->rest_position_m});
    for (size_t strand = 0; strand < kStrands; ++strand) {
      EXPECT_EQ(value("groom_guide", strand), role == ExportRole::Guides ? 1.0 : 0.0);
      EXPECT_EQ(value("groom_id", strand), static_cast<double>(strand));
      EXPECT_EQ(value("groom_group_id", strand), 0.0);
      for (uint32_t axis = 0; axis < 2; ++axis)
        EXPECT_EQ(value("groom_root_uv", strand, axis),
                  static_cast<double>(strands.root_uv()[strand][static_cast<int>(axis)]));
      for (size_t vertex = 0; vertex < kVertices; ++vertex)
        EXPECT_EQ(value("width", strand * kVertices + vertex), static_cast<double>(strands.widths()[vertex]));
    }
    const auto of_hair = found.archive.properties(found.tree.nodes()[1].object);
    const auto xform = found.archive.properties(*find_abc_property(*of_hair, ".xform"));
    const auto user = found.archive.properties(*find_abc_property(*xform, ".userProperties"));
    EXPECT_EQ(found.archive.sample(*find_abc_property(*user, "groom_version_major"), 0, 1)->number(0), 1.0);
    EXPECT_EQ(found.archive.sample(*find_abc_property(*user, "groom_version_minor"), 0, 1)->number(0), 5.0);
  }
}

TEST(Export, WhatTheHairsFileSaysComesBackInItsOrder) {
  const TemporaryFolder folder;
  const auto place_in_file = [](uint32_t strand) { return kStrands - 1 - strand; };
  const auto width_m_of = [](uint32_t strand, uint32_t vertex) {
    return 1e-4f * static_cast<float>(1 + strand) - 1e-5f * static_cast<float>(vertex);
  };
  auto origin = std::make_shared<ExportOrigin>();
  origin->object_name = {"fringe", "back"};
  for (uint32_t strand = 0; strand < kStrands; ++strand) {
    origin->place.push_back(place_in_file(strand));
    origin->id.push_back(50 - 3 * static_cast<int32_t>(strand));
    origin->group.push_back(static_cast<int32_t>(strand % 3));
    origin->object.push_back(strand % 2);
    origin->root_uv.emplace_back(0.1f * static_cast<float>(strand), 0.5f);
    for (uint32_t vertex = 0; vertex < kVertices; ++vertex)
      origin->width_m.push_back(width_m_of(strand, vertex));
  }
  for (const std::string extension : {".abc", ".usda", ".usdc"}) {
    MadeStates states(3);
    states.scene_.origin = origin;
    ExportOptions options;
    options.path = folder.path() / ("hair" + extension);
    exported(states, options);
    GroomFileOptions again;
    again.path = options.path;
    const auto placed = load_placed_groom(again);
    ASSERT_TRUE(placed) << placed.error().to_string();
    ASSERT_EQ(placed->labels.id.size(), kStrands) << extension;
    for (uint32_t strand = 0; strand < kStrands; ++strand) {
      const uint32_t place = place_in_file(strand);
      EXPECT_EQ(placed->labels.id[place], origin->id[strand]);
      EXPECT_EQ(placed->labels.group[place], origin->group[strand]);
      EXPECT_EQ(placed->labels.object_name[placed->labels.object[place]],
                origin->object_name[origin->object[strand]]);
      EXPECT_LT(glm::distance(placed->groom.root_uv[place], origin->root_uv[strand]), 1e-5f);
      for (uint32_t vertex = 0; vertex < kVertices; ++vertex) {
        EXPECT_NEAR(placed->labels.width[place * kVertices + vertex], width_m_of(strand, vertex), 1e-9f);
        const glm::vec3 found = placed->groom.rest_position_m[place * kVertices + vertex];
        EXPECT_LT(glm::distance(found, place_of(strand, vertex, 0.0)), 1e-5f);
      }
    }
  }
  const AbcFound found(folder.path() / "hair.abc");
  const AbcProperty* const names = find_abc_property(found.reader->free_params(), "groom_group_name");
  ASSERT_NE(names, nullptr);
  const std::vector<std::string> texts = found.archive.sample(*names, 0, 1'000)->texts();
  ASSERT_EQ(texts.size(), kStrands);
  EXPECT_EQ(texts[place_in_file(3)], "back");
  EXPECT_EQ(texts[place_in_file(4)], "fringe");
}

TEST(Export, FramesOfHairThatStandsStillTakeNoSpace) {
  const TemporaryFolder folder;
  const auto bytes_of = [&](const std::string& name, size_t count, bool moves) {
    MadeStates states(0);
    for (size_t i = 0; i < count; ++i) {
      const auto time_ns = static_cast<int64_t>(i) * kStepNs;
      states.states_.push_back(state_at(time_ns, positions_at(moves ? static_cast<double>(i) : 0.0)));
    }
    ExportOptions options;
    options.path = folder.path() / name;
    return exported(states, options).bytes;
  };
  constexpr uint64_t kFrameBytes = kStrands * kVertices * 3 * sizeof(float);
  constexpr uint64_t kTimesBytes = 29 * 4 * sizeof(double);  // USD states each frame's time and values
  for (const std::string name : {"hair.abc", "hair.usdc"}) {
    EXPECT_LT(bytes_of(name, 61, false), bytes_of(name, 3, false) + kFrameBytes + kTimesBytes) << name;
    EXPECT_GT(bytes_of(name, 61, true), bytes_of(name, 3, true) + 28 * kFrameBytes)
        << name << ": 30 frames of motion against one";
  }
}

TEST(Export, PlySequencesAreNumberedFromTheRestShape) {
  const TemporaryFolder folder;
  MadeStates states(30);
  ExportOptions options;
  options.path = folder.path() / "hair.ply";
  options.to_s = 0.1;
  const ExportReport report = exported(states, options);
  EXPECT_EQ(report.frame_count, 4u);
  EXPECT_EQ(report.file_count, 5u);
  for (const char* const name : {"hair_0000.ply", "hair_0001.ply", "hair_0004.ply"})
    EXPECT_EQ(imported(folder.path() / name).strand_count(), kStrands) << name;
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "hair_0005.ply"));
  EXPECT_THAT(*load_text(folder.path() / "hair_0002.ply", 1 << 20),
              HasSubstr("at 0.0333333 s of the simulation"));
}

TEST(Export, CurvesOfNoLengthAreLeftOutOfAllFramesAndCounted) {
  const TemporaryFolder folder;
  MadeStates states(0);
  auto asset = std::make_shared<SceneAsset>(*states.scene_.asset);
  for (uint32_t vertex = 0; vertex < kVertices; ++vertex)
    asset->rest_position_m[vertex * kStrands + 2] = asset->rest_position_m[2];  // at rest
  states.scene_.asset = asset;
  for (int i = 0; i < 10; ++i) {
    auto positions = positions_at(0.0);
    for (uint32_t vertex = 0; vertex < kVertices; ++vertex) {
      positions[vertex * kStrands + 4] = positions[4];             // in the first frame
      if (i > 5) positions[vertex * kStrands + 6] = positions[6];  // later
    }
    states.states_.push_back(state_at(i * kStepNs, positions));
  }
  ExportOptions options;
  options.path = folder.path() / "hair.csv";
  const ExportReport report = exported(states, options);
  EXPECT_EQ(report.strand_count, kStrands - 2);
  EXPECT_THAT(report.remarks, Contains(HasSubstr("2 strands of no length are left out")));
  EXPECT_THAT(report.remarks, Contains(HasSubstr("in 2 frames strands lost their length")));
  EXPECT_EQ(rows_of(options.path).size(), (report.frame_count + 1) * (kStrands - 2) * kVertices);
}

TEST(Export, WhatWasWrittenWhenTheSourceFailsIsWhole) {
  const TemporaryFolder folder;
  MadeStates states(20);
  states.end_ = make_error(ErrorCode::Unavailable, "the server has gone");
  ExportOptions options;
  options.path = folder.path() / "hair.usda";
  const ExportReport report = exported(states, options);
  EXPECT_EQ(report.frame_count, 10u);
  EXPECT_THAT(report.remarks, Contains(AllOf(HasSubstr("ends early"), HasSubstr("the server has gone"))));
  EXPECT_EQ(imported(options.path).strand_count(), kStrands);
  // Without a frame there is no file, and the error is the source's.
  MadeStates none(0);
  none.end_ = states.end_;
  options.path = folder.path() / "none.usda";
  EXPECT_THAT(export_strands(none, options, kNeverStopped).error().to_string(),
              HasSubstr("the server has gone"));
  EXPECT_FALSE(std::filesystem::exists(options.path));
}

TEST(Export, WhoWantsAWholeFileKeepsTheOldOneUntilThen) {
  const TemporaryFolder folder;
  ExportOptions options;
  options.path = folder.path() / "hair.usda";
  options.is_quiet = true;
  options.is_whole = true;
  const std::string old = "of yesterday";
  ASSERT_TRUE(save_file(options.path, std::as_bytes(std::span(old))));
  MadeStates broken(20);
  broken.end_ = make_error(ErrorCode::Unavailable, "the server has gone");
  EXPECT_THAT(export_strands(broken, options, kNeverStopped).error().to_string(),
              HasSubstr("the server has gone"));
  MadeStates stopped(200);
  stopped.stop_at_ = 30;
  EXPECT_THAT(export_strands(stopped, options, stopped.stop_).error().to_string(), HasSubstr("stopped"));
  EXPECT_EQ(*load_text(options.path, 1 << 24), old);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "no part of one";
  MadeStates whole(20);
  EXPECT_EQ(exported(whole, options).frame_count, 10u);
  EXPECT_NE(*load_text(options.path, 1 << 24), old);
}

TEST(Export, WhatWasWrittenWhenItIsStoppedIsWhole) {
  const TemporaryFolder folder;
  MadeStates states(200);
  states.stop_at_ = 30;
  ExportOptions options;
  options.path = folder.path() / "hair.usda";
  options.is_quiet = true;
  const auto report = export_strands(states, options, states.stop_);
  ASSERT_TRUE(report) << report.error().to_string();
  EXPECT_EQ(report->frame_count, 16u) << "half a second";
  EXPECT_EQ(imported(options.path).strand_count(), kStrands);
  EXPECT_THAT(*load_text(options.path, 1 << 24), HasSubstr("endTimeCode = 16 "));
}

TEST(Export, WhatCannotBeWrittenIsToldTheWayOut) {
  const auto refusal = [](const char* path) {
    ExportOptions options;
    options.path = path;
    const Status checked = check_export(options);
    return checked ? "accepted" : checked.error().to_string();
  };
  EXPECT_EQ(refusal("a.usda"), "accepted");
  EXPECT_EQ(refusal("A.CSV"), "accepted");
  EXPECT_EQ(refusal("a.abc"), "accepted");
  EXPECT_EQ(refusal("a.usdc"), "accepted");
  EXPECT_EQ(refusal("a.UsdZ"), "accepted");
  EXPECT_THAT(refusal("a.obj"), HasSubstr("known are .usda, .usdc, .usdz, .abc, .ply and .csv"));
  ExportOptions backwards;
  backwards.path = "a.usda";
  backwards.from_s = 2.0;
  backwards.to_s = 1.0;
  EXPECT_THAT(check_export(backwards).error().to_string(), HasSubstr("before the beginning"));
}

}  // namespace
}  // namespace strandcast::export_test
