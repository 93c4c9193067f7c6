// What viewers see of a stream: the comparison of pictures on a very small one, and what is read off its
// curves.
#include "server/report/stream_view.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "common/pictures/picture.h"
#include "server/report/stream_pixels.h"
#include "server/report/stream_playout.h"
#include "server/report/stream_view_page.h"
#include "server/report/view_painter.h"

namespace strandcast::stream_view_test {
namespace {

using testing::HasSubstr;

PixelPoint point(double mbit_per_s, double psnr_db, const std::string& codec = "jpeg") {
  PixelPoint result;
  result.distance_m = 3.0;
  result.codec = codec;
  result.mbit_per_s = mbit_per_s;
  result.psnr_db = psnr_db;
  return result;
}

TEST(PixelCurve, IsReadBetweenItsPoints) {
  const std::vector<PixelPoint> pixels = {point(8.0, 40.0), point(2.0, 30.0), point(1.0, 50.0, "vp8")};
  // Halfway in dB is the geometric mean of the rates.
  EXPECT_NEAR(mbit_per_s_for(pixels, "jpeg", 3.0, LookMeasure::Psnr, 35.0).value(), 4.0, 1e-9);
  EXPECT_NEAR(mbit_per_s_for(pixels, "jpeg", 3.0, LookMeasure::Psnr, 40.0).value(), 8.0, 1e-9);
  EXPECT_NEAR(mbit_per_s_for(pixels, "jpeg", 3.0, LookMeasure::Psnr, 20.0).value(), 2.0, 1e-9)
      << "the least that was measured";
  EXPECT_FALSE(mbit_per_s_for(pixels, "jpeg", 3.0, LookMeasure::Psnr, 40.1).has_value());
  EXPECT_FALSE(mbit_per_s_for(pixels, "h264", 3.0, LookMeasure::Psnr, 30.0).has_value());
  EXPECT_FALSE(mbit_per_s_for(pixels, "jpeg", 0.66, LookMeasure::Psnr, 30.0).has_value());
  EXPECT_FALSE(psnr_db_at(pixels, "jpeg", 3.0, 1.9).has_value());
  EXPECT_NEAR(psnr_db_at(pixels, "jpeg", 3.0, 100.0).value(), 40.0, 1e-9);
  for (const double psnr_db : {31.0, 33.3, 39.0})
    EXPECT_NEAR(psnr_db_at(pixels, "jpeg", 3.0,
                           mbit_per_s_for(pixels, "jpeg", 3.0, LookMeasure::Psnr, psnr_db).value())
                    .value(),
                psnr_db, 1e-9);
}

TEST(PixelTable, SaysWhatIsMissingAndWhatIsNeverReached) {
  StreamView view;
  view.rows = {{.codec = "tangent", .distance_m = 3.0, .bound_m = 1e-4, .psnr_db = 35.0, .mbit_per_s = 2.0}};
  view.pixels = {point(2.0, 30.0), point(8.0, 40.0), point(1.0, 20.0, "vp8")};
  view.missing = {"h264"};
  const HtmlTable table = pixel_table(view, LookMeasure::Psnr);
  ASSERT_EQ(table.rows.size(), 1u);
  const std::vector<HtmlCell>& cells = table.rows[0];
  ASSERT_EQ(cells.size(), table.columns.size());
  EXPECT_EQ(cells[3].text, "4.0 (2.0 times)");
  EXPECT_EQ(cells[4].text, "never: 20.0 dB with 1.0");
  EXPECT_EQ(cells[5].text, "not built in");
  EXPECT_EQ(cells[6].text, "30.0 dB (jpeg)");
}

TEST(PixelCurve, IsReadBySsimToo) {
  std::vector<PixelPoint> pixels = {point(1.0, 0.0), point(100.0, 0.0)};
  pixels[0].ssim = 0.9;    // 10 dB
  pixels[1].ssim = 0.999;  // 30 dB
  StreamViewRow strands;
  strands.ssim = 0.99;
  EXPECT_NEAR(look_db(strands, LookMeasure::Ssim), 20.0, 1e-9);
  EXPECT_NEAR(mbit_per_s_for(pixels, "jpeg", 3.0, LookMeasure::Ssim, 20.0).value(), 10.0, 1e-9);
  EXPECT_FALSE(mbit_per_s_for(pixels, "jpeg", 3.0, LookMeasure::Ssim, 31.0).has_value());
  strands.ssim = 1.0;
  EXPECT_TRUE(std::isfinite(look_db(strands, LookMeasure::Ssim)));
}

TEST(Crop, HasMostOfTheMaskAndLiesInThePicture) {
  const RenderSize size{40, 30};
  PictureMask mask(size_t{40} * 30);
  // Two patches with nothing at their middle, one of them larger.
  for (size_t y = 2; y < 8; ++y)
    for (size_t x = 30; x < 36; ++x) mask[y * 40 + x] = 1;
  for (size_t y = 20; y < 24; ++y)
    for (size_t x = 4; x < 8; ++x) mask[y * 40 + x] = 1;
  const PictureCrop crop = fullest_crop(mask, size, 6);
  EXPECT_EQ(crop.left, 30u);
  EXPECT_EQ(crop.top, 2u);
  EXPECT_EQ(crop.side, 6u);
  std::fill(mask.begin(), mask.end(), uint8_t{0});
  mask.back() = 1;
  const PictureCrop corner = fullest_crop(mask, size, 10);
  EXPECT_EQ(corner.left + corner.side, 40u);
  EXPECT_EQ(corner.top + corner.side, 30u);
  EXPECT_EQ(fullest_crop(mask, size, 100).side, 30u) << "no larger than the picture";
}

TEST(ViewCamera, StandsSoFarAwayInTheSameDirection) {
  const CameraDesc near_camera = camera_at({}, 0.66);
  const CameraDesc far_camera = camera_at(near_camera, 3.0);
  EXPECT_NEAR(glm::length(far_camera.offset_m), 3.0f, 1e-5f);
  EXPECT_NEAR(glm::dot(glm::normalize(far_camera.offset_m), glm::normalize(near_camera.offset_m)), 1.0f,
              1e-6f);
  // The near one is where the built-in scene's stands.
  EXPECT_NEAR(glm::distance(near_camera.offset_m, CameraDesc{}.offset_m), 0.0f, 0.01f);
}

TEST(StreamView, FinerStrandsLookMoreLikeTheExactOnesAndTakeMore) {
  const RecordingDesc desc{built_in_stream_motions()[1], {60, 8}, 0.25, "", nullptr};
  const auto recording = record_strands(desc);
  ASSERT_TRUE(recording.ok()) << recording.error().to_string();
  uint32_t said = 0;
  const auto view =
      measure_view({{160, 90}, 2}, recorded_scene(desc), *recording, [&](const std::string&) { ++said; });
  ASSERT_TRUE(view.ok()) << view.error().to_string();
  EXPECT_EQ(view->compared_pictures, 2u);
  EXPECT_LE(said, view_step_count());
  ASSERT_EQ(view->rows.size(), std::size(kViewDistancesM) * std::size(kViewCodecs) * std::size(kViewBoundsM));
  for (size_t i = 0; i < view->rows.size(); ++i) {
    const StreamViewRow& row = view->rows[i];
    EXPECT_GT(row.hair_share, 0.0);
    EXPECT_LT(row.hair_share, 0.5);
    EXPECT_GT(row.psnr_db, 20.0) << "a head apart, or a frame, is less";
    if (i % std::size(kViewBoundsM) == 0) continue;
    const StreamViewRow& finer = view->rows[i - 1];
    EXPECT_LT(finer.bound_m, row.bound_m);
    EXPECT_GT(finer.mbit_per_s, row.mbit_per_s);
  }
  for (size_t d = 0; d < std::size(kViewDistancesM) * std::size(kViewCodecs); ++d) {
    const StreamViewRow& finest = view->rows[d * std::size(kViewBoundsM)];
    const StreamViewRow& coarsest = view->rows[(d + 1) * std::size(kViewBoundsM) - 1];
    EXPECT_GT(finest.psnr_db, coarsest.psnr_db + 6.0) << "25 times as exact";
    EXPECT_GT(finest.ssim, coarsest.ssim);
  }
  EXPECT_LT(view->rows.back().hair_share, 0.2 * view->rows.front().hair_share) << "far hair is small";
  // Every picture codec took part or is said to be missing, and a coarse JPEG is worse than a fine one.
  std::map<std::string, std::vector<const PixelPoint*>> by_codec;
  for (const PixelPoint& one : view->pixels)
    if (one.distance_m == kViewDistancesM[0]) by_codec[one.codec].push_back(&one);
  EXPECT_EQ(by_codec.size() + view->missing.size(), kPictureCodecs.size());
  const std::vector<const PixelPoint*>& jpeg = by_codec["jpeg"];
  ASSERT_GT(jpeg.size(), 2u);
  EXPECT_GT(jpeg.back()->psnr_db, jpeg.front()->psnr_db);
  EXPECT_GT(jpeg.back()->mbit_per_s, jpeg.front()->mbit_per_s);
  // Exact, two bounds and a difference.
  ASSERT_EQ(view->sheets.size(), std::size(kViewDistancesM));
  EXPECT_EQ(view->sheets[0].image.width, 4 * view->sheets[0].image.height);
  HtmlPage page("page");
  add_view_sections(page, *view);
  EXPECT_THAT(page.text(), HasSubstr("Strands or pictures?"));
  EXPECT_THAT(view_plot(*view), HasSubstr("tangent from 0.66 m"));
  const std::string csv = view_csv(*view);
  EXPECT_EQ(static_cast<size_t>(std::count(csv.begin(), csv.end(), '\n')), view->rows.size() + 1);
}

// On the built-in walk, which is smooth, and on a captured one, whose head trembles.
TEST(StreamPlayout, LooksNearerToTheStateOnTheCubicThanOnTheLineAndThanTheStateBefore) {
  std::vector<StreamMotion> motions = {built_in_stream_motions()[1]};
  const std::filesystem::path clip = std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap/cmu_131_03.bvh";
  if (std::filesystem::exists(clip)) motions.push_back(load_stream_motion(clip, {}).value());
  for (const StreamMotion& motion : motions) {
    SCOPED_TRACE(motion.name);
    const RecordingDesc desc{motion, {200, 16}, 0.25, "", nullptr};
    const auto recording = record_strands(desc);
    ASSERT_TRUE(recording.ok()) << recording.error().to_string();
    const auto rows = measure_playout({{160, 90}, 3}, recorded_scene(desc), *recording);
    ASSERT_TRUE(rows.ok()) << rows.error().to_string();
    ASSERT_EQ(rows->size(), 3u);
    const PlayoutRow& held = (*rows)[0];
    const PlayoutRow& line = (*rows)[1];
    const PlayoutRow& cubic = (*rows)[2];
    EXPECT_EQ(held.interpolation, Interpolation::None);
    EXPECT_EQ(line.interpolation, Interpolation::Linear);
    EXPECT_EQ(cubic.interpolation, Interpolation::Cubic);
    EXPECT_LT(line.rms_error_m, held.rms_error_m);
    EXPECT_LT(cubic.rms_error_m, line.rms_error_m);
    EXPECT_GT(line.psnr_db, held.psnr_db);
    EXPECT_GE(cubic.psnr_db, line.psnr_db);
    EXPECT_GE(cubic.ssim, line.ssim);
    EXPECT_EQ(playout_table(*rows).rows.size(), rows->size());
    EXPECT_THAT(playout_csv(*rows), HasSubstr("cubic"));
  }
  if (motions.size() == 1) GTEST_SKIP() << "the captured walk needs ../shared/data: there is no " << clip;
}

TEST(StreamPlayout, AStateThatWasThereIsShownAsItWas) {
  const RecordingDesc desc{built_in_stream_motions()[1], {60, 8}, 0.25, "", nullptr};
  auto recording = record_strands(desc);
  ASSERT_TRUE(recording.ok()) << recording.error().to_string();
  // Nothing moves: every way shows the state.
  for (StreamFrame& frame : recording->frames) {
    frame.position_in_head_m = recording->frames[0].position_in_head_m;
    frame.published.world_from_head = recording->frames[0].published.world_from_head;
  }
  const auto rows = measure_playout({{160, 90}, 1}, recorded_scene(desc), *recording);
  ASSERT_TRUE(rows.ok()) << rows.error().to_string();
  for (const PlayoutRow& row : *rows) {
    EXPECT_LT(row.rms_error_m, 1e-7);
    EXPECT_GT(row.psnr_db, 60.0);
  }
  recording->frames.resize(6);
  EXPECT_FALSE(measure_playout({{160, 90}, 1}, recorded_scene(desc), *recording).ok()) << "no cubic fits";
}

}  // namespace
}  // namespace strandcast::stream_view_test
