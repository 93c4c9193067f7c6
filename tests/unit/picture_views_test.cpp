#include "server/encode/picture_views.h"

#include <cmath>
#include <limits>
#include <random>
#include <string>

namespace strandcast::picture_views_test {
namespace {

using testing::HasSubstr;

PictureView view_at(float x_m) {
  PictureView view;
  view.camera.offset_m = {x_m, 0.0f, 1.0f};
  return view;
}

/// The picture of the scene, which no test asks for by accident.
PictureView scene_view() {
  PictureView view = view_at(-5.0f);
  view.size = {640, 360};
  return view;
}

/// One who has an address of its own.
PictureOwner one(uint64_t viewer) {
  return {viewer, std::to_string(viewer), false};
}

TEST(PictureViews, EqualViewsShareAClassAndOthersDoNot) {
  PictureViews views(scene_view(), kHardwareBudget);
  const auto a = views.assign(one(1), view_at(0.0f));
  const auto b = views.assign(one(2), view_at(0.0f));
  const auto c = views.assign(one(3), view_at(0.5f));
  ASSERT_TRUE(a && b && c);
  EXPECT_EQ(*a, *b);
  EXPECT_NE(*a, *c);
  PictureView better = view_at(0.0f);
  better.quality = 95;
  EXPECT_NE(*views.assign(one(4), better), *a);
  better.size = {320, 180};
  EXPECT_EQ(views.views().size(), 3u);
}

TEST(PictureViews, AViewerAloneKeepsItsClassWhenItsCameraMoves) {
  PictureViews views(scene_view(), kHardwareBudget);
  const uint32_t first = *views.assign(one(1), view_at(0.0f));
  for (int i = 1; i < 100; ++i)
    EXPECT_EQ(*views.assign(one(1), view_at(0.125f * static_cast<float>(i))), first);
  EXPECT_EQ(views.views().size(), 1u);
  EXPECT_EQ(views.views().at(first), view_at(0.125f * 99.0f));
}

TEST(PictureViews, AViewerLeavesASharedClassToTheOthers) {
  PictureViews views(scene_view(), kHardwareBudget);
  const uint32_t shared = *views.assign(one(1), view_at(0.0f));
  ASSERT_TRUE(views.assign(one(2), view_at(0.0f)));
  const uint32_t own = *views.assign(one(1), view_at(0.3f));
  EXPECT_NE(own, shared);
  EXPECT_EQ(views.views().at(shared), view_at(0.0f));
  EXPECT_EQ(*views.assign(one(1), view_at(0.0f)), shared);
  EXPECT_EQ(views.views().size(), 1u) << "the class it was alone in is gone";
}

TEST(PictureViews, ThereAreOnlyAFewClassesAndRefusalChangesNothing) {
  PictureViews views(scene_view(), kHardwareBudget);
  for (uint64_t viewer = 0; viewer + 1 < kMaxPictureViews; ++viewer)
    ASSERT_TRUE(views.assign(one(viewer), view_at(static_cast<float>(viewer))));
  const auto refused = views.assign(one(99), view_at(9.0f));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unavailable);
  EXPECT_EQ(views.viewer_count(), kMaxPictureViews - 1);
  const uint32_t shared = *views.assign(one(99), view_at(1.0f));
  ASSERT_FALSE(views.assign(one(99), view_at(9.0f)));
  EXPECT_EQ(*views.assign(one(100), view_at(1.0f)), shared);
  views.remove(0);
  EXPECT_TRUE(views.assign(one(99), view_at(9.0f))) << "a place came free";
}

PictureView sized(uint32_t width, uint32_t height, float x_m = 0.0f) {
  PictureView view = view_at(x_m);
  view.size = {width, height};
  return view;
}

TEST(PictureViews, ThePictureOfTheSceneHasRoomInEveryCodecWhateverOthersTake) {
  PictureViews views(scene_view(), kHardwareBudget);
  uint64_t viewer = 0;
  // As many classes as there can be, of as many addresses.
  for (int quality = 1; quality <= 100; ++quality) {
    PictureView view = scene_view();
    view.quality = quality == scene_view().quality ? 99 : quality;
    if (!views.assign(one(viewer++), view)) break;
  }
  ASSERT_EQ(views.views().size(), kMaxPictureClasses - kReservedPictureClasses);
  for (const PictureCodec codec : kPictureCodecs) {
    PictureView view = scene_view();
    view.codec = codec;
    EXPECT_TRUE(views.assign(one(viewer++), view)) << to_string(codec);
  }
  EXPECT_EQ(views.views().size(), kMaxPictureClasses);
}

// Whoever moves the scene's camera again and again fills no memory with those who stay where it was.
TEST(PictureViews, WhereTheSceneLooksFromMovesWithinTheLimits) {
  for (const PictureBudget& budget : {kHardwareBudget, kSoftwareBudget}) {
    PictureView scene = scene_view();
    scene.size = {1280, 720};
    PictureViews views(scene, budget);
    uint64_t viewer = 0;
    size_t refused = 0;
    for (int i = 0; i < 20; ++i) {
      scene.camera.offset_m.x = -5.0f + 0.125f * static_cast<float>(i);
      views.set_reserved_camera(scene.camera);
      for (const PictureCodec codec : kPictureCodecs) {
        PictureView own = scene;
        own.codec = codec;
        refused += views.assign(one(viewer++), own) ? 0 : 1;
        EXPECT_TRUE(i > 0 || refused == 0) << to_string(codec);
      }
      uint64_t pixels = 0;
      for (const auto& [picture_class, view] : views.views())
        pixels += uint64_t{view.size.width} * view.size.height;
      EXPECT_LE(views.views().size(), kMaxPictureClasses);
      EXPECT_LE(pixels, budget.all_pixels + kReservedPictureClasses * budget.picture_pixels);
    }
    EXPECT_GT(refused, 0u);
    // Those who stayed leave, and the scene's own has room from where it is now.
    for (uint64_t gone = 0; gone < viewer; ++gone) views.remove(gone);
    EXPECT_TRUE(views.assign(one(viewer), scene));
  }
}

TEST(PictureViews, OneAddressCannotTakeAllViews) {
  PictureViews views(scene_view(), kHardwareBudget);
  uint64_t viewer = 0;
  const auto of_crowd = [&](const PictureView& view) {
    return views.assign({viewer++, "crowd", true}, view);
  };
  for (size_t i = 0; i < kMaxPictureViewsOfPeer; ++i)
    ASSERT_TRUE(of_crowd(sized(64, 64, static_cast<float>(i))));
  const auto refused = of_crowd(sized(64, 64, 9.0f));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("for this address"));
  EXPECT_TRUE(views.assign(one(99), sized(64, 64, 9.0f))) << "another address has room";
  EXPECT_TRUE(of_crowd(sized(64, 64, 0.0f))) << "what is drawn already costs nothing";
}

TEST(PictureViews, PixelsAreBoundedForAnAddressForViewersAndInAll) {
  PictureViews views(scene_view(), kHardwareBudget);
  // Of one address: exactly one picture of the largest size.
  ASSERT_EQ(kHardwareBudget.peer_pixels(), uint64_t{kMaxPictureWidth} * kMaxPictureHeight);
  ASSERT_TRUE(views.assign({1, "a", true}, sized(kMaxPictureWidth, kMaxPictureHeight)));
  EXPECT_FALSE(views.assign({2, "a", true}, sized(16, 16)));
  // In all: a second one of another address, and then nothing.
  ASSERT_TRUE(views.assign({3, "b", true}, sized(kMaxPictureWidth, kMaxPictureHeight, 1.0f)));
  EXPECT_FALSE(views.assign({4, "c", true}, sized(16, 16)));
  EXPECT_TRUE(views.assign({4, "c", false}, scene_view())) << "but the scene's own";
  views.remove(1);
  views.remove(3);
  // Viewers together: one and a half.
  ASSERT_TRUE(views.assign({5, "a", false}, sized(kMaxPictureWidth, kMaxPictureHeight)));
  ASSERT_TRUE(views.assign({6, "b", false}, sized(kMaxPictureWidth, kMaxPictureHeight / 2)));
  EXPECT_FALSE(views.assign({7, "c", false}, sized(16, 16)));
  EXPECT_TRUE(views.assign({7, "c", true}, sized(kMaxPictureWidth, kMaxPictureHeight / 2))) << "a controller";
  // Who has taken its share may still look elsewhere, or ask for less.
  EXPECT_TRUE(views.assign({5, "a", false}, sized(kMaxPictureWidth, kMaxPictureHeight, 2.0f)));
  EXPECT_TRUE(views.assign({5, "a", false}, sized(kMaxPictureWidth / 2, kMaxPictureHeight, 2.0f)));
}

TEST(PictureViews, WhatControllersTakeIsNotOfTheViewersShare) {
  PictureViews views(scene_view(), kHardwareBudget);
  ASSERT_TRUE(views.assign({1, "a", true}, sized(kMaxPictureWidth, kMaxPictureHeight)));
  EXPECT_TRUE(views.assign({2, "b", false}, sized(kMaxPictureWidth, kMaxPictureHeight * 3 / 4)));
}

// Two addresses may have three each of the largest, and viewers four of these six.
TEST(PictureViews, WithoutAGpuTheBudgetIsThatOfTheProcessor) {
  PictureViews views(scene_view(), kSoftwareBudget);
  const auto refused = views.assign({1, "a", true}, sized(1284, 720));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::BadInput) << "it has to be made to fit";
  const auto large = [&](uint64_t viewer, const char* peer, bool is_controller) {
    return views.assign({viewer, peer, is_controller}, sized(1280, 720, static_cast<float>(viewer))).ok();
  };
  for (uint64_t viewer = 1; viewer <= 3; ++viewer) ASSERT_TRUE(large(viewer, "a", false));
  EXPECT_FALSE(large(4, "a", false)) << "of one address";
  ASSERT_TRUE(large(4, "b", false));
  EXPECT_FALSE(large(5, "b", false)) << "of all viewers";
  ASSERT_TRUE(large(5, "b", true));
  ASSERT_TRUE(large(6, "b", true));
  EXPECT_FALSE(views.assign({7, "c", true}, sized(16, 16))) << "in all";
  EXPECT_TRUE(views.assign({7, "c", false}, scene_view())) << "but the scene's own";
}

// The figures of docs/internals/more_limits.md.
TEST(PictureViews, TheBudgetsAreAsPromised) {
  EXPECT_EQ(kHardwareBudget.picture_pixels, 3840u * 2160u);
  EXPECT_EQ(kHardwareBudget.all_pixels, 16'588'800u);
  EXPECT_EQ(kHardwareBudget.viewer_pixels(), 12'441'600u);
  EXPECT_EQ(kHardwareBudget.peer_pixels(), 8'294'400u);
  EXPECT_EQ(kSoftwareBudget.picture_pixels, 1280u * 720u);
  EXPECT_EQ(kSoftwareBudget.all_pixels, 5'529'600u);
  EXPECT_EQ(kSoftwareBudget.viewer_pixels(), 4'147'200u);
  EXPECT_EQ(kSoftwareBudget.peer_pixels(), 2'764'800u);
  EXPECT_EQ(kDrawnPixelBytes, 110u);
  EXPECT_EQ(kClassPixelBytes, 40u);
  EXPECT_LE(kSoftwareBudget.most_bytes(), 480'000'000u);
}

TEST(PictureViews, WhatDoesNotFitIsDrawnSmallerInTheSameShape) {
  std::mt19937 random(1);
  std::uniform_int_distribution<uint32_t> width(kMinPictureSide, kMaxPictureWidth);
  std::uniform_int_distribution<uint32_t> height(kMinPictureSide, kMaxPictureHeight);
  for (int round = 0; round < 2'000; ++round) {
    const RenderSize wished{width(random), height(random)};
    const RenderSize on_hardware = fit_picture(wished, kHardwareBudget);
    EXPECT_EQ(on_hardware.width, wished.width);
    EXPECT_EQ(on_hardware.height, wished.height);
    const RenderSize fitted = fit_picture(wished, kSoftwareBudget);
    const uint64_t pixels = uint64_t{fitted.width} * fitted.height;
    ASSERT_LE(pixels, kSoftwareBudget.picture_pixels);
    ASSERT_TRUE(validate(sized(fitted.width, fitted.height)));
    if (uint64_t{wished.width} * wished.height <= kSoftwareBudget.picture_pixels) {
      EXPECT_EQ(fitted.width, wished.width);
      EXPECT_EQ(fitted.height, wished.height);
      continue;
    }
    EXPECT_EQ(fitted.width % 4, 0u);
    EXPECT_EQ(fitted.height % 4, 0u);
    // Each side loses less than 4 pixels to that.
    const double shape = static_cast<double>(wished.width) / wished.height;
    EXPECT_LE(fitted.width, shape * (fitted.height + 4.0));
    EXPECT_GE(fitted.width + 4.0, shape * fitted.height);
    EXPECT_GT((fitted.width + 4.0) * (fitted.height + 4.0), kSoftwareBudget.picture_pixels);
  }
}

TEST(PictureViews, ClassesEndWithTheirLastViewerAndNumbersDoNotReturn) {
  PictureViews views(scene_view(), kHardwareBudget);
  const uint32_t first = *views.assign(one(1), view_at(0.0f));
  ASSERT_TRUE(views.assign(one(2), view_at(0.0f)));
  views.remove(1);
  EXPECT_EQ(views.views().size(), 1u);
  views.remove(2);
  views.remove(2);
  EXPECT_TRUE(views.views().empty());
  EXPECT_NE(*views.assign(one(1), view_at(0.0f)), first);
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
}  // namespace strandcast::picture_views_test
