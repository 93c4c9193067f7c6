// Methods of curves, joints, level of detail and culling: what each of them leaves as it is, and what it
// changes. The strands are few and known, or grown and small.
#include "common/scene/strand_methods.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/groom/groom_asset.h"
#include "common/groom/mesh.h"
#include "common/groom/procedural.h"
#include "common/render/detail/bend_expander.h"
#include "common/render/detail/culling.h"
#include "common/render/detail/far_volume.h"
#include "common/render/passes/expand_pass.h"
#include "common/render/renderer.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/look_variants.h"
#include "tests/support/sample_look.h"
#include "tests/support/strand_reference.h"

namespace strandcast::strand_methods_test {
namespace {

using reference::Keys;

constexpr RenderSize kSize{160, 120};
constexpr float kHeadRadiusM = 0.095f;

CameraDesc camera_at(const glm::vec3& offset_m, float fov_y_rad = 0.5f) {
  CameraDesc camera;
  camera.offset_m = offset_m;
  camera.target_m = {0.0f, 0.0f, 0.0f};
  camera.fov_y_rad = fov_y_rad;
  return camera;
}

class StrandMethods : public GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    framebuffer_ = gl::Framebuffer::without_attachments("strand methods test");
    framebuffer_.bind();
  }
  void TearDown() override { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); }

  static SceneAsset grown() {
    ProceduralGroomOptions options;
    options.strand_count = 300;
    options.vertex_count = 10;
    options.length_m = 0.2f;
    auto groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), kHeadRadiusM, 1000), options);
    if (!groom) {
      ADD_FAILURE() << groom.error().to_string();
      return {};
    }
    return make_scene_asset(*groom, make_head(kHeadRadiusM));
  }
  static LookDesc look_with(const RenderMethodsDesc& methods) {
    LookDesc look;
    look.methods = methods;
    look.strand_radius_m = 0.0004f;
    return look;
  }
  Image draw(const SceneAsset& asset, const LookDesc& look, const CameraDesc& camera,
             RenderSize size = kSize) {
    auto renderer = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, look, segment_path());
    if (!renderer) {
      ADD_FAILURE() << renderer.error().to_string();
      return {};
    }
    const Status status = (*renderer)->draw({{}, asset.rest_position_m}, camera, size);
    EXPECT_TRUE(status) << status.error().to_string();
    return (*renderer)->read_image();
  }

  gl::Framebuffer framebuffer_;
};

// ---- Curves

Keys bent_keys(uint32_t strand_count, uint32_t vertex_count) {
  Keys keys{strand_count, vertex_count, {}};
  keys.position_m.resize(size_t{strand_count} * vertex_count);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> jitter(-0.006f, 0.006f);
  for (uint32_t v = 0; v < vertex_count; ++v)
    for (uint32_t s = 0; s < strand_count; ++s)
      keys.position_m[size_t{v} * strand_count + s] =
          glm::vec3(0.01f * static_cast<float>(s), -0.02f * static_cast<float>(v), 0.0f) +
          glm::vec3(jitter(random), jitter(random), jitter(random));
  return keys;
}

SceneAsset asset_of(const Keys& keys) {
  SceneAsset asset;
  asset.strand_count = keys.strand_count;
  asset.vertex_count = keys.vertex_count;
  asset.rest_position_m = keys.position_m;
  return asset;
}

std::vector<ExpandedVertex> read_segments(const ExpandedStrands& expanded, uint32_t segments) {
  std::vector<ExpandedVertex> vertices(2 * size_t{segments});
  expanded.vertex().read(0, std::as_writable_bytes(std::span(vertices)));
  return vertices;
}

/// All points of key strands, expanded with one kind of curve.
std::vector<ExpandedVertex> expand(const Keys& keys, CurveMethod curve, uint32_t segments) {
  KeyStrands strands(keys.strand_count, keys.vertex_count);
  ExpandedStrands expanded(ExpandSizes(strands, 0, 0).buffer_bytes(segments));
  auto expander = StrandExpander::make(gl::ShaderLibrary(), asset_of(keys), {}, curve);
  if (!expander) {
    ADD_FAILURE() << expander.error().to_string();
    return {};
  }
  strands.allocate();
  strands.position().write(keys.position_m);
  expanded.allocate();
  return read_segments(expanded, expander->run(strands, expanded, 0, keys.strand_count, {segments, 0}));
}

/// A point of the Bezier curve of a gap by de Casteljau's construction, in double.
glm::dvec3 bezier_point(const Keys& keys, uint32_t strand, uint32_t gap, double t) {
  const auto vertex = [&](uint32_t v) {
    return glm::dvec3(keys.position_m[size_t{v} * keys.strand_count + strand]);
  };
  const uint32_t last = keys.vertex_count - 1;
  const glm::dvec3 a = vertex(gap), d = vertex(gap + 1);
  const double handle_m = glm::distance(a, d) / 3.0;
  glm::dvec3 p[4] = {a, a + handle_m * glm::normalize(d - vertex(gap > 0 ? gap - 1 : gap)),
                     d - handle_m * glm::normalize(vertex(gap + 1 < last ? gap + 2 : last) - a), d};
  for (int level = 3; level > 0; --level)
    for (int i = 0; i < level; ++i) p[i] = glm::mix(p[i], p[i + 1], t);
  return p[0];
}

TEST_F(StrandMethods, BezierCurvesArePointsOfDeCasteljausConstruction) {
  const Keys keys = bent_keys(9, 6);
  constexpr uint32_t kSegments = 4;
  const auto points = expand(keys, CurveMethod::Bezier, kSegments);
  ASSERT_EQ(points.size(), 2u * 9u * 5u * kSegments);
  for (const ExpandedVertex& point : points) {
    const double x = static_cast<double>(point.along) * (keys.vertex_count - 1);
    const auto gap = std::min(static_cast<uint32_t>(x + 1e-4), keys.vertex_count - 2);
    EXPECT_LT(glm::distance(glm::dvec3(point.position_m), bezier_point(keys, point.strand, gap, x - gap)),
              1e-6);
  }
}

TEST_F(StrandMethods, BezierCurvesPassThroughTheVerticesBitForBit) {
  const Keys keys = bent_keys(9, 6);
  const auto points = expand(keys, CurveMethod::Bezier, 1);
  ASSERT_EQ(points.size(), 2u * 9u * 5u);
  for (const ExpandedVertex& point : points) {
    const auto vertex = static_cast<size_t>(std::lround(point.along * 5.0f));
    EXPECT_EQ(point.position_m, keys.position_m[vertex * keys.strand_count + point.strand]);
  }
}

TEST_F(StrandMethods, CurvesOfBothKindsAreTheSameLineWhereStrandsAreStraightAndEven) {
  Keys keys{3, 5, {}};
  for (uint32_t v = 0; v < 5; ++v)
    for (uint32_t s = 0; s < 3; ++s)
      keys.position_m.emplace_back(0.03f * static_cast<float>(s), -0.02f * static_cast<float>(v), 0.0f);
  const auto bezier = expand(keys, CurveMethod::Bezier, 3);
  const auto hermite = expand(keys, CurveMethod::Hermite, 3);
  ASSERT_EQ(bezier.size(), hermite.size());
  for (size_t i = 0; i < bezier.size(); ++i)
    EXPECT_LT(glm::distance(bezier[i].position_m, hermite[i].position_m), 1e-7f);
}

TEST_F(StrandMethods, VerticesInOnePlaceGiveNumbers) {
  Keys keys = bent_keys(2, 4);
  for (uint32_t v = 1; v < 4; ++v)
    for (uint32_t s = 0; s < 2; ++s) keys.position_m[size_t{v} * 2 + s] = keys.position_m[s];
  for (const ExpandedVertex& point : expand(keys, CurveMethod::Bezier, 3)) {
    EXPECT_LT(glm::distance(point.position_m, keys.position_m[point.strand]), 1e-7f);
    EXPECT_NEAR(glm::length(point.tangent), 1.0f, 1e-6f);
  }
}

// ---- Joints

/// One strand with a corner in the middle of the picture, 24 pixels wide.
SceneAsset corner() {
  SceneAsset asset;
  asset.strand_count = 1;
  asset.vertex_count = 3;
  asset.rest_position_m = {{-0.1f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, -0.1f, 0.0f}};
  return asset;
}

LookDesc black_strand(const std::string& joints) {
  LookDesc look;
  look.methods.joints = joints;
  look.segments = 1;
  look.strand_radius_m = 0.01f;
  look.tip_scale = 1.0f;
  look.light_color = look.rim_color = glm::vec3(0.0f);
  look.ambient = 0.0f;
  look.background = glm::vec3(0.5f);
  return look;
}

/// Pixels whose middle is less than `share` of the half width from the strand's line, and which it does not
/// cover: cracks.
int uncovered(const Image& image, float px_per_m, float share) {
  int count = 0;
  for (uint32_t y = 0; y < image.height; ++y)
    for (uint32_t x = 0; x < image.width; ++x) {
      const glm::vec2 at((static_cast<float>(x) + 0.5f - 0.5f * static_cast<float>(image.width)) / px_per_m,
                         (0.5f * static_cast<float>(image.height) - static_cast<float>(y) - 0.5f) / px_per_m);
      const float to_first = glm::distance(at, glm::vec2(std::clamp(at.x, -0.1f, 0.0f), 0.0f));
      const float to_second = glm::distance(at, glm::vec2(0.0f, std::clamp(at.y, -0.1f, 0.0f)));
      // Around the corner: strands have no caps.
      if (std::min(to_first, to_second) > share * 0.01f || glm::length(at) > 0.05f) continue;
      if (image.rgba[4 * (size_t{y} * image.width + x)] > 20) ++count;
    }
  return count;
}

TEST_F(StrandMethods, SplitJointsLeaveACrackAtACornerAndMendedOnesNone) {
  constexpr float kFov = 0.2f;
  const float px_per_m = 0.5f * kSize.height / std::tan(0.5f * kFov);
  const CameraDesc camera = camera_at({0.0f, 0.0f, 1.0f}, kFov);
  // Within half of the half width: a mitre at a right angle is narrower by the root of two, and fades out.
  EXPECT_EQ(uncovered(draw(corner(), black_strand("mended"), camera), px_per_m, 0.5f), 0);
  EXPECT_GT(uncovered(draw(corner(), black_strand("split"), camera), px_per_m, 0.5f), 3);
}

TEST_F(StrandMethods, JointsOfAStraightStrandAreTheSameEitherWay) {
  SceneAsset asset = corner();
  asset.rest_position_m[2] = {0.1f, 0.0f, 0.0f};
  const CameraDesc camera = camera_at({0.0f, 0.0f, 1.0f}, 0.2f);
  const Image mended = draw(asset, black_strand("mended"), camera);
  const Image split = draw(asset, black_strand("split"), camera);
  int different = 0;
  for (size_t i = 0; i < mended.rgba.size(); ++i) different += std::abs(mended.rgba[i] - split.rgba[i]) > 2;
  EXPECT_EQ(different, 0);
}

// ---- Bends

TEST_F(StrandMethods, ChordsStayWithinAQuarterOfAPixelOfTheCurve) {
  const Keys keys = bent_keys(40, 8);
  constexpr uint32_t kMost = 8;
  KeyStrands strands(keys.strand_count, keys.vertex_count);
  ExpandedStrands expanded(ExpandSizes(strands, 0, 0).buffer_bytes(kMost));
  auto expander =
      BendExpander::make(gl::ShaderLibrary(), StrandCurves(asset_of(keys), {}, CurveMethod::Hermite),
                         expanded.size_bytes() / kSegmentBytes);
  ASSERT_TRUE(expander) << expander.error().to_string();
  strands.allocate();
  strands.position().write(keys.position_m);
  expanded.allocate();
  uint32_t before = keys.strand_count * (keys.vertex_count - 1) * kMost + 1;
  for (const float distance_m : {0.8f, 3.0f, 100.0f}) {
    const auto view = make_view(camera_at({0.0f, 0.0f, distance_m}), {1.0, 0.0, 0.0, 0.0}, {1280, 960});
    ASSERT_TRUE(view);
    const uint32_t count = expander->run(strands, expanded, 0, keys.strand_count, {kMost, 0}, *view);
    EXPECT_LT(count, before) << "fewer from further away";
    before = count;
    const auto points = read_segments(expanded, count);
    const double px_per_m = 0.5 * view->focal_px / distance_m;
    for (size_t i = 0; i + 1 < points.size(); i += 2) {
      ASSERT_EQ(points[i].strand, points[i + 1].strand);
      const double from = points[i].along * 7.0, to = points[i + 1].along * 7.0;
      const auto gap = std::min(static_cast<uint32_t>(0.5 * (from + to)), keys.vertex_count - 2);
      const auto on_curve = [&](double share) {
        return reference::curve_point(keys, points[i].strand, gap, from + share * (to - from) - gap)
            .position_m;
      };
      EXPECT_LT(glm::distance(on_curve(0.0), glm::dvec3(points[i].position_m)), 1e-6);
      if (to - from < 1.0 / kMost + 1e-3) continue;  // as fine as it gets
      for (const double share : {0.25, 0.5, 0.75}) {
        const glm::dvec3 chord =
            glm::mix(glm::dvec3(points[i].position_m), glm::dvec3(points[i + 1].position_m), share);
        EXPECT_LE(px_per_m * glm::distance(chord, on_curve(share)), 0.26);
      }
    }
  }
  EXPECT_EQ(before, keys.strand_count * (keys.vertex_count - 1)) << "one per gap where nothing is seen";
}

TEST_F(StrandMethods, SegmentsByNeedFollowOneAnotherWithoutGaps) {
  const Keys keys = bent_keys(5, 6);
  KeyStrands strands(5, 6);
  ExpandedStrands expanded(ExpandSizes(strands, 0, 0).buffer_bytes(8));
  auto expander =
      BendExpander::make(gl::ShaderLibrary(), StrandCurves(asset_of(keys), {}, CurveMethod::Hermite),
                         expanded.size_bytes() / kSegmentBytes);
  ASSERT_TRUE(expander) << expander.error().to_string();
  strands.allocate();
  strands.position().write(keys.position_m);
  expanded.allocate();
  const auto view = make_view(camera_at({0.0f, 0.0f, 0.8f}), {1.0, 0.0, 0.0, 0.0}, {640, 480});
  ASSERT_TRUE(view);
  const auto points = read_segments(expanded, expander->run(strands, expanded, 0, 5, {8, 0}, *view));
  for (size_t i = 2; i < points.size(); i += 2) {
    const bool is_new = points[i].strand != points[i - 1].strand;
    EXPECT_EQ(points[i].along, is_new ? 0.0f : points[i - 1].along);
    if (is_new) {
      EXPECT_EQ(points[i - 1].along, 1.0f);
    } else {
      EXPECT_EQ(points[i].position_m, points[i - 1].position_m);
    }
  }
}

// ---- Culling

constexpr const char* kTransparencies[] = {"hashed", "lists", "three_depths", "weighted", "moments"};

TEST_F(StrandMethods, CulledPicturesAreTheSameBitForBit) {
  const SceneAsset asset = grown();
  for (const glm::vec3& offset_m : {glm::vec3(0.2f, 0.1f, 0.6f), glm::vec3(0.0f, 0.02f, 0.2f)})
    for (const char* transparency : kTransparencies) {
      RenderMethodsDesc methods;
      methods.transparency = transparency;
      const Image all = draw(asset, look_with(methods), camera_at(offset_m));
      for (const char* culling : {"frustum", "occlusion"}) {
        methods.culling = culling;
        EXPECT_EQ(draw(asset, look_with(methods), camera_at(offset_m)), all)
            << transparency << ' ' << culling;
      }
    }
}

TEST_F(StrandMethods, CulledSamplesByDensityAreTheSameBitForBit) {
  const SceneAsset asset = grown();
  for (const char* antialiasing : {"msaa4", "density_samples"}) {
    RenderMethodsDesc methods;
    methods.antialiasing = antialiasing;
    const Image all = draw(asset, look_with(methods), camera_at({0.2f, 0.1f, 0.3f}));
    methods.culling = "frustum";
    EXPECT_EQ(draw(asset, look_with(methods), camera_at({0.2f, 0.1f, 0.3f})), all) << antialiasing;
  }
}

/// What is chosen of what is expanded.
struct Chosen {
  uint32_t count = 0;
  uint32_t of = 0;
};

class Culled : public StrandMethods {
 protected:
  Chosen chosen(const SceneAsset& asset, CullingMethod method, const CameraDesc& camera) {
    const LookDesc look = look_with({});
    RenderScene scene(asset, look, true);
    scene.methods.culling = method;
    scene.methods.detail = DetailMethod::Full;
    RenderPassList passes;
    segment_path().add_passes(scene, passes);
    Chosen result;
    const auto run = [&]() -> Status {
      RETURN_IF_ERROR(passes.plan({&scene.strands}, {&scene.picture}));
      RETURN_IF_ERROR(passes.prepare({gl::ShaderLibrary(), asset}));
      const glm::uvec2 size(kSize.width, kSize.height);
      ASSIGN_OR_RETURN(const View view, make_view(camera, {1.0, 0.0, 0.0, 0.0}, size * kSamplesPerSide));
      const PosedStrands strands{{}, asset.rest_position_m};
      const DrawTerms terms;
      RenderTurn turn(strands, view, size, terms);
      gl::GpuTimer timer(context_->info());
      RETURN_IF_ERROR(passes.run(turn, &timer));
      result.of = static_cast<uint32_t>(turn.drawn_segments);
      result.count = scene.culling->chosen().read_count(result.of);
      return {};
    };
    const Status status = run();
    EXPECT_TRUE(status) << status.error().to_string();
    return result;
  }
};

TEST_F(Culled, AllIsChosenOfWhatIsSeenAndNothingOfWhatIsNot) {
  SceneAsset asset = grown();
  asset.head = {};
  for (const CullingMethod method : {CullingMethod::Frustum, CullingMethod::Occlusion}) {
    const Chosen seen = chosen(asset, method, camera_at({0.0f, 0.0f, 1.5f}));
    EXPECT_GT(seen.of, 0u);
    EXPECT_EQ(seen.count, seen.of);
    CameraDesc away = camera_at({0.0f, 0.0f, -1.5f});
    away.target_m = {0.0f, 0.0f, 3.0f};  // the hair is behind the eye
    EXPECT_EQ(chosen(asset, method, away).count, 0u);
    away = camera_at({0.0f, 0.0f, 1.5f});
    away.target_m = {5.0f, 0.0f, 0.0f};
    EXPECT_EQ(chosen(asset, method, away).count, 0u);
  }
}

TEST_F(Culled, AboutHalfIsChosenWhereHalfOfTheHairIsInThePicture) {
  SceneAsset asset = grown();
  asset.head = {};
  CameraDesc camera = camera_at({0.0f, 0.0f, 1.5f});
  const float half_width_m = 1.5f * std::tan(0.25f) * kSize.width / kSize.height;
  camera.target_m.x = half_width_m;  // the left side of the picture goes through the head
  const Chosen half = chosen(asset, CullingMethod::Frustum, camera);
  EXPECT_NEAR(static_cast<double>(half.count) / half.of, 0.5, 0.1);
}

TEST_F(Culled, SegmentsBehindTheHeadAreLeftOutByOcclusionOnly) {
  const SceneAsset asset = grown();
  const CameraDesc camera = camera_at({0.0f, 0.0f, 1.5f});
  const Chosen in_frustum = chosen(asset, CullingMethod::Frustum, camera);
  const Chosen in_sight = chosen(asset, CullingMethod::Occlusion, camera);
  EXPECT_EQ(in_frustum.count, in_frustum.of);
  EXPECT_LT(in_sight.count, in_frustum.count * 9 / 10);
  EXPECT_GT(in_sight.count, in_frustum.count / 4);
}

TEST_F(Culled, PositionsThatAreNoNumbersAreDrawnAsBefore) {
  SceneAsset asset = grown();
  asset.rest_position_m[7] = glm::vec3(NAN);
  RenderMethodsDesc methods;
  const Image all = draw(asset, look_with(methods), camera_at({0.2f, 0.1f, 0.6f}));
  methods.culling = "occlusion";
  EXPECT_EQ(draw(asset, look_with(methods), camera_at({0.2f, 0.1f, 0.6f})), all);
}

// ---- Volume

/// Mean of the shown values of all pixels.
double mean_of(const Image& image) {
  double sum = 0.0;
  for (size_t i = 0; i < image.rgba.size(); i += 4)
    sum += image.rgba[i] + image.rgba[i + 1] + image.rgba[i + 2];
  return sum / (0.75 * static_cast<double>(image.rgba.size()));
}

TEST_F(StrandMethods, StrandsAloneAreSeenNearAndTheVolumeAloneFarAway) {
  const SceneAsset asset = grown();
  LookDesc look = look_with({});
  look.strand_radius_m = 0.00012f;
  const RenderScene scene(asset, look, true);
  double before = 0.0;
  for (const float distance_m : {0.2f, 0.4f, 0.6f, 0.8f, 1.2f, 3.0f}) {
    const auto view = make_view(camera_at({0.0f, 0.0f, distance_m}), {1.0, 0.0, 0.0, 0.0}, {960, 720});
    const double share = far_share(scene, *view);
    EXPECT_GE(share, before) << "more of it from further away";
    before = share;
    if (distance_m < 0.3f) {
      EXPECT_EQ(share, 0.0);
    }
  }
  EXPECT_EQ(before, 1.0);
}

TEST_F(StrandMethods, NearPicturesKnowNothingOfTheVolume) {
  const SceneAsset asset = grown();
  RenderMethodsDesc methods;
  const Image strands = draw(asset, look_with(methods), camera_at({0.1f, 0.1f, 0.4f}));
  methods.detail = "volume";
  EXPECT_EQ(draw(asset, look_with(methods), camera_at({0.1f, 0.1f, 0.4f})), strands);
}

TEST_F(StrandMethods, AVolumeIsAsBrightAndAsOpaqueAsItsStrands) {
  SceneAsset asset = grown();
  asset.head = {};
  const CameraDesc camera = camera_at({0.5f, 0.3f, 2.5f}, 0.2f);
  for (const float background : {0.0f, 0.8f}) {
    LookDesc look = look_with({});
    look.strand_radius_m = 0.00012f;
    look.followers = 12;
    look.background = glm::vec3(background);
    look.methods.detail = "full";
    const Image strands = draw(asset, look, camera, {120, 120});
    look.methods.detail = "volume";
    const Image volume = draw(asset, look, camera, {120, 120});
    SceneAsset bald = asset;
    bald.strand_count = bald.vertex_count = 0;
    bald.rest_position_m.clear();
    bald.triangle.clear();
    look.methods.detail = "full";
    const double none = mean_of(draw(bald, look, camera, {120, 120}));
    const double hair = mean_of(strands) - none;
    ASSERT_GT(std::abs(hair), 2.0);
    EXPECT_NEAR((mean_of(volume) - none) / hair, 1.0, 0.2) << background;
  }
}

// ---- Fields of the look

TEST_F(StrandMethods, FieldsOfTheLookShowOnQuadsUnlessTheyAreSaidNotTo) {
  SceneAsset asset = grown();
  // All that a field can need: colours of its own, melanin or none, a light from the side.
  LookDesc base;
  base.methods.transparency = "hashed";
  base.rim_color = glm::vec3(0.5f);
  LookDesc other = second_sample_look();
  other.followers = 2;
  // One draws the looks as they are, the other as they change: what a renderer draws of a look that is set is
  // what a new one would (SetLookTest), and to make one takes most of the time.
  std::unique_ptr<Renderer> renderers[2];
  for (auto& renderer : renderers) {
    auto made = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, base, segment_path());
    ASSERT_TRUE(made) << made.error().to_string();
    renderer = std::move(*made);
  }
  const auto drawn_by = [&](Renderer& renderer, const LookDesc& look, const CameraDesc& camera,
                            RenderSize size) {
    const Status set = renderer.set_look(look);
    EXPECT_TRUE(set) << set.error().to_string();
    const Status drawn = renderer.draw({{}, asset.rest_position_m}, camera, size);
    EXPECT_TRUE(drawn) << drawn.error().to_string();
    return renderer.read_image();
  };
  for (const auto& [path, look] : test::looks_one_field_apart(base, other)) {
    if (path.starts_with("methods.") || path == "hair_color") continue;
    LookDesc from = base, to = look;
    if (path.ends_with("melanin")) from.hair_color = to.hair_color = "melanin";
    // Two segments a gap are all that this size shows.
    const RenderSize size = path == "segments" ? RenderSize{640, 480} : kSize;
    const CameraDesc camera = camera_at({0.3f, 0.1f, path == "segments" ? 0.3f : 0.5f});
    const bool is_same =
        drawn_by(*renderers[0], from, camera, size) == drawn_by(*renderers[1], to, camera, size);
    EXPECT_EQ(!is_same, is_drawn_by_methods(path)) << path;
  }
}

TEST_F(StrandMethods, TablesOfShadingFollowTheHighlightsWhileTheSceneRuns) {
  const SceneAsset asset = grown();
  for (const char* kind : {"shading", "scattering"}) {
    LookDesc look = look_with({});
    (std::string(kind) == "shading" ? look.methods.shading : look.methods.scattering) =
        std::string(kind) == "shading" ? "marschner" : "dual";
    auto renderer = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, look, segment_path());
    ASSERT_TRUE(renderer) << renderer.error().to_string();
    const CameraDesc camera = camera_at({0.3f, 0.1f, 0.5f});
    ASSERT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, camera, kSize));
    const Image before = (*renderer)->read_image();
    look.shading.highlight_width_deg = 18.0f;
    ASSERT_TRUE((*renderer)->set_look(look));
    ASSERT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, camera, kSize));
    const Image after = (*renderer)->read_image();
    EXPECT_FALSE(after == before) << kind;
    EXPECT_TRUE(after == draw(asset, look, camera)) << kind;
  }
}

// ---- Casters

TEST_F(StrandMethods, CoarseCastersShadeNearlyAlike) {
  const SceneAsset asset = grown();
  for (const char* shadow : {"deep_opacity", "opacity_maps", "density_rays", "hybrid"}) {
    RenderMethodsDesc methods;
    methods.shadow = shadow;
    const Image same = draw(asset, look_with(methods), camera_at({0.2f, 0.1f, 0.6f}));
    methods.shadow_detail = "coarse";
    const Image coarse = draw(asset, look_with(methods), camera_at({0.2f, 0.1f, 0.6f}));
    double sum = 0.0;
    for (size_t i = 0; i < same.rgba.size(); ++i) sum += std::abs(same.rgba[i] - coarse.rgba[i]);
    const double mean = sum / static_cast<double>(same.rgba.size());
    EXPECT_GT(mean, 0.0) << shadow;
    EXPECT_LT(mean, 1.5) << shadow;
  }
}

}  // namespace
}  // namespace strandcast::strand_methods_test
