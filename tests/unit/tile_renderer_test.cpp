// The tile renderer: the same pixels however it runs, coverage and blending as computed by hand, and finite
// pictures of impossible hair.
#include <gmock/gmock.h>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/hash.h"
#include "common/pictures/picture_error.h"
#include "common/render/render_device.h"
#include "common/render/render_scene.h"
#include "common/render/strand_detail.h"
#include "common/render/tiles/half_float.h"
#include "common/render/tiles/strand_expansion.h"
#include "common/render/tiles/tile_raster.h"
#include "common/render/tiles/tile_renderer.h"
#include "tests/support/grown_hair.h"
#include "tests/support/sample_look.h"

namespace strandcast::tile_renderer_test {
namespace {

TEST(TileRenderer, ThreadsAndInstructionSetsDoNotShow) {
  const SceneAsset asset = grown_hair();
  // A look where no field has its default.
  const Image first = drawn(asset, sample_look(), {own_workers(1), simd::InstructionSet::Plain});
  for (const uint32_t threads : {1u, 2u, 4u})
    for (const simd::InstructionSet set : simd::instruction_sets())
      EXPECT_TRUE(drawn(asset, sample_look(), {own_workers(threads), set}).rgba == first.rgba)
          << threads << " threads, " << to_string(set);
}

TEST(TileRenderer, TenPicturesAreOne) {
  const SceneAsset asset = grown_hair();
  auto renderer = make_tile_renderer(asset, {}, {own_workers(3), simd::widest_set()});
  ASSERT_TRUE(renderer);
  std::vector<uint8_t> first;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, {}, {160, 120}));
    const Image image = (*renderer)->read_image();
    if (i == 0) first = image.rgba;
    EXPECT_TRUE(image.rgba == first) << i;
    // Another picture in between leaves nothing behind.
    ASSERT_TRUE((*renderer)->draw({{}, asset.rest_position_m}, {}, {64, 200}));
  }
}

TEST(TileRenderer, ABustThatTurnsIsLitAsItWas) {
  const SceneAsset asset = grown_hair();
  auto renderer = make_tile_renderer(asset, {}, {own_workers(2), simd::widest_set()});
  ASSERT_TRUE(renderer);
  const RenderSize size{160, 160};
  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 1.1f};
  camera.target_m = {0.0f, -0.12f, 0.0f};
  const auto picture = [&](const BustTurn& turn) {
    EXPECT_TRUE((*renderer)->draw({{}, asset.rest_position_m, turn}, camera, size));
    return (*renderer)->read_image();
  };
  // Skin is red before all else; of the bust the lower half of the picture shows nothing else.
  const auto brightness = [&](const Image& image, uint32_t from_y, uint32_t to_y) {
    double sum = 0.0, count = 0.0;
    for (uint32_t y = from_y; y < to_y; ++y)
      for (uint32_t x = 0; x < size.width; ++x) {
        const uint8_t* const pixel = &image.rgba[4 * (size_t{y} * size.width + x)];
        if (pixel[0] <= pixel[2] + 20) continue;
        sum += pixel[0];
        count += 1.0;
      }
    return sum / count;
  };
  const Image rest = picture(BustTurn(0.0));
  const double before = brightness(rest, 100, 160);
  for (const double turned_deg : {25.0, -25.0, 50.0}) {
    const Image turned = picture({0.0, std::sin(glm::radians(0.5 * turned_deg)), 0.0});
    EXPECT_NE(turned.rgba, rest.rgba);
    EXPECT_TRUE(
        std::equal(rest.rgba.begin(), rest.rgba.begin() + 4 * size_t{size.width} * 40, turned.rgba.begin()))
        << "the crown is where it was";
    // In the shade that shoulders had at rest it would be a half darker.
    EXPECT_GT(brightness(turned, 100, 160), 0.85 * before) << turned_deg;
  }
  EXPECT_EQ(picture(BustTurn(0.0)).rgba, rest.rgba) << "nothing is left behind";
}

/// Every value of every colour somewhere.
Image some_picture(RenderSize size) {
  Image image{size.width, size.height, {}};
  for (uint32_t i = 0; i < size.width * size.height; ++i)
    for (const uint32_t value : {i, i / 3, 255 - i, 255u}) image.rgba.push_back(static_cast<uint8_t>(value));
  return image;
}

TEST(TileRenderer, WhereNothingIsDrawnABackdropStaysAsItIs) {
  const SceneAsset asset = grown_hair();
  const RenderSize size{150, 110};  // no whole tiles
  const Image behind = some_picture(size);
  DrawTerms over;
  over.backdrop = &behind;
  const auto picture = [&](const LookDesc& look, const DrawTerms& terms, simd::InstructionSet set) {
    auto renderer = make_tile_renderer(asset, look, {own_workers(2), set});
    EXPECT_TRUE(renderer && (*renderer)->draw({{}, asset.rest_position_m}, {}, size, terms));
    return (*renderer)->read_image();
  };
  LookDesc dark, grey;
  dark.background = glm::vec3(0.0f);
  grey.background = glm::vec3(0.5f);
  const auto set = simd::widest_set();
  const Image on_dark = picture(dark, {}, set), on_grey = picture(grey, {}, set);
  const Image drawn = picture(dark, over, set);
  EXPECT_TRUE(picture(grey, over, set).rgba == drawn.rgba) << "nothing is seen of the background";
  for (const simd::InstructionSet other : simd::instruction_sets())
    EXPECT_TRUE(picture(dark, over, other).rgba == drawn.rgba) << to_string(other);
  const auto at = [&](const Image& image, uint32_t x, uint32_t y) {
    return &image.rgba[4 * (size_t{y} * image.width + x)];
  };
  const auto apart = [](const uint8_t* one, const uint8_t* other) {
    return std::max({std::abs(one[0] - other[0]), std::abs(one[1] - other[1]), std::abs(one[2] - other[2])});
  };
  // Nothing there, nor beside it: the edge of a strand can be too faint to show.
  const auto is_open = [&](uint32_t x, uint32_t y) {
    for (uint32_t v = y - 2; v <= y + 2; ++v)
      for (uint32_t u = x - 2; u <= x + 2; ++u)
        if (apart(at(on_dark, u, v), at(on_dark, 0, v)) > 0 ||
            apart(at(on_grey, u, v), at(on_grey, 0, v)) > 0)
          return false;
    return true;
  };
  size_t open = 0, covered = 0;
  for (uint32_t y = 2; y + 2 < size.height; ++y)
    for (uint32_t x = 2; x + 2 < size.width; ++x) {
      if (is_open(x, y)) {
        EXPECT_EQ(apart(at(drawn, x, y), at(behind, x, y)), 0) << x << ", " << y;
        ++open;
      } else if (apart(at(on_dark, x, y), at(on_grey, x, y)) == 0) {
        // As good as opaque (tile_blend.h): a bright backdrop shines through by some steps of a dark colour.
        EXPECT_LE(apart(at(drawn, x, y), at(on_dark, x, y)), 8) << x << ", " << y;
        ++covered;
      }
    }
  EXPECT_GT(open, 1'000u);
  EXPECT_GT(covered, 1'000u);
  const Image smaller = some_picture({64, 64});
  over.backdrop = &smaller;
  auto renderer = make_tile_renderer(asset, dark, {own_workers(1), set});
  ASSERT_TRUE(renderer);
  const Status refused = (*renderer)->draw({{}, asset.rest_position_m}, {}, size, over);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::BadInput);
}

TEST(TileRenderer, OfSeveralHeadsTheNearerIsInFrontAndOneIsAsByItself) {
  const SceneAsset asset = grown_hair();
  const RenderSize size{160, 120};
  LookDesc red, blond;
  red.hair_color = "red";
  blond.hair_color = "blond";
  auto first = make_tile_renderer(asset, red, {own_workers(2), simd::widest_set()});
  auto second = make_tile_renderer(asset, blond, {own_workers(2), simd::widest_set()});
  ASSERT_TRUE(first && second);
  const auto at = [&](const glm::dvec3& place_m) {
    PosedStrands strands{{}, asset.rest_position_m};
    strands.world_from_head.position_m = place_m;
    return strands;
  };
  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 1.0f};
  camera.target_m = glm::vec3(0.0f);
  const PosedStrands far = at({100.0, 0.0, -0.5}), near = at({100.0, 0.0, 0.25});
  const auto picture = [&](const std::vector<PlacedHead>& heads, const CameraDesc& from) {
    CameraDesc far_away = from;
    far_away.offset_m *= 100.0f;  // sees all
    auto made = draw_heads(heads, {from, far_away}, size);
    EXPECT_TRUE(made) << made.error().to_string();
    return made ? std::move(made->image) : Image{};
  };
  // One head is what its renderer draws.
  const Image alone = picture({{first->get(), &far}}, camera);
  ASSERT_TRUE((*first)->draw(far, camera, size));
  EXPECT_TRUE((*first)->read_image().rgba == alone.rgba);
  // The order in which they are told says nothing.
  const Image both = picture({{first->get(), &far}, {second->get(), &near}}, camera);
  EXPECT_TRUE(picture({{second->get(), &near}, {first->get(), &far}}, camera).rgba == both.rgba);
  // From the front the near one hides the other where it is opaque, from behind it is hidden.
  const auto count_like = [&](const Image& image, const CameraDesc& from, const PlacedHead& head) {
    const std::vector<PlacedHead> heads{{first->get(), &far}, {second->get(), &near}};
    const CameraDesc own = camera_from_head(from, middle_of(heads), head.strands->world_from_head.position_m);
    EXPECT_TRUE(head.renderer->draw(*head.strands, own, size));
    const Image drawn = head.renderer->read_image();
    size_t same = 0;
    for (size_t i = 0; i < image.rgba.size(); i += 4)
      same += std::equal(&image.rgba[i], &image.rgba[i] + 4, &drawn.rgba[i]) ? 1 : 0;
    return same;
  };
  const size_t front_near = count_like(both, camera, {second->get(), &near});
  const size_t front_far = count_like(both, camera, {first->get(), &far});
  EXPECT_GT(front_near, front_far);
  CameraDesc behind = camera;
  behind.offset_m.z = -1.0f;
  const Image reverse = picture({{first->get(), &far}, {second->get(), &near}}, behind);
  EXPECT_GT(count_like(reverse, behind, {first->get(), &far}),
            count_like(reverse, behind, {second->get(), &near}));
}

// A head that nothing moves stands where it began while the other one is on a stage: both are seen.
TEST(TileRenderer, HeadsThatStandFarApartAreInThePictureAll) {
  const RenderSize size{640, 360};
  const PosedStrands low{}, high{.world_from_head = {{0.6, 1.6, -0.4}, {1, 0, 0, 0}}, .position_m = {}};
  const std::vector<PlacedHead> heads{{nullptr, &low}, {nullptr, &high}};
  for (const glm::vec3& offset_m : {glm::vec3(0.1f, 0.05f, 1.35f), glm::vec3(-1.0f, 0.3f, 0.0f),
                                    glm::vec3(0.0f, 1.0f, 0.0f), glm::vec3(0.0f, 0.02f, 9.0f)}) {
    CameraDesc camera;
    camera.offset_m = offset_m;
    const double factor = room_factor(heads, camera, size);
    const bool sees_all = glm::length(offset_m) > 5.0f;
    EXPECT_EQ(factor == 1.0, sees_all) << factor;
    camera.offset_m *= static_cast<float>(factor);
    const auto view = make_view(camera, {1.0, 0.0, 0.0, 0.0}, {size.width, size.height});
    ASSERT_TRUE(view);
    for (const PlacedHead& head : heads) {
      const glm::dvec3 seen_m = head.strands->world_from_head.position_m - middle_of(heads);
      const glm::vec4 clip = view->clip_from_head * glm::vec4(glm::vec3(seen_m), 1.0f);
      EXPECT_LT(std::abs(clip.x / clip.w), 1.0f);
      EXPECT_LT(std::abs(clip.y / clip.w), 1.0f);
      EXPECT_GT(clip.w, 0.0f);
    }
  }
  EXPECT_EQ(room_factor(std::span(heads).first(1), {}, size), 1.0) << "one is followed as ever";
}

// What the codec's bound does to a picture: every vertex a tenth of a millimetre off.
TEST(TileRenderer, TheDefaultBoundHardlyShows) {
  const SceneAsset asset = grown_hair(1000);
  auto renderer = make_tile_renderer(asset, {}, {own_workers(2), simd::widest_set()});
  ASSERT_TRUE(renderer);
  const RenderSize size{640, 360};
  const auto picture = [&](const std::vector<glm::vec3>& position_m) {
    EXPECT_TRUE((*renderer)->draw({{}, position_m}, {}, size));
    return (*renderer)->read_image();
  };
  const Image exact = picture(asset.rest_position_m);
  std::vector<glm::vec3> coarse = asset.rest_position_m;
  const float bound_m = StreamDesc().bound_m;
  for (size_t i = 0; i < coarse.size(); ++i) {
    const auto part = [&](uint32_t axis) {
      return 2.0f * unit_float(mix_u32(static_cast<uint32_t>(3 * i + axis))) - 1.0f;
    };
    coarse[i] += bound_m * glm::normalize(glm::vec3(part(0), part(1), part(2)));
  }
  auto without = make_tile_renderer(bald(asset), {});
  ASSERT_TRUE(without && (*without)->draw({{}, {}}, {}, size));
  const auto error = picture_error(picture(coarse), exact, mask_of(exact, (*without)->read_image()));
  ASSERT_TRUE(error);
  EXPECT_GE(error->psnr_db, 45.0);
  EXPECT_GE(error->ssim, 0.99);
}

// Roots as close across a parting as beside it, combed to both sides.
TEST(TileRenderer, FollowersCoverAPartingAndFallToTheirKeysSide) {
  SceneAsset asset;
  constexpr uint32_t kSide = 12;
  constexpr float kSpacingM = 0.01f;
  asset.strand_count = kSide * kSide;
  asset.vertex_count = 4;
  for (uint32_t vertex = 0; vertex < asset.vertex_count; ++vertex)
    for (uint32_t i = 0; i < asset.strand_count; ++i) {
      const float x = kSpacingM * (static_cast<float>(i % kSide) - 0.5f * (kSide - 1));
      const float away = 0.05f * static_cast<float>(vertex);
      asset.rest_position_m.emplace_back(x < 0.0f ? x - away : x + away, 0.2f * away,
                                         kSpacingM * static_cast<float>(i / kSide));
    }
  for (uint32_t row = 0; row + 1 < kSide; ++row)
    for (uint32_t column = 0; column + 1 < kSide; ++column) {
      const uint32_t i = row * kSide + column;
      asset.triangle.emplace_back(i, i + 1, i + kSide);
      asset.triangle.emplace_back(i + 1, i + kSide + 1, i + kSide);
    }
  const std::vector<uint8_t> parted = parted_triangles(asset);
  EXPECT_EQ(std::count(parted.begin(), parted.end(), 1), 2 * (kSide - 1)) << "one column of squares";
  EXPECT_EQ(joined_triangles(asset).size() + 2 * (kSide - 1), asset.triangle.size());

  LookDesc look;
  look.followers = 20;
  look.style = {};
  look.style.clump = look.style.spread = look.style.wave_m = look.style.frizz_m = 0.0f;
  look.style.stray_share = 0.0f;
  StrandExpansion expansion(asset, 0.15f);
  expansion.set_look(look);
  StrandDetail detail;
  detail.segments_per_gap = 2;
  detail.followers = look.followers;
  detail.strand_count = asset.strand_count + static_cast<uint32_t>(asset.triangle.size()) * look.followers;
  WorkerPool workers(1);
  StrandPoints points;
  expansion.expand(asset.rest_position_m, detail, workers, simd::widest_set(), points);
  int within = 0;
  for (uint32_t strand = 0; strand < points.strand_count(); ++strand) {
    const StrandPoint& root = points.point[points.first_point[strand]];
    const StrandPoint& tip = points.point[points.first_point[strand + 1] - 1];
    within += std::abs(root.x) < 0.45f * kSpacingM;
    // Whichever way it falls, it goes all of it: none hangs between the sides.
    EXPECT_GT(std::abs(tip.x - root.x), 0.05f) << strand;
  }
  EXPECT_GT(within, static_cast<int>(0.8 * 2 * (kSide - 1) * look.followers));
}

// Arcs of a circle: their curves are off chords of 1 / n of a gap by its sagitta.
TEST(StrandDetail, ChordsStayCloseToTheirCurves) {
  constexpr float kRadiusM = 0.05f;
  constexpr uint32_t kVertices = 16;
  constexpr float kTurnRad = 0.2f;  // from vertex to vertex
  SceneAsset asset;
  asset.strand_count = 4;
  asset.vertex_count = kVertices;
  for (uint32_t vertex = 0; vertex < kVertices; ++vertex)
    for (uint32_t i = 0; i < asset.strand_count; ++i) {
      const float turn = kTurnRad * static_cast<float>(vertex);
      asset.rest_position_m.emplace_back(kRadiusM * std::sin(turn), kRadiusM * std::cos(turn),
                                         0.01f * static_cast<float>(i));
    }
  LookDesc look;
  look.segments = 8;
  look.style.wave_m = look.style.frizz_m = 0.0f;
  DetailFacts facts = detail_facts(RenderScene(asset, look, true));
  facts.max_points = 1 << 20;
  View view;
  uint32_t before = 0;
  for (const float px_per_m : {100.0f, 1000.0f, 4000.0f, 10000.0f, 60000.0f}) {
    view.focal_px = px_per_m;
    const uint32_t n = choose_detail(facts, look, view, {}).segments_per_gap;
    const auto off_px = [&](uint32_t segments) {
      return kRadiusM * (1.0f - std::cos(0.5f * kTurnRad / static_cast<float>(segments))) * px_per_m;
    };
    // Hair in motion bends more than these arcs' 0.2 rad: they are drawn as if by 0.25.
    constexpr float kMore = 0.25f / kTurnRad;
    constexpr float kErrorPx = 0.16f, kRounding = 1.01f;
    const float one_more = static_cast<float>(n + 1) / static_cast<float>(n);
    if (n < 8) {
      EXPECT_LT(kMore * off_px(n), kErrorPx * one_more * one_more * kRounding) << px_per_m;
    }
    if (n > 1) {
      EXPECT_GT(kMore * off_px(n) * kRounding, n < 8 ? kErrorPx : 0.0f) << px_per_m;
    }
    EXPECT_GE(n, before);
    before = n;
  }
  EXPECT_EQ(before, 8u);
  // Waves of a look count as well, and no look takes more than it says.
  view.focal_px = 1000.0f;
  const uint32_t plain = choose_detail(facts, look, view, {}).segments_per_gap;
  look.style.wave_m = 0.01f;
  look.style.wave_count = 6.0f;
  EXPECT_GT(choose_detail(facts, look, view, {}).segments_per_gap, plain);
  look.segments = 1;
  EXPECT_EQ(choose_detail(facts, look, view, {}).segments_per_gap, 1u);
}

// Half a pixel of head hides half of what is behind it, and only that, however much hair there is.
TEST(TileRenderer, TheEdgeOfAHeadIsSeenBeforeDenseHair) {
  SceneAsset asset;
  constexpr uint32_t kRows = 60, kLayers = 20;
  asset.strand_count = kRows * kLayers;
  asset.vertex_count = 2;
  for (const float x : {-0.2f, 0.2f})
    for (uint32_t i = 0; i < asset.strand_count; ++i)
      asset.rest_position_m.emplace_back(x, 0.003f * (static_cast<float>(i % kRows) - 0.5f * kRows),
                                         -0.1f - 0.001f * static_cast<float>(i / kRows));
  LookDesc look;
  look.followers = 0;
  look.strand_radius_m = 0.0015f;
  look.style = {};
  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 0.6f};
  camera.target_m = {0.0f, 0.0f, 0.0f};
  const RenderSize size{64, 48};
  const auto edge = [&](float right_m) {
    asset.head.position_m = {
        {-0.1f, -1.0f, 0.0f}, {right_m, -1.0f, 0.0f}, {right_m, 1.0f, 0.0f}, {-0.1f, 1.0f, 0.0f}};
    asset.head.normal.assign(4, {0.0f, 0.0f, 1.0f});
    asset.head.triangle = {{0, 1, 2}, {0, 2, 3}};
    auto renderer = make_tile_renderer(asset, look, {own_workers(1), simd::widest_set()});
    EXPECT_TRUE(renderer && (*renderer)->draw({{}, asset.rest_position_m}, camera, size));
    const Image image = (*renderer)->read_image();
    std::vector<int> red;
    for (uint32_t x = 0; x < size.width; ++x) red.push_back(image.rgba[(size_t{24} * size.width + x) * 4]);
    return red;
  };
  int halves = 0;
  // Its edge somewhere within a pixel.
  for (int step = 0; step < 6; ++step) {
    const std::vector<int> red = edge(0.0005f * static_cast<float>(step));
    const int head = red[28], hair = red[40];
    ASSERT_GT(std::abs(head - hair), 40);
    const auto share = [&](int value) { return static_cast<double>(value - hair) / (head - hair); };
    for (uint32_t x = 28; x < 40; ++x) halves += share(red[x]) > 0.3 && share(red[x]) < 0.85;
  }
  EXPECT_GE(halves, 2);
}

// The lattice as it is shades hair as one of 128 cells does, and a coarser one does not.
TEST(TileRenderer, ShadowsAreThoseOfAFinerLattice) {
  const SceneAsset asset = grown_hair(1000);
  SceneAsset bald = asset;
  bald.strand_count = bald.vertex_count = 0;
  bald.rest_position_m.clear();
  bald.triangle.clear();
  const auto picture = [](const SceneAsset& of, uint32_t cells) {
    TileOptions options{own_workers(2), simd::widest_set()};
    options.light_cells = cells;
    return drawn(of, {}, options, {320, 240});
  };
  const Image truth = picture(asset, 128);
  const PictureMask hair = mask_of(truth, picture(bald, 128));
  const auto rmse = [&](uint32_t cells) {
    const auto error = picture_error(picture(asset, cells), truth, hair);
    EXPECT_TRUE(error);
    return error ? std::pow(10.0, -error->psnr_db / 20.0) : 1.0;
  };
  EXPECT_LT(rmse(TileOptions().light_cells), 0.0075);
  EXPECT_GT(rmse(48), 0.0075);
}

// What is left out because head and hair hide it would not be seen, from wherever one looks.
TEST(TileRenderer, WhatIsHiddenIsNotMissed) {
  const SceneAsset asset = grown_hair(1000);
  const RenderSize size{320, 240};
  CameraDesc camera;
  uint64_t seen = 0, all_segments = 0;
  for (const glm::vec3 offset_m :
       {glm::vec3(0.1f, 0.05f, 0.6f), glm::vec3(0.6f, 0, 0), glm::vec3(0, 0.3f, -0.6f),
        glm::vec3(0.1f, 0.7f, 0.1f), glm::vec3(0.1f, -0.5f, 0.3f)}) {
    camera.offset_m = offset_m;
    Image pictures[2];
    uint64_t segments[2];
    for (const bool draws_hidden : {true, false}) {
      TileOptions options{own_workers(2), simd::widest_set()};
      options.draws_hidden = draws_hidden;
      auto renderer = make_tile_renderer(asset, {}, options);
      ASSERT_TRUE(renderer && (*renderer)->draw({{}, asset.rest_position_m}, camera, size));
      pictures[draws_hidden ? 1 : 0] = (*renderer)->read_image();
      segments[draws_hidden ? 1 : 0] = (*renderer)->profile().drawn_segments;
    }
    const PictureMask all(size_t{size.width} * size.height, 1);
    const auto error = picture_error(pictures[0], pictures[1], all);
    ASSERT_TRUE(error);
    EXPECT_GE(error->psnr_db, 55.0) << offset_m.x << ", " << offset_m.y;
    seen += segments[0];
    all_segments += segments[1];
  }
  EXPECT_LT(static_cast<double>(seen), 0.8 * static_cast<double>(all_segments));
}

// Tiles that shading finds are those of the segments' places.
TEST(TileBins, ListsAreTheSameWithoutTheTilesThatShadingFound) {
  const SceneAsset asset = grown_hair();
  const RenderScene scene(asset, {}, true);
  StrandExpansion expansion(asset, scene.rest.mean_length_m);
  expansion.set_look(scene.look);
  const auto view = make_view({}, {1.0, 0.0, 0.0, 0.0}, {200, 150});
  ASSERT_TRUE(view);
  StrandPoints points;
  DetailFacts facts = detail_facts(scene);
  facts.max_points = 1 << 20;
  expansion.expand(asset.rest_position_m, choose_detail(facts, scene.look, *view, {}), *own_workers(2),
                   simd::widest_set(), points);
  points.point[100].x = std::nanf("");
  LightLattice lattice(describe_lattice(asset, scene, 32));
  ShadeInput shade{};
  lattice.build(fit_lattice(lattice.desc(), shade.lights, asset.rest_position_m, 0.0f), points,
                {1e-4f, 1.0f, 0.0f}, shade.lights, *own_workers(2));
  shade.lattice = lattice.view();
  shade.view = *view;
  shade.width_m = 1e-4f;
  shade_points(shade, *own_workers(2), simd::widest_set(), points);
  const TileGrid grid{{200, 150}};
  TileBins known, looked;
  const BinCounts with = known.bin_segments(points, grid, view->near_m, *own_workers(2));
  EXPECT_GT(std::count_if(points.tile.begin(), points.tile.end(),
                          [&](uint32_t tile) { return tile < grid.count(); }),
            static_cast<ptrdiff_t>(points.tile.size() / 2));
  points.tile.clear();
  const BinCounts without = looked.bin_segments(points, grid, view->near_m, *own_workers(2));
  EXPECT_EQ(with.not_finite, without.not_finite);
  EXPECT_GT(with.not_finite, 0u);
  EXPECT_EQ(with.segments, without.segments);
  EXPECT_EQ(known.segments().first, looked.segments().first);
  const auto is_same = [](const TileSegment& a, const TileSegment& b) { return a.point == b.point; };
  EXPECT_TRUE(std::equal(known.segments().item.begin(), known.segments().item.end(),
                         looked.segments().item.begin(), looked.segments().item.end(), is_same));
}

// ---- one tile after another, from points made by hand

uint16_t half_of(float x) {
  uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  constexpr float kSmallest = 6.2e-5f;  // of what has all its bits
  return std::abs(x) < kSmallest
             ? 0
             : static_cast<uint16_t>(((bits >> 16) & 0x8000u) | ((((bits >> 23) & 0xff) - 112) << 10) |
                                     ((bits >> 13) & 0x3ff));
}

struct Line {
  std::vector<glm::vec2> point_px;
  float depth_m = 1.0f;
  float width_px = 1.0f;  // a half, exactly
  float opacity = 1.0f;
  glm::vec3 color{1.0f};
};

/// As stage `shade` leaves them.
StrandPoints points_of(const std::vector<Line>& lines) {
  StrandPoints points;
  points.first_point.push_back(0);
  for (const Line& line : lines) {
    for (size_t i = 0; i < line.point_px.size(); ++i) {
      glm::vec2 mitre(0.0f);
      if (i > 0) mitre += glm::normalize(line.point_px[i] - line.point_px[i - 1]);
      if (i + 1 < line.point_px.size()) mitre += glm::normalize(line.point_px[i + 1] - line.point_px[i]);
      StrandPoint point{line.point_px[i].x, line.point_px[i].y, line.depth_m, 0, {}};
      point.half = {
          half_of(mitre.x),      half_of(mitre.y),      half_of(line.width_px), half_of(line.opacity),
          half_of(line.color.r), half_of(line.color.g), half_of(line.color.b),  0};
      points.point.push_back(point);
    }
    points.first_point.push_back(static_cast<uint32_t>(points.point.size()));
    points.index.push_back(0);
    points.lock.push_back(0);
  }
  return points;
}

/// Linear values over black, tone curve undone.
std::vector<glm::vec3> raster(const std::vector<Line>& lines, glm::uvec2 size) {
  const StrandPoints points = points_of(lines);
  WorkerPool workers(2);
  TileBins bins;
  const TileGrid grid{size};
  bins.bin_segments(points, grid, 0.01f, workers);
  HeadPicture head;
  bins.bin_boxes({}, grid);
  ShadeInput shade{};
  std::vector<uint8_t> srgb(kSrgbSteps + 1);
  // Linear numbers, in two pictures: the high and the low bits.
  std::vector<uint32_t> value(size_t{size.x} * size.y * 3);
  for (const uint32_t shift : {0u, 8u}) {
    for (uint32_t i = 0; i <= kSrgbSteps; ++i) srgb[i] = static_cast<uint8_t>(i >> shift);
    std::vector<uint8_t> rgba(size_t{size.x} * size.y * 4);
    const TileInput input{&points, &bins, &head, &shade, grid, glm::vec3(0.0f), srgb.data(), rgba.data()};
    TileScratch scratch;
    for (uint32_t tile = 0; tile < grid.count(); ++tile)
      draw_tile(simd::widest_set(), {&input, &scratch, tile});
    for (size_t i = 0; i < value.size(); ++i) value[i] |= uint32_t{rgba[i / 3 * 4 + i % 3]} << shift;
  }
  std::vector<glm::vec3> pixels(size_t{size.x} * size.y);
  for (size_t i = 0; i < value.size(); ++i)
    pixels[i / 3][static_cast<int>(i % 3)] = static_cast<float>(value[i]) / kSrgbSteps;
  return pixels;
}

// The tone curve leaves values below 0.7 as they are.
constexpr float kInk = 0.5f;
constexpr float kStep = 1.0f / kSrgbSteps;

TEST(TileRaster, SummedAcrossALineCoverageIsItsWidth) {
  for (const float width : {0.0625f, 0.25f, 0.5f, 1.0f, 1.5f, 3.0f})
    for (const float angle : {0.0f, 0.2f, 0.7854f, 1.3f, 1.5708f})
      for (const float offset : {0.0f, 0.21f, 0.5f}) {
        const glm::vec2 along(std::cos(angle), std::sin(angle));
        const glm::vec2 middle = glm::vec2(48.0f) + offset * glm::vec2(-along.y, along.x);
        const float length = 60.0f;
        Line line{{middle - 0.5f * length * along, middle + 0.5f * length * along},
                  1.0f,
                  width,
                  1.0f,
                  glm::vec3(kInk)};
        const auto pixels = raster({line}, {96, 96});
        double sum = 0.0;
        for (const glm::vec3& pixel : pixels) sum += double{pixel.r} / kInk;
        // Ends are cut off at whole pixels: within half a pixel of length at each.
        EXPECT_NEAR(sum / length, width, 0.02 * width + width / length)
            << width << " px at " << angle << " rad, " << offset;
      }
}

TEST(TileRaster, AJointNeitherGapsNorBlendsTwice) {
  // Half-transparent, so that what is blended twice would show.
  Line whole{{{8.0f, 20.3f}, {88.0f, 50.3f}}, 1.0f, 2.0f, 0.5f, glm::vec3(kInk)};
  Line cut = whole;
  cut.point_px.clear();
  for (int i = 0; i <= 20; ++i)
    cut.point_px.push_back(glm::mix(whole.point_px[0], whole.point_px[1], 0.05f * static_cast<float>(i)));
  const auto one = raster({whole}, {96, 96});
  const auto many = raster({cut}, {96, 96});
  for (size_t i = 0; i < one.size(); ++i) ASSERT_NEAR(one[i].r, many[i].r, 3 * kStep) << i;

  // Round a bend no pixel has more than one layer.
  Line bend{
      {{10.0f, 10.0f}, {50.0f, 12.0f}, {60.0f, 50.0f}, {20.0f, 70.0f}}, 1.0f, 4.0f, 0.5f, glm::vec3(kInk)};
  float most = 0.0f;
  for (const glm::vec3& pixel : raster({bend}, {96, 96})) most = std::max(most, pixel.r);
  EXPECT_NEAR(most, 0.5f * kInk, 2 * kStep);
}

TEST(TileRaster, LayersBlendFrontToBackWhateverTheirOrder) {
  Line red{{{0.0f, 8.0f}, {32.0f, 8.0f}}, 1.0f, 8.0f, 0.5f, {0.5f, 0.0f, 0.0f}};
  Line blue = red;
  blue.depth_m = 2.0f;
  blue.color = {0.0f, 0.0f, 0.5f};
  for (const auto& lines : {std::vector<Line>{red, blue}, std::vector<Line>{blue, red}}) {
    const glm::vec3 pixel = raster(lines, {32, 16})[8 * 32 + 16];
    // 0.5 of red over 0.5 of blue over black, each of half light.
    EXPECT_NEAR(pixel.r, 0.25f, 2 * kStep);
    EXPECT_NEAR(pixel.g, 0.0f, 2 * kStep);
    EXPECT_NEAR(pixel.b, 0.125f, 2 * kStep);
  }
  for (const int layers : {1, 2, 5, 20, 100}) {
    std::vector<Line> lines;
    for (int i = 0; i < layers; ++i) {
      lines.push_back(red);
      lines.back().opacity = 0.25f;
      lines.back().depth_m = 1.0f + 0.01f * static_cast<float>((i * 37) % layers);
    }
    const float expected = 0.5f * static_cast<float>(1.0 - std::pow(0.75, layers));
    // Behind what is opaque to a 300th nothing is drawn.
    EXPECT_NEAR(raster(lines, {32, 16})[8 * 32 + 16].r, expected, 2 * kStep + 0.5f / 300.0f) << layers;
  }
}

// ---- impossible hair

TEST(TileRenderer, ImpossibleHairGivesAFinitePicture) {
  std::vector<SceneAsset> assets = impossible_hair();
  assets.push_back(bald(grown_hair(40)));
  assets.push_back(grown_hair(40));
  assets.back().head = {};
  for (size_t i = 0; i < assets.size(); ++i) {
    const Image image = drawn(assets[i], {}, {own_workers(2), simd::widest_set()}, {96, 64});
    ASSERT_EQ(image.rgba.size(), 96u * 64u * 4u) << i;
    // The background is there: nothing spreads over the picture.
    EXPECT_GT(image.rgba[0], 40) << i;
    EXPECT_EQ(image.rgba[3], 255) << i;
  }
}

TEST(TileRenderer, ExtremeLooksAndViewsGiveAFinitePicture) {
  const SceneAsset asset = grown_hair(60);
  LookDesc look;
  look.strand_radius_m = 0.01f;
  look.followers = 64;
  EXPECT_FALSE(drawn(asset, look, {own_workers(2), simd::widest_set()}, {320, 200}).rgba.empty());
  look = {};
  look.light_color = glm::vec3(0.0f);
  look.ambient = 0.0f;
  EXPECT_FALSE(drawn(asset, look).rgba.empty());
  for (const RenderSize size : {RenderSize{1, 1}, RenderSize{17, 3}, RenderSize{1920, 1080}}) {
    const Image image = drawn(asset, {}, {own_workers(2), simd::widest_set()}, size);
    EXPECT_EQ(image.rgba.size(), size_t{size.width} * size.height * 4);
  }
  CameraDesc inside;
  inside.offset_m = {0.0f, 0.02f, 0.001f};
  inside.target_m = {0.0f, 0.09f, 0.0f};
  EXPECT_FALSE(drawn(asset, {}, {own_workers(2), simd::widest_set()}, {160, 120}, inside).rgba.empty());
}

TEST(TileRenderer, RefusesWhatDoesNotFit) {
  SceneAsset asset = grown_hair(40);
  auto renderer = make_tile_renderer(asset, {});
  ASSERT_TRUE(renderer);
  EXPECT_FALSE((*renderer)->draw({{}, {}}, {}, {64, 64}));
  EXPECT_FALSE((*renderer)->draw({{}, asset.rest_position_m}, {}, {0, 64}));
  EXPECT_FALSE((*renderer)->draw({{}, asset.rest_position_m}, {}, {100'000, 64}));
  asset.triangle.push_back({0, 1, 40});
  EXPECT_FALSE(make_tile_renderer(asset, {}));
}

// Halves of the renderer are IEEE halves: every one of them comes back as what the format says.
TEST(TileRenderer, HalvesAreExact) {
  for (uint32_t bits = 0; bits < 0x7c00u; ++bits) {
    const int exponent = static_cast<int>(bits >> 10);
    const double mantissa = static_cast<double>(bits & 0x3ff) / 1024.0;
    const double expected =
        exponent == 0 ? std::ldexp(mantissa, -14) : std::ldexp(1.0 + mantissa, exponent - 15);
    ASSERT_EQ(float_of_half(static_cast<uint16_t>(bits)), static_cast<float>(expected)) << bits;
    ASSERT_EQ(float_of_half(static_cast<uint16_t>(bits | 0x8000u)), -static_cast<float>(expected)) << bits;
  }
}

}  // namespace
}  // namespace strandcast::tile_renderer_test
