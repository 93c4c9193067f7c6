// strandcast-ctl bake as a person meets it: frames at the clip's times, exit codes, and that neither a server
// nor half a file is left behind.
#include <gmock/gmock.h>

#include <cmath>
#include <csignal>
#include <fstream>
#include <map>
#include <set>

#include "common/base/file.h"
#include "common/groom/abc_curves.h"
#include "common/groom/abc_tree.h"
#include "common/motion/motion_file.h"
#include "tests/support/child_process.h"
#include "tests/support/made_abc.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::bake_program_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kClipRateHz = 60.0, kFps = 30.0;
constexpr int kClipFrames = 31;
constexpr double kBoundM = 1e-6 + 2e-7;  // of the stream, and what a file of floats rounds

class Bake : public testing::Test {
 protected:
  void SetUp() override {
    // Somebody who walks and turns from the first frame on.
    std::ofstream clip(path("walk.bvh"));
    clip << "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
            "Xrotation Yrotation\nJOINT Head\n{\nOFFSET 0 1.6 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
            "End Site\n{\nOFFSET 0 0.2 0\n}\n}\n}\nMOTION\nFrames: "
         << kClipFrames << "\nFrame Time: " << 1.0 / kClipRateHz << "\n";
    for (int i = 0; i < kClipFrames; ++i) clip << 0.02 * i << " 0 0 0 0 0 0 0 " << 2 * i << "\n";
    // Tufts on the crown, in inches with +Z up, of two kinds.
    std::ofstream hair(path("hair.usda"));
    hair << "#usda 1.0\n(\n    metersPerUnit = 0.0254\n    upAxis = \"Z\"\n)\n";
    for (int kind = 0; kind < 2; ++kind) {
      std::string counts, points, widths, ids, groups, uv;
      for (int strand = kFirst[kind]; strand < kFirst[kind + 1]; ++strand) {
        counts += fmt::format("{}6", counts.empty() ? "" : ", ");
        ids += fmt::format("{}{}", ids.empty() ? "" : ", ", id_of(strand));
        groups += fmt::format("{}{}", groups.empty() ? "" : ", ", group_of(strand));
        uv += fmt::format("{}({}, {})", uv.empty() ? "" : ", ", uv_of(strand).x, uv_of(strand).y);
        for (int k = 0; k < 6; ++k) {
          const glm::dvec3 point = point_of(strand, k);
          points += fmt::format("{}({}, {}, {})", points.empty() ? "" : ", ", point.x, point.y, point.z);
          widths += fmt::format("{}{}", widths.empty() ? "" : ", ", width_of(strand, k));
        }
      }
      hair << fmt::format(
          "\ndef BasisCurves \"{}\"\n{{\n    uniform token type = \"linear\"\n    int[] curveVertexCounts = "
          "[{}]\n    point3f[] points = [{}]\n    float[] widths = [{}] (\n        interpolation = "
          "\"vertex\"\n    )\n    int[] primvars:groom_id = [{}]\n    int[] primvars:groom_group_id = "
          "[{}]\n    texCoord2f[] primvars:groom_root_uv = [{}]\n}}\n",
          kName[kind], counts, points, widths, ids, groups, uv);
    }
  }
  void TearDown() override {
    if (old_folder_)
      setenv("TMPDIR", old_folder_->c_str(), 1);
    else
      unsetenv("TMPDIR");
  }
  static glm::dvec3 point_of(int strand, int k) {
    const double x = 1.2 * (strand % 5 - 2), y = 1.2 * (strand / 5 - 2);
    return {x * (1 + 0.3 * k), y * (1 + 0.3 * k), 5.2 - 0.16 * k * k};
  }
  static int id_of(int strand) { return 1000 - 7 * strand; }
  static int group_of(int strand) { return strand % 3; }
  static glm::dvec2 uv_of(int strand) { return {0.04 * strand, 1.0 - 0.03 * strand}; }
  static double width_of(int strand, int k) { return 0.003 + 1e-4 * strand - 4e-4 * k; }
  std::string path(const char* name) const { return (folder_.path() / name).string(); }
  size_t entries(const std::string& begin) const {
    size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      count += entry.path().filename().string().starts_with(begin) ? 1 : 0;
    return count;
  }
  std::string said() const { return *load_text(path("said"), 1 << 20); }
  std::vector<std::string> words(std::vector<std::string> more) const {
    std::vector<std::string> all = {"bake",         path("hair.usda"), "--set",
                                    "quality=fast", "--server",        STRANDCAST_SERVER_PROGRAM};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  int run(const std::vector<std::string>& more) {
    return test::ChildProcess(STRANDCAST_CTL_PROGRAM, words(more), path("said")).wait();
  }

  static constexpr int kTufts = 25, kFirst[] = {0, 10, kTufts};
  static constexpr const char* kName[] = {"fringe", "back"};
  TemporaryFolder folder_;
  // Some tests say where programs put what they need for a while.
  const std::optional<std::string> old_folder_ =
      getenv("TMPDIR") == nullptr ? std::nullopt : std::optional<std::string>(getenv("TMPDIR"));
};

/// The curves of a file.
struct BakedFile {
  explicit BakedFile(const std::string& path)
      : archive(*AbcArchive::read(*AbcContainer::open(path))), tree(*AbcTree::read(archive)) {
    for (const auto& node : tree.nodes())
      if (node.kind == AbcKind::Curves) reader = *AbcCurvesReader::open(archive, node.object);
  }
  double value(const char* name, size_t element, uint32_t axis = 0) const {
    const auto param = reader->param(name, 0);
    EXPECT_TRUE(param && *param) << name;
    return param && *param ? (*param)->number(element, axis) : NAN;
  }
  AbcArchive archive;
  AbcTree tree;
  std::optional<AbcCurvesReader> reader;
};

TEST_F(Bake, WhatTheHairBroughtComesBackInItsOwnPlaceAndOrder) {
  ASSERT_EQ(run({"--motion", path("walk.bvh"), "--motion-unit", "1", "--to", "0.1", path("out.abc")}), 0)
      << said();
  const BakedFile file(path("out.abc"));
  ASSERT_TRUE(file.reader);
  const auto rest = file.reader->read(0, kMaxStrandCount, 1 << 20);
  ASSERT_TRUE(rest);
  ASSERT_EQ(rest->points.size(), size_t{kTufts} * 6);
  const AbcProperty* const names = find_abc_property(file.reader->free_params(), "groom_group_name");
  ASSERT_NE(names, nullptr);
  const std::vector<std::string> name_of = file.archive.sample(*names, 0, 10'000)->texts();
  ASSERT_EQ(name_of.size(), size_t{kTufts});
  for (int strand = 0; strand < kTufts; ++strand) {
    const auto at = static_cast<size_t>(strand);
    EXPECT_EQ(file.value("groom_id", at), id_of(strand));
    EXPECT_EQ(file.value("groom_group_id", at), group_of(strand));
    EXPECT_EQ(name_of[at], kName[strand < kFirst[1] ? 0 : 1]);
    EXPECT_NEAR(file.value("groom_root_uv", at, 0), uv_of(strand).x, 1e-6);
    EXPECT_NEAR(file.value("groom_root_uv", at, 1), uv_of(strand).y, 1e-6);
    for (size_t k = 0; k < 6; ++k) {
      // Floats, through metres and back.
      EXPECT_LT(glm::distance(glm::dvec3(rest->points[6 * at + k]), point_of(strand, static_cast<int>(k))),
                2e-5);
      EXPECT_NEAR(file.value("width", 6 * at + k), width_of(strand, static_cast<int>(k)), 1e-8);
    }
  }
  EXPECT_THAT(file.archive.metadata(), AllOf(HasSubstr("unit_m=0.0254"), HasSubstr("up_axis=Z")));
  // Who says a unit gets that, about the head's joint.
  ASSERT_EQ(run({"--motion", path("walk.bvh"), "--motion-unit", "1", "--to", "0.1", "--units", "cm",
                 path("other.abc")}),
            0)
      << said();
  const BakedFile other(path("other.abc"));
  const auto other_rest = other.reader->read(0, kMaxStrandCount, 1 << 20);
  EXPECT_NEAR(glm::distance(other_rest->points[0], other_rest->points[1]),
              2.54f * glm::distance(rest->points[0], rest->points[1]), 1e-4f);
}

// A recording has no ids: who names the hair's file gets them, and other hair is found out.
TEST_F(Bake, ARecordingIsExportedWithWhatTheHairsFileSays) {
  ASSERT_EQ(test::ChildProcess(STRANDCAST_SERVER_PROGRAM,
                               {"--groom", path("hair.usda"), "--set", "quality=fast", "--port", "0",
                                "--record", path("run.mcap"), "--seconds", "0.5"},
                               path("said"))
                .wait(),
            0)
      << said();
  const auto exported = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"export", path("run.mcap"), path("out.abc"), "--to", "0.1"});
    return test::ChildProcess(STRANDCAST_CTL_PROGRAM, more, path("said")).wait();
  };
  ASSERT_EQ(exported({"--groom", path("hair.usda")}), 0) << said();
  EXPECT_EQ(BakedFile(path("out.abc")).value("groom_id", 3), id_of(3));
  ASSERT_EQ(exported({}), 0) << said();
  EXPECT_EQ(BakedFile(path("out.abc")).value("groom_id", 3), 3.0) << "numbers, where nobody says";
  test::MadeAbc made(path("other.abc"));
  made.finish({made.curves({})});
  EXPECT_EQ(exported({"--groom", path("other.abc")}), 2);
  EXPECT_THAT(said(), HasSubstr("other hair"));
}

// What another program has put on an animated head: the hair's roots stay on that head, in its own space.
TEST_F(Bake, CurvesThatMoveAsOneAreTheMotion) {
  const auto pose_of = [](double t_s) {
    return Pose{{3.0 * t_s, 0.5, -4.0 * t_s}, glm::angleAxis(0.8 * t_s, glm::normalize(glm::dvec3(1, 0, 2)))};
  };
  test::MadeCurves moving;
  moving.counts.assign(kTufts, 6);
  for (int sample = 0; sample < 3; ++sample) {
    std::vector<glm::vec3>& points = moving.sample.emplace_back();
    for (int i = 0; i < 6 * kTufts; ++i) {
      const glm::dvec3 point = point_of(i / 6, i % 6);
      points.emplace_back(sample == 0 ? point : pose_of(0.25 * sample) * point);
    }
  }
  test::MadeAbc made(path("moving.abc"));
  made.finish({made.curves(moving)});
  ASSERT_EQ(run({"--motion", path("moving.abc"), "--fps", "4", path("out.abc")}), 0) << said();
  const BakedFile file(path("out.abc"));
  ASSERT_EQ(file.reader->sample_count(), 4u);
  for (uint64_t frame = 0; frame < 3; ++frame) {
    const auto curves = file.reader->read(frame + 1, kMaxStrandCount, 1 << 20);
    ASSERT_TRUE(curves);
    double tips = 0.0;
    for (size_t strand = 0; strand < kTufts; ++strand) {
      const glm::dvec3 rest = point_of(static_cast<int>(strand), 0);
      const glm::dvec3 expected = frame == 0 ? rest : pose_of(0.25 * static_cast<double>(frame)) * rest;
      EXPECT_LT(glm::distance(glm::dvec3(curves->points[6 * strand]), expected), 2.0 * kBoundM / 0.0254)
          << frame;
      tips += glm::distance(curves->points[6 * strand + 5], moving.sample[frame][6 * strand + 5]);
    }
    EXPECT_GT(tips, frame > 0 ? 1e-3 : -1.0) << "the rest of it is simulated";
  }
  EXPECT_THAT(said(), AllOf(HasSubstr("roots of 1 curves object do, which move as one"),
                            HasSubstr("one unit is taken as 0.0254 m and +Z as up, as of the hair")));
  // In another unit the hair is in the same place of the world, upright.
  ASSERT_EQ(run({"--motion", path("moving.abc"), "--fps", "4", "--space", "world", "--units", "m", "--up",
                 "y", path("world.abc")}),
            0)
      << said();
  const auto in_world = BakedFile(path("world.abc")).reader->read(3, kMaxStrandCount, 1 << 20);
  ASSERT_TRUE(in_world);
  for (size_t strand = 0; strand < kTufts; ++strand) {
    const glm::dvec3 moved = 0.0254 * (pose_of(0.5) * point_of(static_cast<int>(strand), 0));
    EXPECT_LT(glm::distance(glm::dvec3(in_world->points[6 * strand]), {moved.x, moved.z, -moved.y}),
              2.0 * kBoundM)
        << strand;
  }
  // What was written moves hair as it was moved, from its first frame on, which is behind the rest shape.
  ASSERT_EQ(run({"--motion", path("out.abc"), "--fps", "4", path("again.abc")}), 0) << said();
  EXPECT_THAT(said(), HasSubstr("its first sample is the rest shape, and the motion begins with the next"));
  const BakedFile again(path("again.abc"));
  ASSERT_EQ(again.reader->sample_count(), 4u);
  for (uint64_t sample = 1; sample < 4; ++sample) {
    const auto was = file.reader->read(sample, kMaxStrandCount, 1 << 20),
               is = again.reader->read(sample, kMaxStrandCount, 1 << 20);
    ASSERT_TRUE(was && is);
    for (size_t root = 0; root < was->points.size(); root += 6)
      EXPECT_LT(glm::distance(was->points[root], is->points[root]), 4.0 * kBoundM / 0.0254) << sample;
  }
}

TEST_F(Bake, FollowersComeWithTheirGuides) {
  ASSERT_EQ(run({"--motion", "builtin", "--to", "0.1", "--followers", "--set", "look.followers=3",
                 path("out.abc")}),
            0)
      << said();
  const BakedFile file(path("out.abc"));
  const auto rest = file.reader->read(0, kMaxStrandCount, 1 << 20);
  ASSERT_TRUE(rest);
  const size_t count = rest->vertex_counts.size();
  EXPECT_GT(count, 2u * kTufts) << "followers besides strands";
  std::set<double> ids;
  for (size_t strand = 0; strand < count; ++strand) {
    EXPECT_EQ(file.value("groom_guide", strand), strand < kTufts ? 1.0 : 0.0) << strand;
    ids.insert(file.value("groom_id", strand));
  }
  EXPECT_EQ(ids.size(), count) << "no two have an id";
  // Guides that a strand hangs between, by their ids, and shares: these make its root of theirs.
  std::map<double, size_t> guide_of;
  for (size_t strand = 0; strand < kTufts; ++strand) guide_of[file.value("groom_id", strand)] = strand;
  std::vector<size_t> first{0};
  for (const uint32_t points : rest->vertex_counts) first.push_back(first.back() + points);
  size_t between = 0;
  for (size_t strand = 0; strand < count; ++strand) {
    glm::dvec3 root(0.0);
    double sum = 0.0, largest = 0.0;
    for (uint32_t k = 0; k < 3; ++k) {
      const double share = file.value("groom_guide_weights", strand, k);
      const auto guide = guide_of.find(file.value("groom_closest_guides", strand, k));
      ASSERT_NE(guide, guide_of.end());
      root += share * glm::dvec3(rest->points[first[guide->second]]);
      sum += share;
      largest = std::max(largest, share);
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    if (largest > 0.999) continue;  // a guide itself, or one at a parting
    ++between;
    EXPECT_LT(glm::distance(root, glm::dvec3(rest->points[first[strand]])), 1e-3) << strand;
  }
  EXPECT_GT(between, 10u);
}

TEST_F(Bake, FramesAreAtTheTimesOfTheClip) {
  ASSERT_EQ(run({"--motion", path("walk.bvh"), "--motion-unit", "1", "--units", "m", "--up", "y", "--space",
                 "world", path("out.abc")}),
            0)
      << said();
  EXPECT_THAT(said(), HasSubstr("16 frames at 30 fps from 0.000 s on")) << "the clip's time";
  MotionFileOptions as_stated;
  as_stated.unit_m = 1.0;
  const auto motion = load_motion_file(path("walk.bvh"), as_stated);
  ASSERT_TRUE(motion) << motion.error().to_string();
  const BakedFile file(path("out.abc"));
  ASSERT_TRUE(file.reader);
  const AbcCurvesReader* const reader = &*file.reader;
  // The rest shape, and the clip's half second at both ends.
  ASSERT_EQ(reader->sample_count(), 1u + 16u);
  // Roots go with the head, so they say where it is.
  const auto points = [&](uint64_t sample) { return reader->read(sample, kMaxStrandCount, 1 << 20)->points; };
  const std::vector<glm::vec3> rest = points(0);
  ASSERT_EQ(rest.size(), size_t{kTufts} * 6);
  const Pose first = motion->clip.sample(0.0);
  double largest_lag_m = 0.0;
  for (uint64_t frame = 0; frame < 16; ++frame) {
    const double t_s = static_cast<double>(frame) / kFps;
    const std::vector<glm::vec3> moved = points(frame + 1);
    for (size_t root = 0; root < rest.size(); root += 6) {
      const glm::dvec3 in_head = glm::conjugate(first.rotation) * (glm::dvec3(rest[root]) - first.position_m);
      const auto at = [&](double clip_s) { return motion->clip.sample(clip_s) * in_head; };
      EXPECT_LT(glm::distance(glm::dvec3(moved[root]), at(t_s)), 2.0 * kBoundM) << frame;
      largest_lag_m = std::max(largest_lag_m, glm::distance(at(t_s), at(t_s - 0.5 / kFps)));
    }
  }
  EXPECT_GT(largest_lag_m, 100.0 * kBoundM) << "half a frame too late would show";
}

TEST_F(Bake, AClipIsNumberedFilesOfPly) {
  ASSERT_EQ(run({"--motion", path("walk.bvh"), "--motion-unit", "1", path("out.ply")}), 0) << said();
  EXPECT_GT(entries("out"), 15u) << said();
}

/// One of the numbered files would be the hair itself.
TEST_F(Bake, AFileOfTheSequenceThatIsReadIsNotWrittenOver) {
  std::filesystem::copy_file(path("hair.usda"), path("out_0001.ply"));
  EXPECT_EQ(run({path("out_0001.ply"), "--motion", path("walk.bvh"), path("out.ply")}), 2);
  EXPECT_THAT(said(), HasSubstr("out_0001.ply is read, and would be written over"));
  EXPECT_EQ(*load_text(path("out_0001.ply"), 1 << 20), *load_text(path("hair.usda"), 1 << 20));
  std::filesystem::create_directory(path("folder.abc"));
  EXPECT_EQ(run({"--at", "0", path("folder.abc")}), 2);
  EXPECT_THAT(said(), HasSubstr("folder.abc is a folder"));
}

TEST_F(Bake, WhatWasLeftOutAndAssumedOfTheHairIsSaidFirst) {
  std::string text = *load_text(path("hair.usda"), 1 << 20);
  const std::string points = "point3f[] points = [(";
  const size_t first = text.find(points) + points.size();
  text.replace(first, text.find(',', first) - first, "nan");
  ASSERT_TRUE(save_file(path("hair.usda"), std::as_bytes(std::span(text))));
  ASSERT_EQ(run({"--at", "0", path("out.abc")}), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("1 of 25 strands cannot be used, and are left out; the first: "),
                            HasSubstr("1 unit = 25.4 mm: its metersPerUnit says so"),
                            HasSubstr("+Z of the file is up: its upAxis says so")));
  EXPECT_LT(said().find("left out"), said().find("24 strands x 6 vertices"));
}

TEST_F(Bake, WhatCannotBeDoneIsExitCodeTwoAndASentence) {
  EXPECT_EQ(run({"none.ply", path("out.abc"), "--motion", path("walk.bvh")}), 2);
  EXPECT_THAT(said(), HasSubstr("none.ply: no such file"));
  EXPECT_EQ(run({path("out.abc"), "--motion", "none.bvh"}), 2);
  EXPECT_THAT(said(), HasSubstr("none.bvh"));
  EXPECT_EQ(run({path("out.abc"), "--motion", "builtin"}), 2);
  EXPECT_THAT(said(), HasSubstr("--seconds"));
  EXPECT_FALSE(std::filesystem::exists(path("out.abc")));
}

TEST_F(Bake, AStopEndsTheServerAndLeavesTheOldFile) {
  const std::string old = "of yesterday";
  ASSERT_TRUE(save_file(path("out.abc"), std::as_bytes(std::span(old))));
  ASSERT_EQ(setenv("TMPDIR", folder_.path().c_str(), 1), 0);  // where the server's folder is
  test::ChildProcess bake(STRANDCAST_CTL_PROGRAM,
                          words({path("out.abc"), "--replace", "--motion", "builtin", "--seconds", "3600"}),
                          path("said"));
  ASSERT_TRUE(eventually([&] { return entries("out.abc") == 2; }))
      << "the old one, and the new one under another name";
  EXPECT_EQ(entries("strandcast-"), 1u);
  bake.send_signal(SIGINT);
  EXPECT_EQ(bake.wait(), 130) << said();
  // The folder goes once the server has ended.
  EXPECT_EQ(entries("strandcast-"), 0u);
  EXPECT_EQ(entries("out.abc"), 1u);
  EXPECT_EQ(*load_text(path("out.abc"), 1 << 20), old);
}

// Nobody is left to end the server: the kernel does.
TEST_F(Bake, TheServerEndsWithWhoeverIsKilled) {
  ASSERT_EQ(setenv("TMPDIR", folder_.path().c_str(), 1), 0);
  for (const int signal : {SIGKILL, SIGTERM}) {
    test::ChildProcess bake(STRANDCAST_CTL_PROGRAM,
                            words({path("out.abc"), "--replace", "--motion", "builtin", "--seconds", "3600"}),
                            path("said"));
    pid_t server = 0;
    ASSERT_TRUE(eventually([&] {
      std::ifstream children(fmt::format("/proc/{0}/task/{0}/children", bake.id()));
      return (children >> server) && !said().empty();
    }));
    bake.send_signal(signal);
    bake.wait();
    EXPECT_TRUE(eventually([&] {
      // Nobody may wait for it here: what is dead but not waited for is as good as gone.
      std::ifstream file(fmt::format("/proc/{}/stat", server));
      std::string state;
      return !std::getline(file, state) || state.find(") Z ") != std::string::npos;
    })) << "after signal "
        << signal;
  }
}

}  // namespace
}  // namespace strandcast::bake_program_test
