// The measure of pictures against a path tracer: what it says of pictures whose difference is known, and that
// the kept truths are those of the hair that is drawn today.
#include "server/report/pictures_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/groom/groom_asset.h"
#include "common/render/tiles/tile_renderer.h"
#include "common/scene/scene_file.h"
#include "server/scene/scene_content.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::pictures_study_test {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr uint32_t kWide = 24, kHigh = 20;

/// A picture with waves of light in all three colours.
LightCells waves() {
  LightCells cells{kWide, kHigh, {}};
  for (uint32_t y = 0; y < kHigh; ++y)
    for (uint32_t x = 0; x < kWide; ++x) {
      const float wave = 0.3f + 0.2f * std::sin(0.7f * static_cast<float>(x) + 0.4f * static_cast<float>(y));
      cells.light.emplace_back(wave, 0.5f * wave, 0.25f * wave);
    }
  return cells;
}

/// Hair in the upper half, skin in the lower.
CoverCells halves() {
  CoverCells cover{kWide, kHigh, {}, {}};
  for (uint32_t i = 0; i < kWide * kHigh; ++i) {
    const bool is_hair = i < kWide * kHigh / 2;
    cover.hair.push_back(is_hair ? 1.0f : 0.0f);
    cover.skin.push_back(is_hair ? 0.0f : 1.0f);
  }
  return cover;
}

LightCells brighter(LightCells cells, const glm::vec3& gain) {
  for (glm::vec3& light : cells.light) light *= gain;
  return cells;
}

TEST(CellError, OfThePictureItselfIsNone) {
  for (const CellPart part : {CellPart::Hair, CellPart::Skin}) {
    const CellError error = cell_error(waves(), waves(), halves(), part).value();
    EXPECT_EQ(error.cells, kWide * kHigh / 2);
    EXPECT_TRUE(std::isinf(error.psnr_db));
    EXPECT_DOUBLE_EQ(error.ssim, 1.0);
    EXPECT_DOUBLE_EQ(error.luminance_ratio, 1.0);
  }
}

TEST(CellError, AGainOfAColourIsItsRatio) {
  const CellError error =
      cell_error(brighter(waves(), {0.5f, 2.0f, 1.25f}), waves(), halves(), CellPart::Hair).value();
  EXPECT_NEAR(error.ratio.x, 0.5, 1e-6);
  EXPECT_NEAR(error.ratio.y, 2.0, 1e-6);
  EXPECT_NEAR(error.ratio.z, 1.25, 1e-6);
  EXPECT_LT(error.ssim, 1.0);
}

// A step of 1/10 of what the screen shows, in every colour: 20 dB by the definition of PSNR.
TEST(CellError, AKnownStepIsAKnownPsnr) {
  LightCells dark{kWide, kHigh, std::vector<glm::vec3>(size_t{kWide} * kHigh, glm::vec3(0.0f))};
  LightCells light = dark;
  const auto linear = static_cast<float>(std::pow((0.1 + 0.055) / 1.055, 2.4));
  for (glm::vec3& cell : light.light) cell = glm::vec3(linear);
  EXPECT_NEAR(cell_error(light, dark, halves(), CellPart::Skin)->psnr_db, 20.0, 1e-4);
}

TEST(CellError, LooksAtItsPartAlone) {
  LightCells other = waves();
  for (size_t i = other.light.size() / 2; i < other.light.size(); ++i) other.light[i] *= 3.0f;
  EXPECT_TRUE(std::isinf(cell_error(other, waves(), halves(), CellPart::Hair)->psnr_db));
  EXPECT_NEAR(cell_error(other, waves(), halves(), CellPart::Skin)->luminance_ratio, 3.0, 1e-5);
  EXPECT_FALSE(cell_error(LightCells{kWide, 1, {}}, waves(), halves(), CellPart::Hair));
}

TEST(HairFigures, AreThoseOfKnownHair) {
  LightCells cells = waves();
  const glm::vec3 dark(0.2f, 0.1f, 0.05f);
  for (size_t i = 0; i < cells.light.size(); ++i) cells.light[i] = i % 2 == 0 ? dark : 3.0f * dark;
  const HairFigures even = hair_figures(cells, halves()).value();
  EXPECT_NEAR(even.contrast, 0.5, 1e-6);     // half of it 1, half of it 3: deviation 1, mean 2
  EXPECT_NEAR(even.saturation, 0.75, 1e-6);  // blue is a quarter of red
  EXPECT_NEAR(even.brightest / even.luminance, 1.5, 1e-6);
  // A bright row at a known height.
  for (size_t x = 0; x < kWide; ++x) cells.light[size_t{7} * kWide + x] = 20.0f * dark;
  const HairFigures lit = hair_figures(cells, halves()).value();
  EXPECT_NEAR(lit.glow_place, 0.75, 0.11);  // of ten rows; smoothing over three moves it by one
  EXPECT_NEAR(lit.glow_width, 0.3, 0.01);
}

/// Cells of one luminance on the screen, 0..1.
LightCells shown_as(double shown) {
  const auto light = static_cast<float>(std::pow((shown + 0.055) / 1.055, 2.4));
  return {kWide, kHigh, std::vector<glm::vec3>(size_t{kWide} * kHigh, glm::vec3(light))};
}

TEST(Restlessness, IsTheSecondDifferenceOfWhatAScreenShows) {
  const PictureMask all(size_t{kWide} * kHigh, 1);
  EXPECT_NEAR(restlessness({shown_as(0.2), shown_as(0.3), shown_as(0.4)}, all).value(), 0.0, 1e-6);
  EXPECT_NEAR(restlessness({shown_as(0.2), shown_as(0.3), shown_as(0.2)}, all).value(), 0.2, 1e-6);
  // A pixel that jumps counts where the mask says so.
  LightCells jump = shown_as(0.3);
  jump.light[5] = shown_as(0.4).light[0];
  PictureMask without = all;
  without[5] = 0;
  EXPECT_NEAR(restlessness({shown_as(0.3), jump, shown_as(0.3)}, all).value(), 0.2 / std::sqrt(kWide * kHigh),
              1e-6);
  EXPECT_NEAR(restlessness({shown_as(0.3), jump, shown_as(0.3)}, without).value(), 0.0, 1e-9);
  EXPECT_FALSE(restlessness({shown_as(0.3), jump, LightCells{}}, all));
}

/// Where nothing is drawn, a picture shows its background.
TEST(Cells, UndoWhatAScreenShows) {
  SceneDesc scene =
      built_in_scene_with({"head.is_visible=false", "groom.procedural.strand_count=50"}).value();
  scene.camera.target_m.y = 50.0f;  // past the hair
  scene.look.background = {0.05f, 0.2f, 0.45f};
  const SceneContent content = load_scene_content(scene).value();
  const SceneAsset asset = make_scene_asset(content.groom, content.head);
  const auto renderer = make_tile_renderer(asset, scene.look).value();
  ASSERT_TRUE(renderer->draw({{}, asset.rest_position_m}, scene.camera, {kWide * kCellPx, kHigh * kCellPx}));
  const LightCells seen = cells_of(renderer->read_image());
  const std::vector<float> none(size_t{kWide} * kHigh, 0.0f);
  const LightCells black{kWide, kHigh, std::vector<glm::vec3>(none.size(), glm::vec3(0.0f))};
  const LightCells expected = over_background(black, {kWide, kHigh, none, none}, scene.look.background);
  double worst = 0.0;
  for (size_t i = 0; i < seen.light.size(); ++i)
    for (int k = 0; k < 3; ++k)
      worst = std::max(worst, std::abs(double{seen.light[i][k]} / double{expected.light[i][k]} - 1.0));
  EXPECT_LT(worst, 0.03) << "8 bits have steps of 3 % at the darkest";
}

// Light of 1 is 0.3 over the knee at 0.7, which lets half of the 0.3 above it through: 0.85, and 237.6 in
// sRGB.
TEST(Cells, UndoTheToneCurve) {
  Image image{kCellPx, kCellPx, std::vector<uint8_t>(size_t{kCellPx} * kCellPx * 4, 238)};
  EXPECT_NEAR(cells_of(image).light.front().x, 1.0f, 0.03f);
  std::fill(image.rgba.begin(), image.rgba.end(), uint8_t{237});
  EXPECT_NEAR(cells_of(image).light.front().x, 1.0f, 0.03f);
}

TEST(KeptTruths, AreThereAndSmall) {
  const std::filesystem::path folder = default_truth_folder();
  uint64_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) bytes += entry.file_size();
  EXPECT_LT(bytes, 1'500'000u);
  size_t fitted = 0;
  for (const TruthView& view : truth_views()) {
    const auto truth = load_truth(folder, view);
    ASSERT_TRUE(truth) << truth.error().to_string();
    EXPECT_EQ(truth->light.width, kTruthWidthPx / kCellPx);
    EXPECT_GT(hair_figures(truth->light, truth->cover)->luminance, 0.0) << view.name();
    fitted += view.is_fitted ? 1 : 0;
  }
  EXPECT_EQ(2 * fitted, truth_views().size());
}

// Light adds up: by each lamp alone it is that by all. A truth with another exposure or direction would not
// fit in.
TEST(KeptTruths, LightsAddUp) {
  const std::filesystem::path folder = default_truth_folder();
  const auto lit = [&](const std::string& light) {
    return load_truth(folder, {"front", "brown", light, "rest", false}).value();
  };
  const ViewTruth all = lit("all");
  const ViewTruth rim = lit("rim");
  const ViewTruth sky = lit("sky");
  LightCells sum = lit("key").light;
  const float ambient = built_in_scene_with({})->look.ambient;
  for (size_t i = 0; i < sum.light.size(); ++i)
    sum.light[i] += rim.light.light[i] + ambient * sky.light.light[i];
  const CellError error = cell_error(sum, all.light, all.cover, CellPart::Hair).value();
  EXPECT_NEAR(error.luminance_ratio, 1.0, 0.03);
  EXPECT_GT(error.psnr_db, 26.0);
  EXPECT_NEAR(cell_error(sum, all.light, all.cover, CellPart::Skin)->luminance_ratio, 1.0, 0.03);
  // The counter-example: without the rim light it is not all.
  EXPECT_LT(cell_error(lit("key").light, all.light, all.cover, CellPart::Hair)->luminance_ratio, 0.9);
}

PicturesDesc one_view() {
  PicturesDesc desc;
  desc.only = {"front_brown"};
  desc.rounds = 1;
  return desc;
}

TEST(PicturesStudy, HoldsAViewAgainstItsKeptTruth) {
  const auto report = run_pictures(one_view());
  ASSERT_TRUE(report) << report.error().to_string();
  ASSERT_EQ(report->views.size(), 1u);
  const PictureRow& row = report->views.front();
  EXPECT_LT(row.misplaced, 0.02)
      << "The built-in hair is not that of the truths; --blender --keep makes them again.";
  EXPECT_GT(row.hair.psnr_db, 15.0);
  EXPECT_GT(row.hair.ssim, 0.5);
  EXPECT_THAT(pictures_text(*report), Not(HasSubstr("elsewhere")));
  EXPECT_THAT(pictures_csv(*report), HasSubstr("front_brown"));
  EXPECT_THAT(pictures_page(*report), HasSubstr("data:image/jpeg"));
}

// The counter-example: against the truth of another camera hair is elsewhere, and the report says so.
TEST(PicturesStudy, FindsATruthOfOtherHair) {
  const TemporaryFolder folder;
  const std::filesystem::path kept = default_truth_folder();
  for (const char* file : {"back_brown.png", "cover_back_rest.png"}) {
    std::string name = file;
    name.replace(name.find("back"), 4, "front");
    std::filesystem::copy_file(kept / file, folder.path() / name);
  }
  PicturesDesc desc = one_view();
  desc.truths = folder.path();
  const auto report = run_pictures(desc);
  ASSERT_TRUE(report) << report.error().to_string();
  EXPECT_GT(report->views.front().misplaced, 0.02);
  EXPECT_THAT(pictures_text(*report), HasSubstr("elsewhere in the truth"));
}

TEST(PicturesStudy, NamesWhatItKnowsAndWhatIsMissing) {
  PicturesDesc desc = one_view();
  desc.only = {"upside_down"};
  EXPECT_THAT(run_pictures(desc).error().to_string(), HasSubstr("front_brown"));
  desc = one_view();
  desc.scene = built_in_scene_with({}).value();
  EXPECT_THAT(run_pictures(desc).error().to_string(), HasSubstr("--blender"));
  const TemporaryFolder empty;
  desc = one_view();
  desc.truths = empty.path();
  EXPECT_EQ(run_pictures(desc).error().code, ErrorCode::NotFound);
}

TEST(PicturesStudy, TimeOfAnEqualErrorLiesBetweenTwoNumbersOfSamples) {
  PicturesReport report;
  report.cycles = {{"v", 1, 1.0, {}}, {"v", 4, 4.0, {}}};
  report.cycles[0].hair.psnr_db = 20.0;
  report.cycles[1].hair.psnr_db = 26.0;
  EXPECT_NEAR(cycles_s_at(report, "v", 23.0), 2.0, 1e-9);  // half-way by the logarithm
  EXPECT_DOUBLE_EQ(cycles_s_at(report, "v", 10.0), 1.0);
  EXPECT_TRUE(std::isnan(cycles_s_at(report, "v", 30.0)));
  EXPECT_TRUE(std::isnan(cycles_s_at(report, "w", 23.0)));
}

}  // namespace
}  // namespace strandcast::pictures_study_test
