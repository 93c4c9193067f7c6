// What `strandcast-server --check` leaves: a picture with hair in each of its twelve fields, and what was
// guessed. What it passes, starts.
#include "server/app/groom_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/file.h"
#include "common/groom/groom_file.h"
#include "common/pictures/image_codec.h"
#include "server/scene/scene_content.h"
#include "server/source/simulation_source.h"
#include "tests/support/log_capture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_check_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

SceneDesc small_scene() {
  SceneDesc scene = built_in_scene();
  ProceduralGroomDesc groom;
  groom.strand_count = 100;
  groom.vertex_count = 4;
  scene.groom = groom;
  return scene;
}

/// Pixels of a field that are not its background, which does not change along a row.
size_t drawn_pixels(const Image& sheet, uint32_t column, uint32_t row) {
  const uint32_t side = sheet.height / 3;
  size_t count = 0;
  for (uint32_t y = row * side; y < (row + 1) * side; ++y)
    for (uint32_t x = column * side; x < (column + 1) * side; ++x) {
      const auto pixel = [&](uint32_t at) { return &sheet.rgba[4 * (size_t{y} * sheet.width + at)]; };
      const uint8_t *here = pixel(x), *edge = pixel(column * side);
      count += std::abs(here[0] - edge[0]) + std::abs(here[2] - edge[2]) > 12 ? 1 : 0;
    }
  return count;
}

TEST(GroomCheck, LeavesPicturesFromFourSidesAndTakesSteps) {
  const TemporaryFolder folder;
  std::vector<std::string> told;
  const auto text = check_groom(small_scene(), folder.path() / "new", {},
                                [&](const std::string& sentence) { told.push_back(sentence); });
  ASSERT_TRUE(text) << text.error().to_string();
  EXPECT_THAT(told, testing::ElementsAre(
                        HasSubstr("the hair is read"), HasSubstr("vertices are read, and drawn now"),
                        HasSubstr("1 of 3 rows of pictures are drawn, about "), HasSubstr("2 of 3 rows"),
                        HasSubstr("3 of 3 rows"), HasSubstr("13 steps are taken")));
  EXPECT_THAT(*text, HasSubstr("groom.png: from the front, from its left side, from behind and from above"));
  EXPECT_THAT(*text, HasSubstr("13 steps are taken with " + small_scene().solver.name + " on "));
  EXPECT_EQ(load_text(folder.path() / "new/groom.txt", 1 << 20).value(), *text);
  const auto sheet = load_png(folder.path() / "new/groom.png");
  ASSERT_TRUE(sheet) << sheet.error().to_string();
  ASSERT_EQ(3 * sheet->width, 4 * sheet->height);
  for (uint32_t column = 0; column < 4; ++column) {
    const size_t hair = drawn_pixels(*sheet, column, 0);
    EXPECT_GT(hair, 500u) << column;
    EXPECT_GT(drawn_pixels(*sheet, column, 1), hair + 500u) << column << ": with the head";
    EXPECT_GT(drawn_pixels(*sheet, column, 2), hair + 500u) << column << ": with what collides";
  }
}

std::string straight_hair(float length) {
  std::string text;
  for (int strand = 0; strand < 100; ++strand) {
    const double y = 1.0 - (strand + 0.5) / 100.0, around = 2.399963 * strand,
                 across = std::sqrt(1.0 - y * y);
    const glm::dvec3 out(across * std::sin(around), y, across * std::cos(around));
    for (int vertex = 0; vertex < 4; ++vertex) {
      const glm::dvec3 point = (0.1 + static_cast<double>(length) * vertex / 3.0) * out;
      text += fmt::format("{} {} {}\n", point.x, point.y, point.z);
    }
  }
  return "ply\nformat ascii 1.0\ncomment strand_vertex_count 4\nelement vertex 400\nproperty float x\n"
         "property float y\nproperty float z\nend_header\n" +
         text;
}

SceneDesc scene_of_file(const std::filesystem::path& path) {
  SceneDesc scene = small_scene();
  FileGroomDesc file;
  file.path = path;
  scene.groom = file;
  return scene;
}

TEST(GroomCheck, FailsForAUnitInWhichNoHeadHasThisHair) {
  const TemporaryFolder folder;
  const std::string text = straight_hair(0.2f);
  ASSERT_TRUE(save_file(folder.path() / "hair.ply", std::as_bytes(std::span(text))));
  SceneDesc scene = scene_of_file(folder.path() / "hair.ply");
  EXPECT_EQ(load_scene_content(scene).value().unlikely, "");
  const char* const part = "m long, as on no head: groom.file.unit_m=1";
  for (const float unit_m : {100.0f, 0.01f}) {
    std::get<FileGroomDesc>(scene.groom).unit_m = unit_m;
    EXPECT_THAT(load_scene_content(scene).value().unlikely, HasSubstr(part)) << unit_m;
  }
  const auto checked = check_groom(scene, folder.path(), {});
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().to_string(), HasSubstr(part));
  EXPECT_THAT(load_text(folder.path() / "groom.txt", 1 << 20).value(), HasSubstr(part));
}

// A start goes on with what a check refuses, and says the same.
TEST(GroomCheck, OfWhatItRefusesAStartWarns) {
  const TemporaryFolder folder;
  const std::string text = straight_hair(0.2f);
  ASSERT_TRUE(save_file(folder.path() / "hair.ply", std::as_bytes(std::span(text))));
  SimulationConfig config;
  config.scene = scene_of_file(folder.path() / "hair.ply");
  InputHub inputs;
  const test::LogCapture log;
  ASSERT_TRUE(make_simulation(config, inputs));
  EXPECT_EQ(log.count("warning [scene]"), 0u);
  std::get<FileGroomDesc>(config.scene.groom).unit_m = 0.01f;
  // And a mesh that is none of this head.
  config.scene.head.mesh_path = folder.path() / "far.obj";
  const std::string mesh = "v 90 0 0\nv 91 0 0\nv 90 1 0\nv 90 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n";
  ASSERT_TRUE(save_file(config.scene.head.mesh_path, std::as_bytes(std::span(mesh))));
  const std::string refused = load_scene_content(config.scene).value().unlikely;
  EXPECT_THAT(refused, AllOf(HasSubstr("as on no head"), HasSubstr("the head's mesh does not fit")));
  const auto checked = check_groom(config.scene, folder.path(), {});
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().to_string(), HasSubstr(refused));
  ASSERT_TRUE(make_simulation(config, inputs));
  EXPECT_EQ(log.count("warning [scene] " + refused), 1u) << testing::PrintToString(log.lines());
  EXPECT_EQ(log.count("as on no head"), 1u) << "and not twice";
}

// A head of 0.1 m that is said to be one of inches in metres, and other such mistakes that leave hair of a
// likely length.
TEST(GroomCheck, FailsForAUnitThatFitsTheHairAndNotTheHead) {
  const TemporaryFolder folder;
  const std::string text = straight_hair(0.2f);
  ASSERT_TRUE(save_file(folder.path() / "hair.ply", std::as_bytes(std::span(text))));
  GroomFileOptions options;
  options.path = folder.path() / "hair.ply";
  for (const float unit_m : {2.54f, 3.28f, 1.0f / 2.54f, 0.3048f}) {
    options.unit_m = unit_m;
    EXPECT_THAT(load_placed_groom(options).value().unlikely,
                HasSubstr("as nobody's: groom.file.unit_m=1 makes it"))
        << unit_m;
  }
  options.unit_m = 1.2f;
  EXPECT_EQ(load_placed_groom(options).value().unlikely, "") << "a large one";
}

// Roots that say nothing of a head: a guess is told as what is stated is.
TEST(GroomCheck, FailsForAUnitInWhichNoHeadHasTheseRoots) {
  const TemporaryFolder folder;
  // Strands on a disc of this radius, whose middle stands higher by `rise`.
  const auto judged = [&](float radius, float rise, float unit_m) {
    std::string text =
        "ply\nformat ascii 1.0\ncomment strand_vertex_count 2\nelement vertex 400\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n";
    for (int strand = 0; strand < 200; ++strand) {
      const float share = std::sqrt((static_cast<float>(strand) + 0.5f) / 200.0f),
                  around = 2.399963f * static_cast<float>(strand);
      for (const float up : {0.0f, 0.1f * radius})
        text += fmt::format("{} {} {}\n", radius * share * std::sin(around), up - rise * share * share,
                            radius * share * std::cos(around));
    }
    EXPECT_TRUE(save_file(folder.path() / "disc.ply", std::as_bytes(std::span(text))));
    GroomFileOptions options;
    options.path = folder.path() / "disc.ply";
    options.unit_m = unit_m;
    options.is_z_up.reset();
    return load_placed_groom(options).value().unlikely;
  };
  EXPECT_THAT(judged(0.655f, 0.02f, 1.0f),
              AllOf(HasSubstr("the roots reach over 1."), HasSubstr("as on no head")));
  EXPECT_THAT(judged(0.655f, 0.02f, 0.0f), HasSubstr("as on no head")) << "a sphere of 10 m, taken as a head";
  EXPECT_EQ(judged(0.09f, 0.07f, 0.0f), "") << "a cap of hair";
}

TEST(GroomCheck, FailsForASideThatIsNotUp) {
  const TemporaryFolder folder;
  // Strands that leave the upper half of a head and fall from it, with the file's axes and what it says of
  // them.
  const auto judged = [&](const glm::mat3& file_from_head, const std::string& said) {
    std::string text =
        "ply\nformat ascii 1.0\ncomment strand_vertex_count 3\n" + said +
        "element vertex 600\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    for (int strand = 0; strand < 200; ++strand) {
      const float y = 1.0f - (static_cast<float>(strand) + 0.5f) / 200.0f,
                  around = 2.399963f * static_cast<float>(strand);
      const float across = std::sqrt(1.0f - y * y);
      const glm::vec3 out(across * std::sin(around), y, across * std::cos(around));
      for (const glm::vec3& point : {0.1f * out, 0.12f * out, 0.12f * out - glm::vec3(0, 0.2f, 0)}) {
        const glm::vec3 p = file_from_head * point;
        text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
      }
    }
    EXPECT_TRUE(save_file(folder.path() / "hair.ply", std::as_bytes(std::span(text))));
    GroomFileOptions options;
    options.path = folder.path() / "hair.ply";
    options.is_z_up.reset();
    return load_placed_groom(options).value().unlikely;
  };
  const glm::mat3 y_up(1.0f), z_up({1, 0, 0}, {0, 0, 1}, {0, -1, 0}), x_up({0, -1, 0}, {1, 0, 0}, {0, 0, 1});
  const std::string says_y = "comment up_axis Y\n", says_z = "comment up_axis Z\n";
  EXPECT_EQ(judged(y_up, ""), "");
  EXPECT_EQ(judged(y_up, says_y), "");
  EXPECT_EQ(judged(z_up, ""), "") << "found";
  EXPECT_EQ(judged(z_up, says_z), "");
  EXPECT_THAT(judged(z_up, says_y), HasSubstr("groom.file.up_axis=Z turns it up"));
  EXPECT_THAT(judged(y_up, says_z), HasSubstr("groom.file.up_axis=Y turns it up"));
  EXPECT_THAT(judged(-z_up * glm::mat3({-1, 0, 0}, {0, 1, 0}, {0, 0, 1}), says_y),
              HasSubstr("up_axis=MINUS_Z"));
  EXPECT_THAT(judged(x_up, ""), HasSubstr("the hair covers +X of the file"));
}

TEST(GroomCheck, FailsWhereAServerWouldNotStart) {
  const TemporaryFolder folder;
  SceneDesc scene = small_scene();
  scene.solver.name = "direct_rod";
  scene.solver.parameters = {{"no_such_parameter", 1.0}};
  EXPECT_THAT(check_groom(scene, folder.path(), {}).error().to_string(), HasSubstr("no_such_parameter"));
}

TEST(GroomCheck, SaysWhatItCannotRead) {
  const TemporaryFolder folder;
  EXPECT_THAT(check_groom(scene_of_file("no/such.tfx"), folder.path(), {}).error().to_string(),
              HasSubstr("such.tfx"));
  EXPECT_THAT(check_groom(small_scene(), "/proc/nowhere", {}).error().to_string(),
              HasSubstr("cannot make the folder /proc/nowhere"));
}

}  // namespace
}  // namespace strandcast::groom_check_test
