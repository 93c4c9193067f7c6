// Tiles drawn by compute kernels: the pixels of the tiles on processors, the same ones each time, lists that
// hold what touches a tile in the order of depth, and finite pictures of impossible hair.
#include <epoxy/gl.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "common/base/hash.h"
#include "common/gl/device_limits.h"
#include "common/pictures/picture_error.h"
#include "common/render/gl_tiles/gpu_bins.h"
#include "common/render/gl_tiles/tile_block.h"
#include "common/render/renderer.h"
#include "common/render/tiles/tile_renderer.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/tiles.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/grown_hair.h"
#include "tests/support/sample_look.h"
#include "tests/support/test_grid.h"

namespace strandcast::gl_tiles_test {
namespace {

constexpr RenderSize kSize{160, 120};

/// A look of the main methods where no other field has its default.
LookDesc changed_look() {
  LookDesc look = sample_look();
  look.methods = {};
  return look;
}

class GlTiles : public GlTest {
 protected:
  void TearDown() override { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); }

  std::unique_ptr<Renderer> make(const SceneAsset& asset, const LookDesc& look = {}) {
    auto made = Renderer::make(gl::ShaderLibrary(), context_->info(), asset, look, tile_path());
    EXPECT_TRUE(made) << made.error().to_string();
    return made ? std::move(*made) : nullptr;
  }
  static Image draw(Renderer& renderer, const SceneAsset& asset, const CameraDesc& camera = {},
                    RenderSize size = kSize, const DrawTerms& terms = {},
                    const BustTurn& bust = BustTurn(0.0)) {
    PosedStrands strands{{}, asset.rest_position_m, bust};
    strands.world_from_head.rotation = glm::angleAxis(0.3, glm::dvec3(0.0, 1.0, 0.0));
    const Status status = renderer.draw(strands, camera, size, terms);
    EXPECT_TRUE(status) << status.error().to_string();
    return renderer.read_image();
  }
};

TEST_F(GlTiles, DrawThePixelsOfTheProcessor) {
  const SceneAsset asset = grown_hair();
  LookDesc backlit;
  backlit.hair_color = "blond";
  backlit.light_direction = {0.2f, -0.3f, 1.0f};
  LookDesc fine;
  fine.strand_radius_m = 0.00004f;
  const CameraDesc front;
  CameraDesc near = front;
  near.offset_m *= 0.4f;
  CameraDesc far = front;
  far.offset_m *= 4.0f;
  for (const auto& [name, look, camera] : {std::tuple{"default", LookDesc{}, front},
                                           {"no default", changed_look(), front},
                                           {"backlit", backlit, front},
                                           {"near", LookDesc{}, near},
                                           {"far", LookDesc{}, far},
                                           {"thin", fine, front}}) {
    const auto gl = make(asset, look);
    auto processor = make_tile_renderer(asset, look, {own_workers(2), simd::widest_set()});
    ASSERT_TRUE(gl && processor);
    const Image seen = draw(*gl, asset, camera);
    const Image truth = draw(**processor, asset, camera);
    const auto error = picture_error(seen, truth, PictureMask(size_t{kSize.width} * kSize.height, 1));
    ASSERT_TRUE(error);
    EXPECT_GE(error->psnr_db, 50.0) << name;
    EXPECT_EQ(gl->profile().drawn_strands, (*processor)->profile().drawn_strands) << name;
    EXPECT_GT(gl->profile().drawn_segments, 0u) << name;
  }
}

TEST_F(GlTiles, ABustIsTurnedAndShadedAsOnTheProcessor) {
  const SceneAsset asset = grown_hair();
  const auto gl = make(asset);
  auto processor = make_tile_renderer(asset, {}, {own_workers(2), simd::widest_set()});
  ASSERT_TRUE(gl && processor);
  CameraDesc camera;
  camera.offset_m *= 1.6f;
  const BustTurn turned(0.0, std::sin(glm::radians(25.0)), 0.0);
  const PictureMask all(size_t{kSize.width} * kSize.height, 1);
  const Image rest = draw(*gl, asset, camera);
  const Image seen = draw(*gl, asset, camera, kSize, {}, turned);
  const Image truth = draw(**processor, asset, camera, kSize, {}, turned);
  const auto error = picture_error(seen, truth, all), moved = picture_error(rest, truth, all);
  ASSERT_TRUE(error && moved);
  EXPECT_GE(error->psnr_db, 50.0);
  EXPECT_LT(moved->psnr_db, 35.0) << "a bust that stays where it was";
  EXPECT_TRUE(draw(*gl, asset, camera) == rest) << "nothing is left behind";
}

TEST_F(GlTiles, PicturesInARowAreOne) {
  const SceneAsset asset = grown_hair();
  const auto renderer = make(asset, changed_look());
  ASSERT_TRUE(renderer);
  const Image first = draw(*renderer, asset);
  for (int i = 0; i < on_grid(3, 10); ++i) {
    // Another picture in between leaves nothing behind.
    draw(*renderer, asset, {}, {64, 200});
    EXPECT_TRUE(draw(*renderer, asset) == first) << i;
  }
  const auto another = make(asset, changed_look());
  EXPECT_TRUE(draw(*another, asset) == first);
}

TEST_F(GlTiles, AShareOfTheStrandsIsDrawnAndCounted) {
  const SceneAsset asset = grown_hair();
  const auto renderer = make(asset);
  ASSERT_TRUE(renderer);
  draw(*renderer, asset);
  const uint64_t all = renderer->profile().drawn_strands;
  draw(*renderer, asset, {}, kSize, {0.1f, {}});
  EXPECT_LE(renderer->profile().drawn_strands, all / 10 + 1);
  EXPECT_GT(renderer->profile().drawn_strands, 0u);
  EXPECT_TRUE(renderer->profile().is_whole);
  draw(*renderer, asset, {}, kSize, {1.0f, [] { return true; }});
  EXPECT_FALSE(renderer->profile().is_whole);
}

TEST_F(GlTiles, WithoutStrandsThereIsTheHeadAndWithoutThatTheBackground) {
  SceneAsset head = bald(grown_hair(40));
  const auto with_head = make(head);
  auto truth = make_tile_renderer(head, {});
  ASSERT_TRUE(with_head && truth);
  const PictureMask all(size_t{kSize.width} * kSize.height, 1);
  const auto error = picture_error(draw(*with_head, head), draw(**truth, head), all);
  ASSERT_TRUE(error);
  EXPECT_GE(error->psnr_db, 50.0);

  head.head = {};
  const auto empty = make(head);
  const Image background = draw(*empty, head);
  for (size_t y = 0; y < kSize.height; ++y)
    for (size_t x = 1; x < kSize.width; ++x)
      for (size_t part = 0; part < 4; ++part)
        ASSERT_EQ(background.rgba[(y * kSize.width + x) * 4 + part],
                  background.rgba[y * kSize.width * 4 + part])
            << x << ' ' << y;
  EXPECT_GT(background.rgba[0], background.rgba[background.rgba.size() - 4]) << "lighter at the top";
}

// ---- impossible hair

TEST_F(GlTiles, ImpossibleHairGivesAFinitePicture) {
  for (const SceneAsset& asset : impossible_hair()) {
    const auto renderer = make(asset);
    ASSERT_TRUE(renderer);
    const Image image = draw(*renderer, asset, {}, {96, 64});
    // The background is there: nothing spreads over the picture.
    EXPECT_GT(image.rgba[0], 40);
    EXPECT_EQ(image.rgba[3], 255);
    // What is left out is told as by the processor.
    auto processor = make_tile_renderer(asset, {}, {own_workers(2), simd::widest_set()});
    ASSERT_TRUE(processor);
    draw(**processor, asset, {}, {96, 64});
    EXPECT_EQ(renderer->profile().unusable_segments > 0, (*processor)->profile().unusable_segments > 0);
    EXPECT_EQ(renderer->profile().left_out_strands, 0u);
  }
}

TEST_F(GlTiles, ExtremeLooksAndViewsGiveAPicture) {
  const SceneAsset asset = grown_hair(60);
  LookDesc wide;
  wide.strand_radius_m = 0.01f;
  LookDesc dark;
  dark.light_color = dark.rim_color = glm::vec3(0.0f);
  dark.ambient = 0.0f;
  LookDesc aimless;
  aimless.light_direction = aimless.rim_direction = glm::vec3(0.0f);
  for (const LookDesc& look : {wide, dark, aimless}) {
    const auto renderer = make(asset, look);
    ASSERT_TRUE(renderer);
    EXPECT_GT(draw(*renderer, asset).rgba[0], 40) << "the background stays";
  }
  const auto renderer = make(asset);
  for (const RenderSize size : {RenderSize{1, 1}, RenderSize{17, 3}, RenderSize{8192, 2}}) {
    const Image image = draw(*renderer, asset, {}, size);
    ASSERT_EQ(image.rgba.size(), size_t{size.width} * size.height * 4);
    for (size_t i = 3; i < image.rgba.size(); i += 4) ASSERT_EQ(image.rgba[i], 255) << i;
  }
  CameraDesc inside;
  inside.offset_m = {0.0f, 0.02f, 0.001f};
  inside.target_m = {0.0f, 0.09f, 0.0f};
  EXPECT_FALSE(draw(*renderer, asset, inside).rgba.empty());
}

// ---- lists of tiles

struct Line {
  glm::vec2 a, b;  // px
  float depth_m = 1.0f;
  float width_px = 1.0f;
};

/// The lists of a picture, from lines that are strands of two points each.
class TileLists : public GlTest {
 protected:
  using Lists = std::vector<std::vector<uint32_t>>;  // per tile: lines, in their order

  Lists bin(const std::vector<Line>& lines, glm::uvec2 size_px) {
    const glm::uvec2 tiles = gpu_tiles(size_px);
    TileBlock block{};
    block.eye.w = 0.01f;
    block.target = glm::vec4(size_px, 1.0f, 10.0f);
    block.followers.z = 2;
    block.grid = {tiles, static_cast<uint32_t>(lines.size()), 0};
    gl::Buffer uniforms("tile frame", sizeof block);
    uniforms.write(0, std::as_bytes(std::span(&block, 1)));
    uniforms.bind_uniform(shader::kBindingTileFrame);
    std::vector<glm::uvec4> texels;
    for (const Line& line : lines)
      for (const glm::vec2& at : {line.a, line.b}) {
        texels.emplace_back(glm::floatBitsToUint(glm::vec3(at, line.depth_m)), 0u);
        texels.emplace_back(0u, glm::packHalf2x16({line.width_px, 1.0f}), 0u, 0u);
      }
    const gl::Buffer points = gl::Buffer::of("points", texels);
    const gl::Texture view = gl::Texture::view_of("points", GL_RGBA32UI, points);
    view.bind(shader::kUnitTilePoints);
    const gl::Buffer strands =
        gl::Buffer::of("strands", std::vector<glm::uvec4>(lines.size(), glm::uvec4(2, 0, 0, 0)));
    const gl::Texture strand_view = gl::Texture::view_of("strands", GL_RGBA32UI, strands);
    strand_view.bind(shader::kUnitTileStrands);
    GpuBins bins;
    EXPECT_TRUE(bins.prepare(gl::ShaderLibrary()));
    const uint64_t segments = 2 * lines.size();
    counts_ = bins.count(tiles, segments);
    bins.fill(tiles, segments, counts_.pairs);
    bins.bind();
    return read(tiles, counts_.pairs);
  }

  GpuBinCounts counts_;

 private:
  // As tile_draw.comp would read them.
  static Lists read(glm::uvec2 tiles, uint64_t pairs) {
    const auto texels_of = [](uint32_t unit, uint64_t count) {
      GLint texture = 0;
      glActiveTexture(GL_TEXTURE0 + unit);
      glGetIntegerv(GL_TEXTURE_BINDING_BUFFER, &texture);
      GLint buffer = 0;
      glGetTextureLevelParameteriv(static_cast<GLuint>(texture), 0, GL_TEXTURE_BUFFER_DATA_STORE_BINDING,
                                   &buffer);
      std::vector<uint32_t> values(count);
      glGetNamedBufferSubData(static_cast<GLuint>(buffer), 0,
                              static_cast<GLsizeiptr>(count * sizeof(uint32_t)), values.data());
      return values;
    };
    const auto first = texels_of(shader::kUnitTileFirst, uint64_t{tiles.x} * tiles.y + 1);
    const auto pair = texels_of(shader::kUnitTileOrder, 2 * pairs);
    Lists lists(size_t{tiles.x} * tiles.y);
    for (size_t tile = 0; tile < lists.size(); ++tile)
      for (uint32_t i = first[tile]; i < first[tile + 1]; ++i) lists[tile].push_back(pair[2 * i + 1] / 2);
    return lists;
  }
};

double distance_px(glm::dvec2 point, const Line& line) {
  const glm::dvec2 way = glm::dvec2(line.b) - glm::dvec2(line.a);
  const double part = glm::clamp(glm::dot(point - glm::dvec2(line.a), way) / glm::dot(way, way), 0.0, 1.0);
  return glm::length(point - glm::dvec2(line.a) - part * way);
}

TEST_F(TileLists, HoldWhatCoversAPixelOfTheTileAndLittleElse) {
  const glm::uvec2 size{200, 150};
  std::vector<Line> lines;
  for (uint32_t i = 0; i < 400; ++i) {
    const auto part = [&](uint32_t axis) { return unit_float(mix_u32(8 * i + axis)); };
    const glm::vec2 at = glm::vec2(-20.0f) + glm::vec2(240.0f, 190.0f) * glm::vec2(part(0), part(1));
    const float angle = 6.2832f * part(2);
    const float length = i % 3 == 0 ? 90.0f * part(3) : 9.0f * part(3) + 0.1f;
    lines.push_back({at, at + length * glm::vec2(std::cos(angle), std::sin(angle)), 1.0f + part(4),
                     0.1f + 3.0f * part(5)});
  }
  // Level, upright and through the corners of tiles.
  lines.push_back({{0.0f, 32.0f}, {199.0f, 32.0f}});
  lines.push_back({{64.0f, 0.0f}, {64.0f, 149.0f}});
  lines.push_back({{0.0f, 0.0f}, {100.0f, 150.0f}});
  const Lists lists = bin(lines, size);
  const glm::uvec2 tiles = gpu_tiles(size);
  uint64_t listed = 0;
  uint64_t needed = 0;
  const glm::uvec2 tile_px(shader::kTileColumns, shader::kTileRows);
  for (uint32_t tile = 0; tile < lists.size(); ++tile) {
    const std::set<uint32_t> here(lists[tile].begin(), lists[tile].end());
    ASSERT_EQ(here.size(), lists[tile].size()) << "none twice";
    listed += here.size();
    const glm::uvec2 from = glm::uvec2(tile % tiles.x, tile / tiles.x) * tile_px;
    for (uint32_t i = 0; i < lines.size(); ++i) {
      double nearest = 1e9;
      for (uint32_t y = 0; y < tile_px.y && from.y + y < size.y; ++y)
        for (uint32_t x = 0; x < tile_px.x; ++x)
          nearest = std::min(nearest, distance_px(glm::dvec2(from + glm::uvec2(x, y)) + 0.5, lines[i]));
      // Coverage ends at half of the width and half of a pixel's diagonal.
      const bool is_covered = nearest < 0.5 * lines[i].width_px + 0.7;
      needed += is_covered ? 1 : 0;
      if (is_covered) {
        ASSERT_TRUE(here.contains(i)) << "line " << i << ", tile " << tile;
      }
      // Lists are by boxes of tiles and slanted lines: what is further than a tile's diagonal is in none.
      if (nearest > 0.5 * lines[i].width_px + 12.0) {
        ASSERT_FALSE(here.contains(i)) << i << tile;
      }
    }
  }
  EXPECT_EQ(listed, counts_.pairs);
  EXPECT_LT(static_cast<double>(listed), 1.4 * static_cast<double>(needed));
}

// Some drivers end loops after 65,535 turns.
TEST_F(TileLists, ATileOfMoreThan65535LinesHasThemAllByDepth) {
  constexpr uint32_t kLines = 70'000;
  std::vector<Line> lines;
  for (uint32_t i = 0; i < kLines; ++i) {
    // Depths of which every one comes 70 times.
    const float depth = 1.0f + 0.001f * static_cast<float>(mix_u32(i) % 1000);
    lines.push_back({{2.0f, 3.0f}, {5.0f, 9.0f}, depth});
  }
  const Lists lists = bin(lines, {8, 16});
  ASSERT_EQ(lists.size(), 1u);
  EXPECT_EQ(counts_.pairs, kLines);
  EXPECT_EQ(counts_.segments, kLines);
  ASSERT_EQ(lists[0].size(), kLines);
  for (size_t i = 1; i < kLines; ++i) {
    const uint32_t a = lists[0][i - 1];
    const uint32_t b = lists[0][i];
    ASSERT_TRUE(lines[a].depth_m < lines[b].depth_m || (lines[a].depth_m == lines[b].depth_m && a < b)) << i;
  }
}

TEST_F(TileLists, LeaveOutWhatIsBehindTheEyeOffThePictureOrNoNumber) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const Line good{{2.0f, 3.0f}, {30.0f, 40.0f}};
  std::vector<Line> lines(7, good);
  lines[0].depth_m = 0.005f;  // nearer than the near plane
  lines[1].depth_m = -1.0f;
  lines[2].a.x = nan;
  lines[3].b.y = inf;
  lines[4].depth_m = nan;
  lines[5] = {{-50.0f, -50.0f}, {-10.0f, -20.0f}};
  for (const auto& list : bin(lines, {64, 64}))
    for (const uint32_t line : list) EXPECT_EQ(line, 6u);
  EXPECT_EQ(counts_.segments, 1u);
  EXPECT_EQ(counts_.not_finite, 3u);
  EXPECT_GT(counts_.pairs, 0u);
}

}  // namespace
}  // namespace strandcast::gl_tiles_test
