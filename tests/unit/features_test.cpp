#include "common/scene/features.h"

#include <random>
#include <utility>

namespace strandcast::features_test {
namespace {

TEST(Features, EmptySceneNeedsNothing) {
  SceneDesc scene;
  scene.has_auto_collider = false;
  scene.follicle_limit_deg = 180.0;
  EXPECT_EQ(analyse(scene, {}), SceneFeatures{});
}

TEST(Features, EachFactFollowsItsOwnCause) {
  SceneDesc scene;
  EXPECT_TRUE(analyse(scene, {}).has_colliders);
  scene.has_auto_collider = false;
  EXPECT_FALSE(analyse(scene, {}).has_colliders);
  scene.colliders.resize(1);
  EXPECT_TRUE(analyse(scene, {}).has_colliders);
  scene.head.collider = kFieldCollider;
  EXPECT_FALSE(analyse(scene, {}).has_distance_field) << "the head does not collide";
  scene.has_auto_collider = true;
  EXPECT_TRUE(analyse(scene, {}).has_distance_field);
  EXPECT_TRUE(analyse(scene, {}).has_colliders) << "the scene's own, beside the head";
  scene.colliders.clear();
  EXPECT_FALSE(analyse(scene, {}).has_colliders) << "no spheres where the head is a field";
  scene.head.collider = kSphereCollider;
  EXPECT_FALSE(analyse(scene, {}).has_distance_field);
  EXPECT_TRUE(analyse(scene, {}).has_colliders);

  scene.wind.gust_intensity = 1.0f;
  EXPECT_FALSE(analyse(scene, {}).has_wind) << "gusts are relative to the mean";
  EXPECT_FALSE(analyse(scene, {}).has_turbulence);
  scene.wind.mean_mps = {0, 0, 0.1f};
  EXPECT_TRUE(analyse(scene, {}).has_wind);
  EXPECT_TRUE(analyse(scene, {}).has_turbulence);
  EXPECT_FALSE(analyse(scene, {.has_wind_stream = true}).has_turbulence)
      << "a stream replaces the scene's wind";
  scene.wind = {};
  EXPECT_TRUE(analyse(scene, {.has_wind_stream = true}).has_wind);

  EXPECT_TRUE(analyse(scene, {}).has_follicle_limit);
  scene.follicle_limit_deg = 179.0;
  EXPECT_TRUE(analyse(scene, {}).has_follicle_limit);
  scene.follicle_limit_deg = 180.0;
  EXPECT_FALSE(analyse(scene, {}).has_follicle_limit);

  EXPECT_FALSE(analyse(scene, {}).has_bend_limit);
  scene.bend_limit.most_tip_deg = 90.0;
  EXPECT_TRUE(analyse(scene, {}).has_bend_limit);
  EXPECT_FALSE(analyse(scene, {}).has_volume);
  scene.volume.friction_per_s = 1.0;
  EXPECT_TRUE(analyse(scene, {}).has_volume);
  scene.volume = {};
  scene.volume.repulsion_per_s2 = 1.0;
  EXPECT_TRUE(analyse(scene, {}).has_volume);
  scene.volume = {};
  scene.volume.target_per_s2 = 1.0;
  EXPECT_TRUE(analyse(scene, {}).has_volume);
  scene.volume = {};
  scene.volume.wind_width_m = 1e-3;
  EXPECT_TRUE(analyse(scene, {}).has_volume);
  scene.volume = {};
  scene.volume.air.acts = true;
  EXPECT_TRUE(analyse(scene, {}).has_volume);
  scene.wind.along_share = 0.5f;
  EXPECT_FALSE(analyse(scene, {}).has_oriented_drag) << "air goes by the direction itself";
  scene.volume = {};
  EXPECT_TRUE(analyse(scene, {}).has_oriented_drag);
  scene.wind.along_share = 1.0f;

  EXPECT_TRUE(analyse(scene, {.strand_viewers = 1}).has_strand_viewers);
  EXPECT_FALSE(analyse(scene, {.strand_viewers = 1}).has_frame_viewers);
  EXPECT_TRUE(analyse(scene, {.frame_viewers = 2}).has_frame_viewers);
}

TEST(Features, WhatThereIsToDrawFollowsFromAssetAndLook) {
  SceneAsset asset;
  LookDesc look;
  look.followers = 3;
  const auto facts = [&] {
    const PictureFeatures features = analyse_picture(asset, look);
    return std::vector<bool>{features.has_strands.value, features.has_followers.value,
                             features.has_head_mesh.value};
  };
  EXPECT_EQ(facts(), (std::vector<bool>{false, false, false}));
  asset.strand_count = 3;
  EXPECT_EQ(facts(), (std::vector<bool>{true, false, false})) << "followers need triangles of roots";
  asset.triangle = {{0, 1, 2}};
  asset.head.triangle = {{0, 1, 2}};
  EXPECT_EQ(facts(), (std::vector<bool>{true, true, true}));
  const auto on = explain(analyse_picture(asset, look));
  look.followers = 0;
  EXPECT_EQ(facts(), (std::vector<bool>{true, false, true}));
  const auto off = explain(analyse_picture({}, look));
  constexpr size_t kOfContents = 3;  // the others are of methods
  ASSERT_EQ(on.size(), 7u);
  for (size_t i = 0; i < on.size(); ++i) {
    EXPECT_TRUE(on[i].value == (i < kOfContents) && !off[i].value) << on[i].name;
    EXPECT_EQ(on[i].name, off[i].name);
    EXPECT_NE(on[i].reason, off[i].reason) << on[i].name;
  }
}

TEST(Features, TablesAndNormalsAreOnlyForTheMethodsThatReadThem) {
  SceneAsset asset;
  asset.strand_count = 3;
  LookDesc look;
  const auto facts = [&] {
    const PictureFeatures features = analyse_picture(asset, look);
    return std::vector<bool>{features.has_lobe_tables.value, features.has_scatter_tables.value,
                             features.has_density_normals.value, features.is_shaded_per_fragment.value};
  };
  const std::vector<bool> nothing(4, false);
  for (const MethodRow& row : shading_models().rows()) {
    look.methods.shading = row.name;
    EXPECT_EQ(facts(), (std::vector<bool>{row.name == "marschner", false, false, false})) << row.name;
  }
  look = {};
  for (const MethodRow& row : scattering_models().rows()) {
    look.methods.scattering = row.name;
    EXPECT_EQ(facts(), (std::vector<bool>{false, row.name == "dual", row.name == "isosurface", false}))
        << row.name;
  }
  look.methods = {"marschner", "dual", "fragment"};
  EXPECT_EQ(facts(), (std::vector<bool>{true, true, false, true}));
  EXPECT_EQ(explain(analyse_picture(asset, look)).at(3).reason, "look.methods.shading is marschner");
  asset.strand_count = 0;
  EXPECT_EQ(facts(), nothing) << "there is nothing to shade";
}

TEST(Features, ExplainAgreesWithAnalyse) {
  std::mt19937 random(3);
  const auto coin = [&] { return random() % 2 == 0; };
  for (int round = 0; round < 500; ++round) {
    SceneDesc scene;
    scene.has_auto_collider = coin();
    scene.colliders.resize(coin() ? 0 : 2);
    scene.wind.mean_mps.x = coin() ? 0.0f : 1.0f;
    scene.wind.gust_intensity = coin() ? 0.0f : 0.5f;
    scene.follicle_limit_deg = coin() ? 180.0 : 20.0;
    scene.bend_limit.least_root_deg = coin() ? 0.0 : 5.0;
    scene.wind.along_share = coin() ? 1.0f : 0.5f;
    if (coin()) scene.body.preset = kUpperBody;
    scene.body.planes.resize(coin() ? 0 : 1);
    scene.volume.friction_per_s = coin() ? 0.0 : 20.0;
    scene.volume.repulsion_per_s2 = coin() ? 0.0 : 5.0;
    scene.head.collider = coin() ? kSphereCollider : kFieldCollider;
    scene.detail.simulated_share = coin() ? 1.0 : 0.5;
    const auto level = static_cast<DetailLevel>(random() % kDetailLevels);
    const RuntimeFacts facts{coin(), coin() ? 0u : 1u, coin() ? 0u : 2u, level, "it is far away"};
    const SceneFeatures features = analyse(scene, facts);
    SceneFeatures explained;
    const std::map<std::string, bool*> fact{{"has_wind", &explained.has_wind},
                                            {"has_turbulence", &explained.has_turbulence},
                                            {"has_colliders", &explained.has_colliders},
                                            {"has_follicle_limit", &explained.has_follicle_limit},
                                            {"has_bend_limit", &explained.has_bend_limit},
                                            {"has_oriented_drag", &explained.has_oriented_drag},
                                            {"has_volume", &explained.has_volume},
                                            {"has_distance_field", &explained.has_distance_field},
                                            {"has_followed_strands", &explained.has_followed_strands},
                                            {"has_fewer_vertices", &explained.has_fewer_vertices},
                                            {"has_half_rate", &explained.has_half_rate},
                                            {"is_carried", &explained.is_carried},
                                            {"has_body", &explained.has_body},
                                            {"has_strand_viewers", &explained.has_strand_viewers},
                                            {"has_frame_viewers", &explained.has_frame_viewers}};
    const auto reasons = explain(scene, facts);
    ASSERT_EQ(reasons.size(), fact.size());
    for (const FeatureReason& reason : reasons) {
      ASSERT_TRUE(fact.contains(reason.name)) << reason.name;
      *fact.at(reason.name) = reason.value;
      EXPECT_FALSE(reason.reason.empty()) << reason.name;
    }
    EXPECT_EQ(explained, features);
  }
}

TEST(Features, ReasonsDifferWithTheValue) {
  SceneDesc bare;
  bare.has_auto_collider = false;
  bare.follicle_limit_deg = 180.0;
  SceneDesc full;
  full.wind = {.mean_mps = {1, 0, 0}, .gust_intensity = 1, .along_share = 0.5f};
  full.volume.friction_per_s = 1.0;
  full.bend_limit.most_root_deg = 30.0;
  full.head.collider = kFieldCollider;
  full.body.preset = kUpperBody;
  full.colliders.resize(1);
  full.detail.simulated_share = 0.5;
  const auto off = explain(bare, {});
  const auto on = explain(full, {.strand_viewers = 1,
                                 .frame_viewers = 1,
                                 .detail = DetailLevel::FollowHead,
                                 .detail_reason = "nobody reads",
                                 .forced = {"has_half_rate", "has_fewer_vertices"}});
  for (size_t i = 0; i < off.size(); ++i) {
    EXPECT_FALSE(off[i].value) << off[i].name;
    EXPECT_TRUE(on[i].value) << on[i].name;
    EXPECT_NE(off[i].reason, on[i].reason) << on[i].name;
  }
}

TEST(Features, EachLevelOfDetailLeavesOutWhatTheOneBeforeDoes) {
  SceneDesc scene;
  scene.volume.friction_per_s = 1.0;
  const auto at = [&](DetailLevel level) {
    return analyse(scene, {.detail = level, .detail_reason = "it is far away"});
  };
  const SceneFeatures full = at(DetailLevel::Full), alone = at(DetailLevel::NoHairHair);
  EXPECT_TRUE(full.has_volume);
  EXPECT_FALSE(alone.has_volume || alone.has_followed_strands);
  const SceneFeatures fewer = at(DetailLevel::FewerStrands), half = at(DetailLevel::HalfRate);
  EXPECT_TRUE(fewer.has_followed_strands && !fewer.has_volume && !fewer.has_half_rate);
  const SceneFeatures sparse = at(DetailLevel::FewerVertices);
  EXPECT_FALSE(fewer.has_fewer_vertices);
  EXPECT_TRUE(sparse.has_followed_strands && sparse.has_fewer_vertices && !sparse.has_half_rate);
  EXPECT_TRUE(half.has_fewer_vertices);
  EXPECT_TRUE(half.has_followed_strands && !half.has_volume && half.has_half_rate && !half.is_carried);
  // What takes no step is not made anew either.
  SceneFeatures carried = at(DetailLevel::FollowHead);
  EXPECT_TRUE(std::exchange(carried.is_carried, false));
  EXPECT_EQ(carried, full);

  EXPECT_EQ(simulated_share(scene, {}), 1.0);
  EXPECT_EQ(simulated_share(scene, {.detail = DetailLevel::HalfRate}), scene.detail.far_share);
  scene.detail.simulated_share = 0.1;
  EXPECT_EQ(simulated_share(scene, {.detail = DetailLevel::HalfRate}), 0.1) << "no more than close by";
  scene.step_rate_hz = 0.9 * kLeastHalvedRateHz;
  EXPECT_FALSE(at(DetailLevel::HalfRate).has_half_rate) << "too rare to be shown smoothly";
}

// For measurements: nothing but the named fact changes, and it says so.
TEST(Features, AForcedFactHoldsAndSaysThatItIsForced) {
  SceneDesc bare;
  bare.has_auto_collider = false;
  bare.follicle_limit_deg = 180.0;
  const RuntimeFacts facts{.forced = {"has_bend_limit"}};
  SceneFeatures features = analyse(bare, facts);
  EXPECT_TRUE(std::exchange(features.has_bend_limit, false));
  EXPECT_EQ(features, analyse(bare, {}));
  for (const FeatureReason& reason : explain(bare, facts))
    EXPECT_EQ(reason.reason.starts_with("forced"), reason.name == "has_bend_limit") << reason.name;
}

}  // namespace
}  // namespace strandcast::features_test
