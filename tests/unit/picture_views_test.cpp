#include "server/encode/picture_views.h"

#include <cmath>
#include <limits>

namespace strandcast {
namespace {

using testing::HasSubstr;

PictureView view_at(float x_m) {
  PictureView view;
  view.camera.offset_m = {x_m, 0.0f, 1.0f};
  return view;
}

TEST(PictureViews, EqualViewsShareAClassAndOthersDoNot) {
  PictureViews views;
  const auto a = views.assign(1, view_at(0.0f));
  const auto b = views.assign(2, view_at(0.0f));
  const auto c = views.assign(3, view_at(0.5f));
  ASSERT_TRUE(a && b && c);
  EXPECT_EQ(*a, *b);
  EXPECT_NE(*a, *c);
  PictureView better = view_at(0.0f);
  better.quality = 95;
  EXPECT_NE(*views.assign(4, better), *a);
  better.size = {320, 180};
  EXPECT_EQ(views.views().size(), 3u);
}

TEST(PictureViews, AViewerAloneKeepsItsClassWhenItsCameraMoves) {
  PictureViews views;
  const uint32_t first = *views.assign(1, view_at(0.0f));
  for (int i = 1; i < 100; ++i) EXPECT_EQ(*views.assign(1, view_at(0.125f * static_cast<float>(i))), first);
  EXPECT_EQ(views.views().size(), 1u);
  EXPECT_EQ(views.views().at(first), view_at(0.125f * 99.0f));
}

TEST(PictureViews, AViewerLeavesASharedClassToTheOthers) {
  PictureViews views;
  const uint32_t shared = *views.assign(1, view_at(0.0f));
  ASSERT_TRUE(views.assign(2, view_at(0.0f)));
  const uint32_t own = *views.assign(1, view_at(0.3f));
  EXPECT_NE(own, shared);
  EXPECT_EQ(views.views().at(shared), view_at(0.0f));
  EXPECT_EQ(*views.assign(1, view_at(0.0f)), shared);
  EXPECT_EQ(views.views().size(), 1u) << "the class it was alone in is gone";
}

TEST(PictureViews, ThereAreOnlyAFewClassesAndRefusalChangesNothing) {
  PictureViews views;
  for (uint64_t viewer = 0; viewer < kMaxPictureViews; ++viewer)
    ASSERT_TRUE(views.assign(viewer, view_at(static_cast<float>(viewer))));
  const auto refused = views.assign(99, view_at(9.0f));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(views.viewer_count(), kMaxPictureViews);
  const uint32_t shared = *views.assign(99, view_at(1.0f));
  ASSERT_FALSE(views.assign(99, view_at(9.0f)));
  EXPECT_EQ(*views.assign(100, view_at(1.0f)), shared);
  views.remove(0);
  EXPECT_TRUE(views.assign(99, view_at(9.0f))) << "a place came free";
}

TEST(PictureViews, ClassesEndWithTheirLastViewerAndNumbersDoNotReturn) {
  PictureViews views;
  const uint32_t first = *views.assign(1, view_at(0.0f));
  ASSERT_TRUE(views.assign(2, view_at(0.0f)));
  views.remove(1);
  EXPECT_EQ(views.views().size(), 1u);
  views.remove(2);
  views.remove(2);
  EXPECT_TRUE(views.views().empty());
  EXPECT_NE(*views.assign(1, view_at(0.0f)), first);
}

TEST(PictureViews, RefusesViewsThatCannotBeDrawn) {
  const auto refuses = [](auto change, const char* what) {
    PictureView view = view_at(0.0f);
    change(view);
    const auto result = validate(view);
    ASSERT_FALSE(result) << what;
    EXPECT_THAT(result.error().message, HasSubstr(what));
  };
  ASSERT_TRUE(validate(view_at(0.0f)));
  refuses([](PictureView& view) { view.size.width = 0; }, "0 x 360");
  refuses([](PictureView& view) { view.size.height = 4'000'000'000u; }, "4000000000");
  refuses([](PictureView& view) { view.quality = 0; }, "quality 0");
  refuses([](PictureView& view) { view.quality = 101; }, "quality 101");
  refuses([](PictureView& view) { view.camera.offset_m.x = std::nanf(""); }, "no usable place");
  refuses([](PictureView& view) { view.camera.target_m.x = std::numeric_limits<float>::infinity(); },
          "no usable");
  refuses([](PictureView& view) { view.camera.offset_m = glm::vec3(0.0f); }, "0 m from");
  refuses([](PictureView& view) { view.camera.offset_m = glm::vec3(1e30f); }, "m from");
  refuses([](PictureView& view) { view.camera.fov_y_rad = 0.0f; }, "field of view 0");
  refuses([](PictureView& view) { view.camera.fov_y_rad = std::nanf(""); }, "field of view nan");
}

}  // namespace
}  // namespace strandcast
