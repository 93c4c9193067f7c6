// What `strandcast-server --check` leaves: a picture with hair in each of its nine fields, and what was
// guessed.
#include "server/app/groom_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/file.h"
#include "common/pictures/image_codec.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::groom_check_test {
namespace {

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
  const uint32_t side = sheet.width / 3;
  size_t count = 0;
  for (uint32_t y = row * side; y < (row + 1) * side; ++y)
    for (uint32_t x = column * side; x < (column + 1) * side; ++x) {
      const auto pixel = [&](uint32_t at) { return &sheet.rgba[4 * (size_t{y} * sheet.width + at)]; };
      const uint8_t *here = pixel(x), *edge = pixel(column * side);
      count += std::abs(here[0] - edge[0]) + std::abs(here[2] - edge[2]) > 12 ? 1 : 0;
    }
  return count;
}

TEST(GroomCheck, LeavesPicturesFromThreeSides) {
  const TemporaryFolder folder;
  const auto text = check_groom(small_scene(), folder.path() / "new", {});
  ASSERT_TRUE(text) << text.error().to_string();
  EXPECT_THAT(*text, HasSubstr("groom.png: from the front, from its left side and from above"));
  EXPECT_EQ(load_text(folder.path() / "new/groom.txt", 1 << 20).value(), *text);
  const auto sheet = load_png(folder.path() / "new/groom.png");
  ASSERT_TRUE(sheet) << sheet.error().to_string();
  ASSERT_EQ(sheet->width, sheet->height);
  for (uint32_t column = 0; column < 3; ++column) {
    const size_t hair = drawn_pixels(*sheet, column, 0);
    EXPECT_GT(hair, 500u) << column;
    EXPECT_GT(drawn_pixels(*sheet, column, 1), hair + 500u) << column << ": with the head";
    EXPECT_GT(drawn_pixels(*sheet, column, 2), hair + 500u) << column << ": with what collides";
  }
}

TEST(GroomCheck, SaysWhatItCannotRead) {
  const TemporaryFolder folder;
  SceneDesc scene = small_scene();
  FileGroomDesc file;
  file.path = "no/such.tfx";
  scene.groom = file;
  EXPECT_THAT(check_groom(scene, folder.path(), {}).error().to_string(), HasSubstr("such.tfx"));
  EXPECT_THAT(check_groom(small_scene(), "/proc/nowhere", {}).error().to_string(),
              HasSubstr("cannot make the folder /proc/nowhere"));
}

}  // namespace
}  // namespace strandcast::groom_check_test
