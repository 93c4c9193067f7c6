// Every method of self-shadowing over lines of known optical depth: what shaders/render/light.glsl says at
// points of a slab, against the law of Beer and Lambert and against one another.

#include "common/render/shadow/shadow_method.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>

#include "tests/support/gl_fixture.h"
#include "tests/support/line_scene.h"
#include "tests/support/temporary_folder.h"

namespace strandcast {

std::unique_ptr<RenderPass> make_light_pass(RenderScene& scene);

}  // namespace strandcast

namespace strandcast::shadow_test {
namespace {

using test::Line;

constexpr ShadowMethod kMapped[] = {ShadowMethod::DeepOpacity, ShadowMethod::OpacityMaps,
                                    ShadowMethod::DensityRays, ShadowMethod::DeepShadow,
                                    ShadowMethod::Hybrid};

std::string name_of(ShadowMethod method) {
  return std::string(shadow_methods().rows()[static_cast<size_t>(method)].name);
}

/// Lines, of which `asset` has the key strands. The light comes from +z.
struct Strands {
  std::vector<Line> lines;
  SceneAsset asset;
  float width_m = 1e-3f;
  float strand_opacity = 0.3f;
  uint32_t shadow_texels = 512;
  uint32_t batch_count = 1;
};

class ShadowTest : public GlTest {
 protected:
  void TearDown() override { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); }

  /// Part of the direct light at each point.
  std::vector<float> light_at(const Strands& strands, ShadowMethod method,
                              const std::vector<glm::vec3>& points) {
    LookDesc look;
    look.tip_scale = 1.0f;
    look.strand_radius_m = 0.5f * strands.width_m;
    look.light_direction = {0.0f, 0.0f, -1.0f};
    RenderScene scene(strands.asset, look, true);
    scene.methods.shadow = method;
    scene.method_settings.strand_opacity = strands.strand_opacity;
    scene.method_settings.shadow_texels = strands.shadow_texels;
    RenderPassList passes;
    auto& expanded = passes.keep(std::make_unique<ExpandedStrands>(kSegmentBytes * strands.lines.size()));
    ExpandWalks walks(std::make_unique<test::LinesPass>(scene, expanded, strands.lines, strands.batch_count,
                                                        strands.width_m),
                      expanded);
    add_shadow_passes(scene, walks, passes);
    std::vector<float> light(points.size());
    const auto run = [&]() -> Status {
      RETURN_IF_ERROR(passes.plan({&scene.strands}, {&scene.light}));
      RETURN_IF_ERROR(passes.prepare({gl::ShaderLibrary(), strands.asset}));
      ASSIGN_OR_RETURN(const View view, make_view(CameraDesc{}, {1.0, 0.0, 0.0, 0.0}, glm::uvec2(64)));
      const PosedStrands posed{{}, strands.asset.rest_position_m};
      const DrawTerms terms;
      RenderTurn turn(posed, view, glm::uvec2(32), terms);
      gl::GpuTimer timer(context_->info());
      RETURN_IF_ERROR(passes.run(turn, &timer));
      return probe(scene, points, light);
    };
    const Status status = run();
    EXPECT_TRUE(status) << name_of(method) << ": " << status.error().to_string();
    return light;
  }

 private:
  Status probe(const RenderScene& scene, const std::vector<glm::vec3>& points, std::vector<float>& light) {
    const auto shaders = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "shaders";
    std::filesystem::copy(
        shaders, folder_.path(),
        std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
    folder_.write("probe.comp",
                  "#include \"render/light.glsl\"\n"
                  "layout(local_size_x = 32) in;\n"
                  "layout(std430, binding = 0) readonly buffer In { vec4 v[]; } inputs;\n"
                  "layout(std430, binding = 1) buffer Out { vec4 v[]; } outputs;\n"
                  "void main() {\n"
                  "  uint i = gl_GlobalInvocationID.x;\n"
                  "  outputs.v[i] = vec4(light_at(inputs.v[i].xyz), 0.0, 0.0);\n"
                  "}\n");
    ASSIGN_OR_RETURN(const gl::Program program,
                     gl::Program::make(gl::ShaderLibrary(folder_.path()), {"probe.comp"},
                                       {{"SHADOW", static_cast<int>(scene.methods.shadow)}}));
    std::vector<glm::vec4> padded((points.size() + 31) / 32 * 32);
    for (size_t i = 0; i < points.size(); ++i) padded[i] = glm::vec4(points[i], 0.0f);
    const gl::Buffer inputs = gl::Buffer::of("in", padded);
    const gl::Buffer outputs("out", padded.size() * sizeof(glm::vec4));
    scene.light.set_uniforms(program, 0);
    if (scene.shadow != nullptr) scene.shadow->set_uniforms(program, kFirstShadowUnit);
    program.use();
    inputs.bind_storage(0);
    outputs.bind_storage(1);
    glDispatchCompute(static_cast<GLuint>(padded.size() / 32), 1, 1);
    const auto values = outputs.read_all<glm::vec4>();
    for (size_t i = 0; i < points.size(); ++i) light[i] = values[i].x;
    return {};
  }

  TemporaryFolder folder_;
};

constexpr float kSlabM = 0.1f;

/// 320 sheets across the light, of lines side by side. The light's map is a little deeper than the slab, by
/// margins that put the slab's face into the middle of the first of 16 slices; all of the map's depth would
/// be of optical depth 8.
Strands sheets() {
  constexpr int kSheets = 320, kColumns = 17;
  constexpr float kMapM = kSlabM + 2.0f * (0.02f * kSlabM + 1e-3f);
  Strands strands;
  strands.shadow_texels = 64;
  strands.width_m = 0.002f;
  strands.strand_opacity = 8.0f / kMapM * kSlabM / kSheets;
  for (int sheet = 0; sheet < kSheets; ++sheet)
    for (int column = 0; column < kColumns; ++column) {
      const float x = strands.width_m * static_cast<float>(column - kColumns / 2);
      const float z = -kSlabM * static_cast<float>(sheet) / (kSheets - 1);
      strands.lines.push_back({{x, -0.02f, z}, {x, 0.02f, z}, 0.0f});
    }
  strands.asset = test::asset_around(strands.lines);
  return strands;
}

/// Greatest difference to exp(-depth) through the slab.
double slab_error(const std::vector<float>& light, float depth_per_m, const std::vector<glm::vec3>& points) {
  double error = 0.0;
  for (size_t i = 0; i < points.size(); ++i)
    error = std::max(error, std::abs(light[i] - std::exp(static_cast<double>(points[i].z) * depth_per_m)));
  return error;
}

TEST_F(ShadowTest, ASlabLetsThroughWhatIsPublished) {
  const Strands strands = sheets();
  const float depth_per_m = 320 * strands.strand_opacity / kSlabM;
  std::vector<glm::vec3> points;
  for (int i = 0; i <= 400; ++i)
    points.emplace_back(0.001f, 0.002f, -kSlabM * static_cast<float>(i) / 400.0f);
  std::map<ShadowMethod, double> error;
  for (const ShadowMethod method : kMapped)
    error[method] = slab_error(light_at(strands, method, points), depth_per_m, points);
  for (const auto& [method, worst] : error) fmt::print("{}: {:.4f}\n", name_of(method), worst);
  // A sheet takes 2.4 %: no method that is right can be nearer than half of that at the first.
  EXPECT_LE(error[ShadowMethod::DeepShadow], 0.025);
  EXPECT_LE(error[ShadowMethod::DeepOpacity], 0.018);
  EXPECT_LE(error[ShadowMethod::Hybrid], 0.018);
  // A face in the middle of its slice: 1 - exp(-8 / 16 / 4).
  EXPECT_NEAR(error[ShadowMethod::OpacityMaps], 0.117, 0.006);
  EXPECT_LE(error[ShadowMethod::DensityRays], 0.05);
  EXPECT_LT(error[ShadowMethod::DeepOpacity], 0.25 * error[ShadowMethod::OpacityMaps]);
}

/// A slab that knows no direction but the light's: strands at the angle whose sine is the mean of all
/// angles', pi / 4, in ribbons side by side, each begun at random. 26.7 of them on every ray, 8 in optical
/// depth.
Strands slanted() {
  constexpr float kDepthM = 0.04f, kSpread = 1.2690f;  // tangent of the angle
  constexpr int kVertices = 9, kColumns = 32;
  constexpr float kGapM = kSpread * kDepthM * 0.3f / 8.0f;
  Strands strands;
  strands.width_m = 0.00125f;
  strands.shadow_texels = 32;  // four columns wide each, so that no single strand matters
  std::mt19937 random(17);
  std::uniform_real_distribution<float> phase(0.0f, kGapM);
  std::vector<glm::vec3> roots;
  for (int column = 0; column < kColumns; ++column) {
    const float x = strands.width_m * (static_cast<float>(column) - 0.5f * (kColumns - 1));
    for (float y = -0.075f + phase(random); y < 0.025f; y += kGapM) roots.emplace_back(x, y, 0.0f);
  }
  strands.asset.strand_count = static_cast<uint32_t>(roots.size());
  strands.asset.vertex_count = kVertices;
  for (int v = 0; v < kVertices; ++v) {
    const float z = -kDepthM * static_cast<float>(v) / (kVertices - 1);
    for (const glm::vec3& root : roots)
      strands.asset.rest_position_m.push_back(root + glm::vec3(0, -kSpread * z, z));
  }
  for (size_t s = 0; s < roots.size(); ++s)
    for (int v = 0; v + 1 < kVertices; ++v)
      strands.lines.push_back({strands.asset.rest_position_m[v * roots.size() + s],
                               strands.asset.rest_position_m[(v + 1) * roots.size() + s], 0.0f});
  return strands;
}

TEST_F(ShadowTest, AllMethodsAgreeInTheSameSlab) {
  const Strands strands = slanted();
  // The light volume's cells are 4.6 mm: it cannot know of the face of the slab, so that the first cell is
  // left out.
  std::vector<glm::vec3> points;
  constexpr int kDepths = 15, kRays = 64;
  for (int depth = 0; depth < kDepths; ++depth)
    for (int ray = 0; ray < kRays; ++ray)
      points.emplace_back(0.005f * (static_cast<float>(ray % 8) - 3.5f),
                          0.002f * (static_cast<float>(ray / 8) - 3.5f),
                          -0.005f - 0.002f * static_cast<float>(depth));
  std::map<ShadowMethod, std::vector<double>> mean;
  for (const ShadowMethod method :
       {ShadowMethod::Volume, ShadowMethod::DeepOpacity, ShadowMethod::OpacityMaps, ShadowMethod::DensityRays,
        ShadowMethod::DeepShadow, ShadowMethod::Hybrid}) {
    const std::vector<float> light = light_at(strands, method, points);
    for (int depth = 0; depth < kDepths; ++depth) {
      double sum = 0.0;
      for (int ray = 0; ray < kRays; ++ray) sum += light[depth * kRays + ray];
      mean[method].push_back(sum / kRays);
    }
  }
  for (int depth = 0; depth < kDepths; ++depth) {
    const double expected = std::exp(-200.0 * (0.005 + 0.002 * depth));
    double least = expected, most = expected;
    for (const auto& [method, means] : mean) {
      // Cells of the light volume are wide; a layer of the deep opacity map begins at a strand, not at the
      // face.
      const double tolerance =
          method == ShadowMethod::Volume ? 0.05 : (method == ShadowMethod::DeepOpacity ? 0.04 : 0.025);
      EXPECT_NEAR(means[depth], expected, tolerance) << name_of(method) << ' ' << depth;
      least = std::min(least, means[depth]);
      most = std::max(most, means[depth]);
    }
    EXPECT_LE(most - least, 0.05) << depth;
  }
}

/// A thousand strands a millimetre wide at random places, a hundred on every way across ten bands of 0.1 m.
Strands scattered() {
  Strands strands;
  std::mt19937 random(23);
  std::uniform_real_distribution<float> place(-0.05f, 0.05f), depth(-0.02f, 0.0f);
  for (int band = 0; band < 10; ++band)
    for (int i = 0; i < 100; ++i) {
      const float x = place(random), y = 0.01f * static_cast<float>(band - 5), z = depth(random);
      strands.lines.push_back({{x, y, z}, {x, y + 0.01f, z}, 0.0f});
    }
  strands.asset = test::asset_around(strands.lines);
  return strands;
}

double mean_behind(const std::vector<float>& light) {
  double sum = 0.0;
  for (const float value : light) sum += value;
  return sum / static_cast<double>(light.size());
}

TEST_F(ShadowTest, RandomStrandsLetThroughWhatChanceSays) {
  std::vector<glm::vec3> behind;
  for (int band = 0; band < 10; ++band)
    for (int i = 0; i < 200; ++i)
      behind.emplace_back(-0.045f + 0.09f * static_cast<float>(i) / 199.0f,
                          0.01f * static_cast<float>(band - 5) + 0.005f, -0.03f);
  for (const ShadowMethod method : kMapped) {
    Strands strands = scattered();
    // Strands of opacity 0.3 that a texel can tell apart: exp(-0.3). A ray knows no strands, only their mean
    // density.
    strands.strand_opacity = -std::log(1.0f - 0.3f);
    const double translucent = mean_behind(light_at(strands, method, behind));
    // Opaque ones that no texel can tell apart, at one optical depth per strand crossed: 1 / e.
    strands.strand_opacity = 1.0f;
    strands.shadow_texels = 16;
    const double opaque = mean_behind(light_at(strands, method, behind));
    fmt::print("{}: {:.3f} {:.3f}\n", name_of(method), translucent, opaque);
    if (method == ShadowMethod::DensityRays) {
      EXPECT_NEAR(translucent, 0.7, 0.02) << "a mean of strands takes 1 - 0.7 in all";
      continue;
    }
    EXPECT_NEAR(translucent, std::exp(-0.3), 0.02) << name_of(method);
    EXPECT_NEAR(opaque, std::exp(-1.0), 0.03) << name_of(method);
  }
}

TEST_F(ShadowTest, StrandsInSeveralBatchesShadowAsThoseInOne) {
  Strands strands = scattered();
  std::vector<glm::vec3> points;
  for (int i = 0; i < 64; ++i) points.emplace_back(-0.05f + 0.0015f * static_cast<float>(i), 0.003f, -0.01f);
  for (const ShadowMethod method : kMapped) {
    strands.batch_count = 1;
    const auto whole = light_at(strands, method, points);
    strands.batch_count = 3;
    EXPECT_EQ(light_at(strands, method, points), whole) << name_of(method);
  }
}

TEST_F(ShadowTest, NoInputGivesLightThatIsNotANumber) {
  const float nan = std::nanf("");
  Strands strands;
  strands.lines = {{{nan, 0, 0}, {0, 0, 0}, 0},
                   {{0, 0, 0}, {0, 0, 0}, 0},
                   {{0, 0, 0.02f}, {0, 0, -0.02f}, 0},
                   {{1e30f, 0, 0}, {0, 0, 0}, 0},
                   {{-0.01f, 0, 0}, {0.01f, 0, 0}, 0}};
  strands.asset = test::asset_around({strands.lines.back()});
  const std::vector<glm::vec3> points{{0, 0, 0.01f}, {0, 0, -0.01f}, {0, 0, -1}, {5, 5, 5}, {-1e9f, 0, 0}};
  for (const ShadowMethod method : kMapped) {
    const auto light = light_at(strands, method, points);
    for (size_t i = 0; i < light.size(); ++i) {
      EXPECT_GE(light[i], 0.0f) << name_of(method) << ' ' << i;
      EXPECT_LE(light[i], 1.0f) << name_of(method) << ' ' << i;
    }
    EXPECT_EQ(light[0], 1.0f) << name_of(method) << ": in front of all";
    // No strand at all, and no key strand that is a number.
    Strands none;
    none.lines = {{{nan, nan, nan}, {nan, nan, nan}, 0}};
    none.asset = test::asset_around({});
    none.asset.rest_position_m = {glm::vec3(nan), glm::vec3(nan)};
    for (const float value : light_at(none, method, points)) EXPECT_EQ(value, 1.0f) << name_of(method);
  }
}

}  // namespace
}  // namespace strandcast::shadow_test
