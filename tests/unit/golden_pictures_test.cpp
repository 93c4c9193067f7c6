// What hair looks like, as a person once judged it: few small pictures, compared where there is hair. A
// change that is meant: STRANDCAST_RENEW_GOLDEN=1 writes them anew; look at them before they are committed.
#include <cstdlib>
#include <filesystem>

#include "common/pictures/picture_error.h"
#include "tests/support/grown_hair.h"
#include "tests/support/sample_look.h"

namespace strandcast::golden_pictures_test {
namespace {

constexpr RenderSize kSize{96, 96};
// Of the two back ends, and of processors whose sines differ in the last digit; what a person sees is far
// more.
constexpr double kLeastPsnrDb = 45.0;
constexpr double kLeastSsim = 0.99;
constexpr double kMostDeltaE = 0.5;

struct Golden {
  std::string name;
  LookDesc look;
  CameraDesc camera;
};

std::vector<Golden> goldens() {
  std::vector<Golden> all;
  const CameraDesc front;
  all.push_back({"front", {}, front});
  all.push_back({"every_field", sample_look(), front});
  Golden blond{"blond_against_the_light", {}, front};
  blond.look.hair_color = "blond";
  blond.look.light_direction = {0.3f, -0.4f, 1.0f};
  all.push_back(blond);
  Golden wet{"wet_red", {}, front};
  wet.look.hair_color = "red";
  wet.look.shading.wetness = 1.0f;
  all.push_back(wet);
  Golden crown{"crown", {}, front};
  crown.camera.offset_m = {0.05f, 0.6f, 0.15f};
  crown.camera.target_m = {0.0f, 0.03f, 0.0f};
  all.push_back(crown);
  Golden near{"near", {}, front};
  near.camera.offset_m = {0.1f, 0.0f, 0.18f};
  near.camera.target_m = {0.06f, 0.0f, 0.02f};
  all.push_back(near);
  return all;
}

Image difference(const Image& a, const Image& b) {
  constexpr int kTimes = 8;
  Image result = a;
  for (size_t i = 0; i < result.rgba.size(); ++i)
    result.rgba[i] =
        i % 4 == 3 ? 255
                   : static_cast<uint8_t>(std::min(255, kTimes * std::abs(int{a.rgba[i]} - int{b.rgba[i]})));
  return result;
}

TEST(GoldenPictures, HairLooksAsItDid) {
  const std::filesystem::path folder = STRANDCAST_GOLDEN_FOLDER;
  const std::filesystem::path out = STRANDCAST_GOLDEN_OUT;
  const char* const renew = std::getenv("STRANDCAST_RENEW_GOLDEN");
  const SceneAsset asset = grown_hair(800, 16);
  for (const Golden& golden : goldens()) {
    const TileOptions options{own_workers(2), simd::widest_set()};
    const Image actual = drawn(asset, golden.look, options, kSize, golden.camera);
    const std::filesystem::path file = folder / (golden.name + ".png");
    if (renew != nullptr && std::string(renew) == "1") {
      std::filesystem::create_directories(folder);
      ASSERT_TRUE(save_png(file, actual));
      continue;
    }
    const auto expected = load_png(file);
    ASSERT_TRUE(expected) << expected.error().to_string();
    const Image without = drawn(bald(asset), golden.look, options, kSize, golden.camera);
    const auto error = picture_error(actual, *expected, mask_of(*expected, without));
    ASSERT_TRUE(error) << error.error().to_string();
    EXPECT_GT(error->masked_share, 0.1) << golden.name << " shows hair";
    const bool is_alike =
        error->psnr_db >= kLeastPsnrDb && error->ssim >= kLeastSsim && error->delta_e <= kMostDeltaE;
    if (is_alike) continue;
    std::filesystem::create_directories(out);
    const auto keep = [&](const char* what, const Image& image) {
      EXPECT_TRUE(save_png(out / fmt::format("{}_{}.png", golden.name, what), image));
    };
    keep("actual", actual);
    keep("expected", *expected);
    keep("difference", difference(actual, *expected));
    ADD_FAILURE() << golden.name << ": PSNR " << error->psnr_db << " dB, SSIM " << error->ssim
                  << ", mean colour difference " << error->delta_e << " where there is hair; see " << out
                  << "\n(difference eight times as strong; STRANDCAST_RENEW_GOLDEN=1 takes the new ones)";
  }
}

}  // namespace
}  // namespace strandcast::golden_pictures_test
