#include "common/scene/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace strandcast {
namespace {

constexpr double kFreeFollicleDeg = 180.0;

/// Whether what is simulated lacks what this level leaves out. Where nothing is, the rest stays as it is.
bool leaves_out(const RuntimeFacts& facts, DetailLevel level) {
  return facts.detail >= level && facts.detail != DetailLevel::FollowHead;
}

// Facts carry their cause, so that analyse() and explain() cannot disagree.
Fact decide_wind(const SceneDesc& scene, const RuntimeFacts& facts) {
  if (scene.hair.wind == 0.0) return {false, "hair.wind is zero: the air is still"};
  if (facts.has_wind_stream) return {true, "a wind stream is connected"};
  if (scene.wind.mean_mps != glm::vec3(0.0f)) return {true, "wind.mean_mps is not zero"};
  return {false, "wind.mean_mps is zero and no wind stream is connected"};
}

Fact decide_turbulence(const SceneDesc& scene, const RuntimeFacts& facts) {
  if (scene.hair.wind == 0.0) return {false, "hair.wind is zero: the air is still"};
  if (facts.has_wind_stream)
    return {false, "a wind stream replaces the scene's gusts and is the same over the head"};
  if (scene.wind.mean_mps == glm::vec3(0.0f))
    return {false, "wind.mean_mps is zero, and gusts are relative to it"};
  if (scene.wind.gust_intensity <= 0.0f) return {false, "wind.gust_intensity is zero"};
  return {true, "wind.gust_intensity is above zero"};
}

Fact decide_colliders(const SceneDesc& scene, const RuntimeFacts&) {
  if (!scene.colliders.empty()) return {true, "the scene lists colliders"};
  if (scene.has_auto_collider && scene.head.collider == kFieldCollider)
    return {false, "the scene lists no colliders, and head.collider is field"};
  if (scene.has_auto_collider) return {true, "has_auto_collider makes the head as it is drawn collide"};
  return {false, "the scene lists no colliders and has_auto_collider is false"};
}

Fact decide_follicle_limit(const SceneDesc& scene, const RuntimeFacts&) {
  if (scene.follicle_limit_deg < kFreeFollicleDeg) return {true, "follicle_limit_deg is below 180"};
  return {false, "follicle_limit_deg is 180: roots are free"};
}

Fact decide_bend_limit(const SceneDesc& scene, const RuntimeFacts&) {
  if (scene.bend_limit.acts()) return {true, "bend_limit leaves less than 0 to 180 degrees"};
  return {false, "bend_limit leaves 0 to 180 degrees: segments bend freely"};
}

Fact decide_oriented_drag(const SceneDesc& scene, const RuntimeFacts& facts) {
  if (scene.volume.air.acts && !leaves_out(facts, DetailLevel::NoHairHair))
    return {false, "air.acts is true, and goes by the direction of hair itself"};
  if (scene.wind.along_share < 1.0f) return {true, "wind.along_share is below 1"};
  return {false, "wind.along_share is 1: air drags hair alike in all directions"};
}

Fact decide_volume(const SceneDesc& scene, const RuntimeFacts& facts) {
  if (scene.volume.acts() && leaves_out(facts, DetailLevel::NoHairHair)) return {false, facts.detail_reason};
  if (scene.volume.friction_per_s * scene.hair.friction > 0.0)
    return {true, "volume.friction_per_s is above zero"};
  if (scene.volume.repulsion_per_s2 > 0.0) return {true, "volume.repulsion_per_s2 is above zero"};
  if (scene.volume.target_per_s2 > 0.0) return {true, "volume.target_per_s2 is above zero"};
  if (scene.volume.wind_width_m > 0.0) return {true, "volume.wind_width_m is above zero"};
  if (scene.volume.air.acts) return {true, "air.acts is true"};
  return {false,
          "volume has no friction, repulsion, target or wind_width, and air does not act: hair passes "
          "through hair"};
}

Fact decide_distance_field(const SceneDesc& scene, const RuntimeFacts&) {
  if (scene.head.collider != kFieldCollider) return {false, "head.collider is spheres"};
  if (!scene.has_auto_collider) return {false, "has_auto_collider is false: the head does not collide"};
  return {true, "head.collider is field"};
}

Fact decide_followed_strands(const SceneDesc& scene, const RuntimeFacts& facts) {
  if (simulated_share(scene, facts) >= 1.0) return {false, "every strand is simulated"};
  const bool is_far = leaves_out(facts, DetailLevel::FewerStrands);
  return {true, is_far ? facts.detail_reason : "detail.simulated_share is below 1"};
}

Fact decide_fewer_vertices(const SceneDesc&, const RuntimeFacts& facts) {
  if (!leaves_out(facts, DetailLevel::FewerVertices)) return {false, "every vertex is simulated"};
  return {true, facts.detail_reason};
}

Fact decide_half_rate(const SceneDesc& scene, const RuntimeFacts& facts) {
  if (!leaves_out(facts, DetailLevel::HalfRate)) return {false, "every step is simulated"};
  if (scene.step_rate_hz < kLeastHalvedRateHz) return {false, "step_rate_hz is too low to be halved"};
  return {true, facts.detail_reason};
}

Fact decide_carried(const SceneDesc&, const RuntimeFacts& facts) {
  if (facts.detail < DetailLevel::FollowHead) return {false, "hair is simulated"};
  return {true, facts.detail_reason};
}

Fact decide_body(const SceneDesc& scene, const RuntimeFacts&) {
  if (scene.body.preset != kNoBody) return {true, "body.preset is " + scene.body.preset};
  if (scene.body.acts()) return {true, "the scene lists capsules or planes of a body"};
  return {false, "body has no preset, capsules or planes"};
}

Fact decide_strand_viewers(const SceneDesc&, const RuntimeFacts& facts) {
  if (facts.strand_viewers > 0) return {true, "a viewer receives strands"};
  return {false, "no viewer receives strands"};
}

Fact decide_frame_viewers(const SceneDesc&, const RuntimeFacts& facts) {
  if (facts.frame_viewers > 0) return {true, "a viewer receives rendered frames"};
  return {false, "no viewer receives rendered frames"};
}

Fact decide_strands(const SceneAsset& asset) {
  if (asset.strand_count > 0) return {true, "the groom has strands"};
  return {false, "the groom has no strands"};
}

Fact decide_followers(const SceneAsset& asset, const LookDesc& look) {
  if (look.followers == 0) return {false, "look.followers is zero"};
  if (asset.triangle.empty()) return {false, "no three roots are neighbours"};
  return {true, "look.followers is above zero"};
}

Fact decide_head_mesh(const SceneAsset& asset) {
  if (!asset.head.triangle.empty()) return {true, "the scene shows a head (head.is_visible)"};
  return {false, "the scene has no head mesh (head.is_visible)"};
}

/// A fact that follows from which method of one kind is drawn.
Fact decide_method(const Fact& has_strands, const char* kind, const std::string& chosen, bool is_it) {
  if (!has_strands.value) return has_strands;
  return {is_it, fmt::format("look.methods.{} is {}", kind, chosen)};
}

struct FactRow {
  const char* name;
  bool SceneFeatures::*member;
  Fact (*decide)(const SceneDesc&, const RuntimeFacts&);
};

constexpr std::array kFacts{
    FactRow{"has_wind", &SceneFeatures::has_wind, decide_wind},
    FactRow{"has_turbulence", &SceneFeatures::has_turbulence, decide_turbulence},
    FactRow{"has_colliders", &SceneFeatures::has_colliders, decide_colliders},
    FactRow{"has_follicle_limit", &SceneFeatures::has_follicle_limit, decide_follicle_limit},
    FactRow{"has_bend_limit", &SceneFeatures::has_bend_limit, decide_bend_limit},
    FactRow{"has_oriented_drag", &SceneFeatures::has_oriented_drag, decide_oriented_drag},
    FactRow{"has_volume", &SceneFeatures::has_volume, decide_volume},
    FactRow{"has_distance_field", &SceneFeatures::has_distance_field, decide_distance_field},
    FactRow{"has_followed_strands", &SceneFeatures::has_followed_strands, decide_followed_strands},
    FactRow{"has_fewer_vertices", &SceneFeatures::has_fewer_vertices, decide_fewer_vertices},
    FactRow{"has_half_rate", &SceneFeatures::has_half_rate, decide_half_rate},
    FactRow{"is_carried", &SceneFeatures::is_carried, decide_carried},
    FactRow{"has_body", &SceneFeatures::has_body, decide_body},
    FactRow{"has_strand_viewers", &SceneFeatures::has_strand_viewers, decide_strand_viewers},
    FactRow{"has_frame_viewers", &SceneFeatures::has_frame_viewers, decide_frame_viewers},
};
static_assert(sizeof(SceneFeatures) == kFacts.size(), "every fact has a row");

Fact decide(const FactRow& row, const SceneDesc& scene, const RuntimeFacts& facts) {
  Fact fact = row.decide(scene, facts);
  if (!fact.value && std::find(facts.forced.begin(), facts.forced.end(), row.name) != facts.forced.end())
    fact = {true, fmt::format("forced, though {}", fact.reason)};
  return fact;
}

}  // namespace

SceneFeatures analyse(const SceneDesc& scene, const RuntimeFacts& facts) {
  SceneFeatures features;
  for (const FactRow& row : kFacts) features.*row.member = decide(row, scene, facts).value;
  return features;
}

const char* to_string(DetailLevel level) {
  constexpr std::array kNames{"full",           "no hair-hair", "fewer strands",
                              "fewer vertices", "half rate",    "follow the head"};
  static_assert(kNames.size() == kDetailLevels);
  return kNames[static_cast<size_t>(level)];
}

double simulated_share(const SceneDesc& scene, const RuntimeFacts& facts) {
  const DetailDesc& detail = scene.detail;
  if (!leaves_out(facts, DetailLevel::FewerStrands)) return detail.simulated_share;
  return std::min(detail.simulated_share, detail.far_share);
}

std::vector<FeatureReason> explain(const SceneDesc& scene, const RuntimeFacts& facts) {
  std::vector<FeatureReason> reasons;
  for (const FactRow& row : kFacts) {
    const Fact decision = decide(row, scene, facts);
    reasons.push_back({row.name, decision.value, decision.reason});
  }
  return reasons;
}

PictureFeatures analyse_picture(const SceneAsset& asset, const LookDesc& look) {
  PictureFeatures features;
  features.has_strands = decide_strands(asset);
  features.has_followers = decide_followers(asset, look);
  features.has_head_mesh = decide_head_mesh(asset);
  const RenderMethodsDesc& methods = look.methods;
  features.shading = shading_models().at(methods.shading);
  features.scattering = scattering_models().at(methods.scattering);
  const auto decide = [&](const char* kind, const std::string& chosen, bool is_it) {
    return decide_method(features.has_strands, kind, chosen, is_it);
  };
  features.has_lobe_tables = decide("shading", methods.shading, features.shading == ShadingModel::Marschner);
  features.has_scatter_tables =
      decide("scattering", methods.scattering, features.scattering == ScatteringModel::Dual);
  features.has_density_normals =
      decide("scattering", methods.scattering, features.scattering == ScatteringModel::Isosurface);
  features.is_shaded_per_fragment = decide("evaluation", methods.evaluation,
                                           shading_places().at(methods.evaluation) == ShadingPlace::Fragment);
  return features;
}

std::vector<FeatureReason> explain(const PictureFeatures& features) {
  const auto row = [](const char* name, const Fact& fact) {
    return FeatureReason{name, fact.value, fact.reason};
  };
  return {row("has_strands", features.has_strands),
          row("has_followers", features.has_followers),
          row("has_head_mesh", features.has_head_mesh),
          row("has_lobe_tables", features.has_lobe_tables),
          row("has_scatter_tables", features.has_scatter_tables),
          row("has_density_normals", features.has_density_normals),
          row("is_shaded_per_fragment", features.is_shaded_per_fragment)};
}

}  // namespace strandcast
