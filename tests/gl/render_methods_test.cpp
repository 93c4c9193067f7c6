// Every method of shading and scattering draws a picture that can be looked at, in every colour, and shows
// what its settings say. The groom is grown, small, and drawn at rest.
#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/groom/groom_asset.h"
#include "common/groom/mesh.h"
#include "common/groom/procedural.h"
#include "common/render/renderer.h"
#include "common/scene/hair_color.h"
#include "tests/support/gl_fixture.h"

namespace strandcast::render_methods_test {
namespace {

constexpr RenderSize kSize{160, 160};
constexpr float kHeadRadiusM = 0.095f;

class RenderMethods : public GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    ProceduralGroomOptions options;
    options.strand_count = 400;
    options.vertex_count = 10;
    options.length_m = 0.2f;
    auto groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), kHeadRadiusM, 1000), options);
    ASSERT_TRUE(groom) << groom.error().to_string();
    asset_ = make_scene_asset(*groom, make_head(kHeadRadiusM));
  }
  void TearDown() override {
    renderers_.clear();  // before their context
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  }

  // Hair fills the middle of the picture.
  static CameraDesc side() {
    CameraDesc camera;
    camera.offset_m = {0.55f, 0.1f, -0.35f};
    camera.target_m = {0.0f, 0.0f, 0.0f};
    camera.fov_y_rad = 0.5f;
    return camera;
  }
  static LookDesc look_of(const std::string& shading, const std::string& scattering,
                          const std::string& color) {
    LookDesc look;
    look.methods.shading = shading;
    look.methods.scattering = scattering;
    look.hair_color = color;
    look.followers = 4;
    look.strand_radius_m = 0.0004f;  // closes the hair
    look.light_direction = {-0.5f, -0.7f, 0.3f};
    return look;
  }

  /// The renderer that drew these methods last, with another look: what it draws is what a new one would
  /// (SetLookTest), and to make one takes most of the time.
  Renderer* renderer_for(const LookDesc& look) {
    for (const auto& [methods, renderer] : renderers_) {
      if (methods != look.methods) continue;
      const Status set = renderer->set_look(look);
      EXPECT_TRUE(set) << set.error().to_string();
      return renderer.get();
    }
    auto made = Renderer::make(gl::ShaderLibrary(), context_->info(), asset_, look);
    if (!made) {
      ADD_FAILURE() << made.error().to_string();
      return nullptr;
    }
    return renderers_.emplace_back(look.methods, std::move(*made)).second.get();
  }

  Image draw(const LookDesc& look) {
    Renderer* const renderer = renderer_for(look);
    if (renderer == nullptr) return {};
    const Status status = renderer->draw({{}, asset_.rest_position_m}, side(), kSize);
    EXPECT_TRUE(status) << status.error().to_string();
    return renderer->read_image();
  }

  /// Shown colours, 0..1, of the pixels in the middle of the picture.
  static std::vector<glm::dvec3> hair_of(const Image& image) {
    std::vector<glm::dvec3> pixels;
    for (uint32_t y = kSize.height * 3 / 10; y < kSize.height * 7 / 10; ++y)
      for (uint32_t x = kSize.width * 4 / 10; x < kSize.width * 6 / 10; ++x) {
        const uint8_t* pixel = &image.rgba[4 * (static_cast<size_t>(y) * image.width + x)];
        pixels.emplace_back(pixel[0] / 255.0, pixel[1] / 255.0, pixel[2] / 255.0);
      }
    return pixels;
  }
  static double luminance(const glm::dvec3& shown) {
    return glm::dot(shown, glm::dvec3(0.2126, 0.7152, 0.0722));
  }
  static glm::dvec3 mean_of(const Image& image) {
    const auto pixels = hair_of(image);
    glm::dvec3 sum(0.0);
    for (const glm::dvec3& pixel : pixels) sum += pixel;
    return sum / static_cast<double>(pixels.size());
  }
  static double mean_luminance(const Image& image) { return luminance(mean_of(image)); }
  /// Of the hair's pixels, how far they differ on average.
  static double difference(const Image& a, const Image& b) {
    const auto in_a = hair_of(a), in_b = hair_of(b);
    double sum = 0.0;
    for (size_t i = 0; i < in_a.size(); ++i) sum += std::abs(luminance(in_a[i]) - luminance(in_b[i]));
    return sum / static_cast<double>(in_a.size());
  }

  /// Pixels of the whole picture that are clearly darker in `b`.
  static int dimmed_pixels(const Image& a, const Image& b) {
    constexpr int kClearly = 8;  // of 255
    int count = 0;
    for (size_t i = 0; i < a.rgba.size(); i += 4)
      if (a.rgba[i] >= b.rgba[i] + kClearly) ++count;
    return count;
  }

  SceneAsset asset_;
  std::vector<std::pair<RenderMethodsDesc, std::unique_ptr<Renderer>>> renderers_;
};

TEST_F(RenderMethods, TheDefaultsAreSadeghiInTheVolumePerVertex) {
  LookDesc named = look_of("sadeghi", "volume", "custom");
  named.methods.evaluation = "vertex";
  named.methods.shadow = "volume";
  named.methods.transparency = "hashed";
  named.methods.antialiasing = "analytic";
  LookDesc usual = named;
  usual.methods = {};
  EXPECT_EQ(draw(named), draw(usual));
}

TEST_F(RenderMethods, EveryModelIsAsBrightAsTheOthersInEveryColor) {
  for (const HairColorPreset& color : hair_color_presets()) {
    const std::string name(color.name);
    const Image usual_image = draw(look_of("sadeghi", "volume", name));
    const double usual = mean_luminance(usual_image);
    for (const MethodRow& shading : shading_models().rows()) {
      const Image image =
          shading.name == "sadeghi" ? usual_image : draw(look_of(std::string(shading.name), "volume", name));
      EXPECT_NEAR(mean_luminance(image) / usual, 1.0, 0.3) << shading.name << ' ' << name;
      const auto pixels = hair_of(image);
      const auto blown = std::count_if(pixels.begin(), pixels.end(), [](const glm::dvec3& p) {
        return std::min({p.x, p.y, p.z}) > 0.98;
      });
      EXPECT_LT(static_cast<double>(blown), 0.01 * static_cast<double>(pixels.size()))
          << shading.name << ' ' << name;
    }
  }
}

TEST_F(RenderMethods, EveryScatteringIsNeitherBlackNorBlownOut) {
  for (const char* color : {"black", "blond"})
    for (const char* shading : {"sadeghi", "marschner"}) {
      const double usual = mean_luminance(draw(look_of("sadeghi", "volume", color)));
      for (const MethodRow& scattering : scattering_models().rows()) {
        const Image image = draw(look_of(shading, std::string(scattering.name), color));
        EXPECT_NEAR(mean_luminance(image) / usual, 1.0, 0.5)
            << shading << ' ' << scattering.name << ' ' << color;
      }
    }
}

TEST_F(RenderMethods, PresetsAndPigmentShowTheirColor) {
  const auto redness = [&](LookDesc look) {
    const glm::dvec3 mean = mean_of(draw(look));
    return mean.r / mean.b;
  };
  const double grey = redness(look_of("chiang", "volume", "grey"));
  EXPECT_GT(redness(look_of("chiang", "volume", "red")), 1.5 * grey);
  EXPECT_LT(redness(look_of("chiang", "volume", "dyed")), 0.9 * grey);
  LookDesc pigment = look_of("chiang", "volume", "melanin");
  pigment.eumelanin = 0.1f;
  pigment.pheomelanin = 0.4f;
  EXPECT_GT(redness(pigment), 1.3 * grey);
  pigment.eumelanin = 8.0f;
  EXPECT_LT(mean_luminance(draw(pigment)), 0.5 * mean_luminance(draw(look_of("chiang", "volume", "blond"))));
}

TEST_F(RenderMethods, NoTwoMethodsDrawTheSamePicture) {
  std::map<std::string, Image> pictures;
  for (const MethodRow& shading : shading_models().rows())
    pictures[std::string(shading.name)] = draw(look_of(std::string(shading.name), "volume", "blond"));
  for (const MethodRow& scattering : scattering_models().rows())
    if (scattering.name != "volume")
      pictures[std::string(scattering.name)] =
          draw(look_of("sadeghi", std::string(scattering.name), "blond"));
  for (auto a = pictures.begin(); a != pictures.end(); ++a)
    for (auto b = std::next(a); b != pictures.end(); ++b)
      EXPECT_GT(difference(a->second, b->second), 0.002) << a->first << ' ' << b->first;
}

// Light through other strands only adds.
TEST_F(RenderMethods, WithoutScatteringHairIsDarker) {
  EXPECT_LT(mean_luminance(draw(look_of("sadeghi", "none", "blond"))),
            mean_luminance(draw(look_of("sadeghi", "volume", "blond"))) - 0.01);
}

TEST_F(RenderMethods, ALobeThatIsOffIsMissedInThePicture) {
  for (const MethodRow& shading : shading_models().rows()) {
    LookDesc look = look_of(std::string(shading.name), "volume", "blond");
    const glm::dvec3 whole = mean_of(draw(look));
    look.shading.second_highlight = 0.0f;
    const glm::dvec3 lost_trt = whole - mean_of(draw(look));
    look.shading = {};
    look.shading.highlight = 0.0f;
    const glm::dvec3 lost_r = whole - mean_of(draw(look));
    EXPECT_GT(luminance(lost_trt), 0.001) << shading.name << " without TRT";
    EXPECT_GT(luminance(lost_r), 0.001) << shading.name << " without R";
    EXPECT_GT(lost_r.b / lost_r.r, 1.1 * lost_trt.b / lost_trt.r) << shading.name << ": R is the whiter one";
    if (shading.name == "kajiya_kay") continue;  // has no TT
    look.shading = {};
    look.light_direction = {0.6f, -0.4f, -0.3f};  // against the eye
    const Image backlit = draw(look);
    look.shading.transmission = 0.0f;
    EXPECT_GT(dimmed_pixels(backlit, draw(look)), 50) << shading.name << " without TT: the rim glows";
  }
}

// Vertices are close: shading each sample instead changes little, and with it nothing but the shading.
TEST_F(RenderMethods, PerFragmentAndPerVertexAgree) {
  for (const MethodRow& shading : shading_models().rows()) {
    LookDesc look = look_of(std::string(shading.name), "volume", "red");
    look.segments = 4;
    const Image per_vertex = draw(look);
    look.methods.evaluation = "fragment";
    const Image per_fragment = draw(look);
    EXPECT_LT(difference(per_vertex, per_fragment), 0.01) << shading.name;
    EXPECT_NE(per_vertex, per_fragment) << shading.name << ": the variant was not taken";
  }
}

// Petrovic's point: a head of hair is lit like a surface, whichever way its strands run.
TEST_F(RenderMethods, AsASurfaceTheLitSideIsBrighterThanWithStrandsAlone) {
  const auto contrast = [&](const std::string& scattering) {
    LookDesc look = look_of("sadeghi", scattering, "blond");
    look.light_direction = {-1.0f, -0.2f, 0.6f};
    look.ambient = 0.0f;
    const double lit = mean_luminance(draw(look));
    look.light_direction = {0.3f, -1.0f, -0.9f};
    return lit / mean_luminance(draw(look));
  };
  EXPECT_GT(contrast("isosurface"), contrast("volume"));
}

// Seen from the side that the light does not reach: what gets there went through all of the hair.
TEST_F(RenderMethods, DualScatteringTakesLightOnItsWayThroughTheHair) {
  LookDesc look = look_of("marschner", "dual", "brown");
  look.ambient = 0.0f;
  look.light_direction = {-0.55f, -0.3f, 0.35f};
  const double lit = mean_luminance(draw(look));
  look.light_direction = {0.55f, -0.3f, -0.35f};
  EXPECT_LT(mean_luminance(draw(look)), 0.5 * lit);
}

TEST_F(RenderMethods, StrandsWithoutLengthDrawAFinitePicture) {
  for (glm::vec3& point : asset_.rest_position_m) point = glm::vec3(0.0f, 0.12f, 0.0f);
  const auto expect_finite = [&](std::string_view shading, std::string_view scattering) {
    LookDesc look = look_of(std::string(shading), std::string(scattering), "blond");
    look.methods.evaluation = "fragment";
    const Image image = draw(look);
    ASSERT_EQ(image.rgba.size(), size_t{4} * kSize.width * kSize.height);
    // The head and the background around are there.
    EXPECT_GT(mean_luminance(image), 0.1) << shading << ' ' << scattering;
  };
  for (const MethodRow& shading : shading_models().rows()) expect_finite(shading.name, "volume");
  for (const MethodRow& scattering : scattering_models().rows()) expect_finite("marschner", scattering.name);
}

}  // namespace
}  // namespace strandcast::render_methods_test
