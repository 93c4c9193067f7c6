// What a renderer allocates and runs: exactly what its list says, and nothing for what the scene has not.

#include <epoxy/gl.h>

#include "common/render/renderer.h"
#include "tests/support/gl_fixture.h"

namespace strandcast::render_cost_test {
namespace {

using gl::ObjectCounts;
using gl::ObjectKind;
using gl::PassFate;
using testing::ElementsAre;

constexpr RenderSize kSize{64, 36};
constexpr uint64_t kPixels = 64 * 36;
constexpr uint64_t kSamples = kPixels * kSamplesPerSide * kSamplesPerSide;
constexpr uint64_t kHalfFloatRgbaBytes = 8;
constexpr uint64_t kDepthBytes = 4;
constexpr uint64_t kRgba8Bytes = 4;

SceneAsset strands_of(uint32_t strand_count, uint32_t vertex_count) {
  SceneAsset asset;
  asset.strand_count = strand_count;
  asset.vertex_count = vertex_count;
  for (uint32_t v = 0; v < vertex_count; ++v)
    for (uint32_t s = 0; s < strand_count; ++s)
      asset.rest_position_m.emplace_back(0.01f * static_cast<float>(s), -0.02f * static_cast<float>(v), 0.0f);
  return asset;
}

Mesh tetrahedron() {
  Mesh mesh;
  mesh.position_m = {
      {0.05f, 0.05f, 0.05f}, {-0.05f, -0.05f, 0.05f}, {-0.05f, 0.05f, -0.05f}, {0.05f, -0.05f, -0.05f}};
  for (const glm::vec3& point : mesh.position_m) mesh.normal.push_back(glm::normalize(point));
  mesh.triangle = {{0, 1, 3}, {0, 2, 1}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

LookDesc look_with(uint32_t followers) {
  LookDesc look;
  look.followers = followers;
  look.segments = 2;
  return look;
}

class RenderCostTest : public GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    before_ = gl::object_counts();
  }
  void TearDown() override { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); }

  std::unique_ptr<Renderer> drawn(const SceneAsset& asset, const LookDesc& look,
                                  const RenderPath& path = segment_path()) {
    auto renderer = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, look, path);
    if (!renderer) {
      ADD_FAILURE() << renderer.error().to_string();
      return nullptr;
    }
    const Status status = (*renderer)->draw({{}, asset.rest_position_m}, CameraDesc{}, kSize);
    EXPECT_TRUE(status) << status.error().to_string();
    return std::move(*renderer);
  }

  /// What there is more of than before this test: buffers, textures, framebuffers, programs, vertex arrays.
  std::vector<uint64_t> added() const {
    const ObjectCounts now = gl::object_counts();
    std::vector<uint64_t> more;
    for (const ObjectKind kind : {ObjectKind::Buffer, ObjectKind::Texture, ObjectKind::Framebuffer,
                                  ObjectKind::Program, ObjectKind::VertexArray})
      more.push_back(now.of(kind) - before_.of(kind));
    return more;
  }
  uint64_t added_bytes() const { return gl::object_counts().size_bytes - before_.size_bytes; }

  ObjectCounts before_;
};

TEST_F(RenderCostTest, AnEmptySceneHasTargetsAndOneProgramAndNothingElse) {
  {
    const auto renderer = drawn(SceneAsset{}, look_with(3));
    ASSERT_TRUE(renderer);
    // Scene colour, scene depth, picture; a framebuffer for the scene and one for the picture; resolve.
    EXPECT_THAT(added(), ElementsAre(0u, 3u, 2u, 1u, 1u));
    EXPECT_EQ(gl::object_counts().compiled_programs - before_.compiled_programs, 1u);
    EXPECT_EQ(added_bytes(), kSamples * (kHalfFloatRgbaBytes + kDepthBytes) + kPixels * kRgba8Bytes);
  }
  ObjectCounts after = gl::object_counts();
  after.compiled_programs = before_.compiled_programs;  // counts on
  EXPECT_EQ(after, before_) << "a renderer that is gone leaves nothing behind";
}

TEST_F(RenderCostTest, EachFactBringsItsOwnObjectsAndNoOthers) {
  SceneAsset asset = strands_of(5, 4);
  {
    // Besides the above: key and expanded strands and the quads' indices, the light volume, two programs.
    const auto bare = drawn(asset, look_with(0));
    EXPECT_THAT(added(), ElementsAre(3u, 4u, 2u, 3u, 3u));
  }
  asset.triangle = {{0, 1, 2}, {2, 3, 4}};
  {
    const auto unused = drawn(asset, look_with(0));
    EXPECT_THAT(added(), ElementsAre(3u, 4u, 2u, 3u, 3u)) << "no followers, no triangles on the GPU";
  }
  {
    const auto with_followers = drawn(asset, look_with(3));
    EXPECT_THAT(added(), ElementsAre(4u, 4u, 2u, 3u, 3u));
  }
  asset.head = tetrahedron();
  {
    // Positions, normals, cover and indices; one program.
    const auto with_head = drawn(asset, look_with(3));
    EXPECT_THAT(added(), ElementsAre(8u, 4u, 2u, 4u, 4u));
  }
}

// Tables and volumes of single methods are there for who names the method, and for nobody else.
TEST_F(RenderCostTest, AMethodBringsItsOwnTexturesAndNoOthers) {
  SceneAsset asset = strands_of(9, 5);
  struct Row {
    RenderMethodsDesc methods;
    uint64_t textures;
  };
  constexpr uint64_t kUsual = 4;  // as above
  for (const Row& row : {Row{{"sadeghi", "volume", "vertex"}, 0},
                         {{"kajiya_kay", "none", "fragment"}, 0},
                         {{"karis", "volume", "vertex"}, 0},
                         {{"chiang", "volume", "vertex"}, 0},
                         {{"marschner", "volume", "vertex"}, 2},
                         {{"sadeghi", "isosurface", "vertex"}, 1},
                         {{"sadeghi", "dual", "vertex"}, 1},
                         {{"marschner", "dual", "fragment"}, 3}}) {
    LookDesc look = look_with(2);
    look.methods = row.methods;
    const auto renderer = drawn(asset, look);
    ASSERT_TRUE(renderer);
    const std::string name = row.methods.shading + " " + row.methods.scattering;
    EXPECT_THAT(added(), ElementsAre(3u, kUsual + row.textures, 2u, 3u, 3u)) << name;
    EXPECT_EQ(added_bytes(), renderer->passes().live_bytes()) << name;
    EXPECT_EQ(renderer->passes().runs("render/lobe_tables"), row.methods.shading == "marschner") << name;
    EXPECT_EQ(renderer->passes().runs("render/scatter_tables"), row.methods.scattering == "dual") << name;
  }
}

TEST_F(RenderCostTest, TheListsBytesAreWhatOpenGlHolds) {
  SceneAsset asset = strands_of(9, 5);
  asset.triangle = {{0, 1, 2}, {2, 3, 4}, {5, 6, 7}};
  for (const bool has_head : {false, true})
    for (const uint32_t followers : {0u, 4u}) {
      if (has_head) asset.head = tetrahedron();
      for (const RenderPath* path : {&segment_path(), &tile_path()}) {
        const auto renderer = drawn(asset, look_with(followers), *path);
        ASSERT_TRUE(renderer);
        EXPECT_EQ(added_bytes(), renderer->passes().live_bytes())
            << path->name << ' ' << has_head << ' ' << followers;
      }
    }
}

TEST_F(RenderCostTest, WhatIsPrintedWithoutGlIsWhatRunsWithIt) {
  SceneAsset asset = strands_of(9, 5);
  for (const bool has_head : {true, false}) {
    asset.head = has_head ? tetrahedron() : Mesh{};
    const auto planned = plan_renderer(asset, look_with(2), true);
    ASSERT_TRUE(planned) << planned.error().to_string();
    const auto renderer = drawn(asset, look_with(2));
    ASSERT_TRUE(renderer);
    const gl::PassReports ran = renderer->passes().report();
    ASSERT_EQ(ran.size(), planned->size());
    for (size_t i = 0; i < ran.size(); ++i) {
      EXPECT_EQ(ran[i].name, (*planned)[i].name);
      EXPECT_EQ(ran[i].fate, (*planned)[i].fate) << ran[i].name;
      EXPECT_EQ(ran[i].reason, (*planned)[i].reason) << ran[i].name;
      EXPECT_EQ(ran[i].runs, ran[i].fate == PassFate::Kept ? 1u : 0u) << ran[i].name;
      const bool is_table = ran[i].name.ends_with("_tables");  // none for what is drawn by default
      EXPECT_EQ(is_table || (ran[i].name == "render/head" && !has_head), ran[i].fate != PassFate::Kept)
          << ran[i].name;
      EXPECT_EQ(is_table, ran[i].reason.starts_with("look.methods.")) << ran[i].name;
    }
  }
}

/// Every method beside the default ones of the other kinds.
std::vector<RenderMethods> all_methods() {
  std::vector<RenderMethods> all;
  for (size_t i = 0; i < shadow_methods().rows().size(); ++i)
    all.push_back({static_cast<ShadowMethod>(i), {}, {}});
  for (size_t i = 1; i < transparency_methods().rows().size(); ++i)
    all.push_back({{}, static_cast<TransparencyMethod>(i), {}});
  for (size_t i = 1; i < antialiasing_methods().rows().size(); ++i)
    all.push_back({{}, {}, static_cast<AntialiasingMethod>(i)});
  return all;
}

std::string name_of(const RenderMethods& methods) {
  return fmt::format("{}, {}, {}", shadow_methods().rows()[static_cast<size_t>(methods.shadow)].name,
                     transparency_methods().rows()[static_cast<size_t>(methods.transparency)].name,
                     antialiasing_methods().rows()[static_cast<size_t>(methods.antialiasing)].name);
}

TEST_F(RenderCostTest, TheListsBytesAreWhatOpenGlHoldsWithEveryMethod) {
  SceneAsset asset = strands_of(9, 5);
  asset.triangle = {{0, 1, 2}, {2, 3, 4}, {5, 6, 7}};
  asset.head = tetrahedron();
  for (const RenderMethods& methods : all_methods()) {
    const auto renderer = drawn(asset, look_with(4), segment_path_with(methods));
    ASSERT_TRUE(renderer);
    EXPECT_EQ(added_bytes(), renderer->passes().live_bytes()) << name_of(methods);
    const auto planned = plan_renderer(asset, look_with(4), true, segment_path_with(methods));
    ASSERT_TRUE(planned) << planned.error().to_string();
    const gl::PassReports ran = renderer->passes().report();
    ASSERT_EQ(ran.size(), planned->size()) << name_of(methods);
    for (size_t i = 0; i < ran.size(); ++i) EXPECT_EQ(ran[i].name, (*planned)[i].name);
  }
}

TEST_F(RenderCostTest, AMethodThatIsNotChosenCostsNothing) {
  SceneAsset asset = strands_of(9, 5);
  // Objects, bytes and programs with the default methods: as before there were others.
  const auto plain = drawn(asset, look_with(0));
  EXPECT_THAT(added(), ElementsAre(3u, 4u, 2u, 3u, 3u));
  EXPECT_EQ(gl::object_counts().compiled_programs - before_.compiled_programs, 3u);
  const uint64_t plain_bytes = added_bytes();
  std::vector<std::string> plain_passes;
  for (const gl::PassReport& pass : plain->passes().report()) plain_passes.push_back(pass.name);
  EXPECT_THAT(plain_passes, ElementsAre("render/lobe_tables", "render/scatter_tables", "render/upload",
                                        "render/light", "render/clear", "render/head", "render/expand",
                                        "render/strands", "render/resolve"));
  // The methods that draw less than the default hold less.
  const ObjectCounts before = gl::object_counts();
  const auto bare = drawn(asset, look_with(0), segment_path_with({ShadowMethod::None, {}, {}}));
  EXPECT_EQ(gl::object_counts().of(ObjectKind::Texture) - before.of(ObjectKind::Texture), 3u)
      << "no light volume";
  EXPECT_LT(gl::object_counts().size_bytes - before.size_bytes, plain_bytes);
}

TEST_F(RenderCostTest, MethodsThatDoNotGoTogetherAreRefused) {
  const auto path =
      segment_path_with({ShadowMethod::Volume, TransparencyMethod::Moments, AntialiasingMethod::Msaa4});
  const auto renderer =
      Renderer::make(gl::ShaderLibrary(), context_->info(), strands_of(9, 5), look_with(2), path);
  ASSERT_FALSE(renderer);
  EXPECT_EQ(renderer.error().code, ErrorCode::BadInput);
}

TEST_F(RenderCostTest, NothingIsAllocatedOfAMethodWhereThereAreNoStrands) {
  for (const RenderMethods& methods : all_methods()) {
    if (methods.antialiasing != AntialiasingMethod::Analytic) continue;  // has targets of its own
    const auto renderer = drawn(SceneAsset{}, look_with(3), segment_path_with(methods));
    ASSERT_TRUE(renderer);
    EXPECT_THAT(added(), ElementsAre(0u, 3u, 2u, 1u, 1u)) << name_of(methods);
  }
}

/// Another way to draw, as a new renderer would be: its own pass, the shared picture.
class FillPass final : public RenderPass {
 public:
  explicit FillPass(RenderScene& scene)
      : Pass({"toy/fill", {}, {&scene.picture}, true, {}}), picture_(scene.picture) {}
  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(picture_.resize(turn.size_px));
    picture_.begin();
    glClearColor(0.0f, 1.0f, 0.0f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT);
    return {};
  }

 private:
  PictureTarget& picture_;
};

TEST_F(RenderCostTest, AnotherPathDrawsBehindTheSameRendererAndPaysForNothingOfTheFirst) {
  const RenderPath path{
      "toy", "one colour",
      [](RenderScene& scene, RenderPassList& passes) { passes.add(std::make_unique<FillPass>(scene)); },
      kSamplesPerSide};
  const auto renderer = drawn(strands_of(5, 4), look_with(2), path);
  ASSERT_TRUE(renderer);
  EXPECT_THAT(added(), ElementsAre(0u, 1u, 1u, 0u, 0u));
  const Image image = renderer->read_image();
  ASSERT_EQ(image.rgba.size(), kPixels * kRgba8Bytes);
  for (size_t i = 0; i < image.rgba.size(); i += kRgba8Bytes) {
    ASSERT_EQ(image.rgba[i], 0);
    ASSERT_EQ(image.rgba[i + 1], 255);
  }
  ASSERT_EQ(renderer->passes().report().size(), 1u);
  EXPECT_EQ(renderer->passes().report()[0].name, "toy/fill");
}

}  // namespace
}  // namespace strandcast::render_cost_test
