// strandcast-ctl bake as a person meets it: frames at the clip's times, exit codes, and that neither a server
// nor half a file is left behind.
#include <gmock/gmock.h>

#include <csignal>
#include <fstream>

#include "common/base/file.h"
#include "common/groom/abc_curves.h"
#include "common/groom/abc_tree.h"
#include "common/motion/motion_file.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::bake_program_test {
namespace {

using testing::HasSubstr;

constexpr double kClipRateHz = 60.0, kFps = 30.0;
constexpr int kClipFrames = 31;
constexpr double kBoundM = 2e-5 + 2e-6;  // of the stream, and what a file of floats rounds

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
    // Tufts on the crown, in metres.
    std::ofstream hair(path("hair.usda"));
    hair << "#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\ndef BasisCurves \"hair\"\n{\n"
            "    uniform token type = \"linear\"\n    int[] curveVertexCounts = [";
    for (int strand = 0; strand < kTufts; ++strand) hair << (strand > 0 ? ", 6" : "6");
    hair << "]\n    point3f[] points = [";
    for (int strand = 0; strand < kTufts; ++strand)
      for (int k = 0; k < 6; ++k) {
        const double x = 0.03 * (strand % 5 - 2), z = 0.03 * (strand / 5 - 2);
        hair << (strand + k > 0 ? ", (" : "(") << x * (1 + 0.3 * k) << ", " << 0.13 - 0.004 * k * k << ", "
             << z * (1 + 0.3 * k) << ")";
      }
    hair << "]\n}\n";
  }
  std::string path(const char* name) const { return (folder_.path() / name).string(); }
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

  static constexpr int kTufts = 25;
  TemporaryFolder folder_;
};

TEST_F(Bake, FramesAreAtTheTimesOfTheClip) {
  ASSERT_EQ(run({"--motion", path("walk.bvh"), "--motion-unit", "1", "--units", "m", "--space", "world",
                 path("out.abc")}),
            0)
      << said();
  MotionFileOptions as_stated;
  as_stated.unit_m = 1.0;
  const auto motion = load_motion_file(path("walk.bvh"), as_stated);
  ASSERT_TRUE(motion) << motion.error().to_string();
  auto container = AbcContainer::open(path("out.abc"));
  ASSERT_TRUE(container);
  const auto archive = AbcArchive::read(std::move(*container));
  ASSERT_TRUE(archive);
  const auto tree = AbcTree::read(*archive);
  ASSERT_TRUE(tree);
  std::optional<AbcCurvesReader> reader;
  for (const auto& node : tree->nodes())
    if (node.kind == AbcKind::Curves) reader = *AbcCurvesReader::open(*archive, node.object);
  ASSERT_TRUE(reader);
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
                          words({path("out.abc"), "--motion", "builtin", "--seconds", "3600"}), path("said"));
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(path("said")) && !said().empty(); }));
  const auto entries = [&](const std::string& begin) {
    size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      count += entry.path().filename().string().starts_with(begin) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(entries("strandcast-"), 1u);
  EXPECT_EQ(entries("out.abc"), 2u) << "the old one, and the new one under another name";
  bake.send_signal(SIGINT);
  EXPECT_EQ(bake.wait(), 1) << said();
  // The folder goes once the server has ended.
  EXPECT_EQ(entries("strandcast-"), 0u);
  EXPECT_EQ(entries("out.abc"), 1u);
  EXPECT_EQ(*load_text(path("out.abc"), 1 << 20), old);
}

}  // namespace
}  // namespace strandcast::bake_program_test
