#include "common/scene/features.h"

#include <array>

namespace strandcast {
namespace {

/// A fact's value with its cause, so that analyse() and explain() cannot disagree.
struct Decision {
  bool value = false;
  const char* reason = "";
};

Decision decide_wind(const SceneDesc& scene, const RuntimeFacts& facts) {
  if (facts.has_wind_stream) return {true, "a wind stream is connected"};
  if (scene.wind.mean_mps != glm::vec3(0.0f)) return {true, "wind.mean_mps is not zero"};
  return {false, "wind.mean_mps is zero and no wind stream is connected"};
}

Decision decide_turbulence(const SceneDesc& scene, const RuntimeFacts& facts) {
  if (facts.has_wind_stream)
    return {false, "a wind stream replaces the scene's gusts and is the same over the head"};
  if (scene.wind.mean_mps == glm::vec3(0.0f))
    return {false, "wind.mean_mps is zero, and gusts are relative to it"};
  if (scene.wind.gust_intensity <= 0.0f) return {false, "wind.gust_intensity is zero"};
  return {true, "wind.gust_intensity is above zero"};
}

Decision decide_colliders(const SceneDesc& scene, const RuntimeFacts&) {
  if (!scene.colliders.empty()) return {true, "the scene lists colliders"};
  if (scene.has_auto_collider) return {true, "has_auto_collider fits one sphere to the roots"};
  return {false, "the scene lists no colliders and has_auto_collider is false"};
}

Decision decide_strand_viewers(const SceneDesc&, const RuntimeFacts& facts) {
  if (facts.strand_viewers > 0) return {true, "a viewer receives strands"};
  return {false, "no viewer receives strands"};
}

Decision decide_frame_viewers(const SceneDesc&, const RuntimeFacts& facts) {
  if (facts.frame_viewers > 0) return {true, "a viewer receives rendered frames"};
  if (facts.is_recording_pictures) return {true, "pictures are being recorded"};
  return {false, "no viewer receives rendered frames and no pictures are recorded"};
}

Decision decide_followers(const SceneDesc& scene, const RuntimeFacts&) {
  if (scene.look.followers > 0) return {true, "look.followers is above zero"};
  return {false, "look.followers is zero"};
}

Decision decide_head_mesh(const SceneDesc& scene, const RuntimeFacts&) {
  if (!scene.head.is_visible) return {false, "head.is_visible is false"};
  if (scene.head.mesh_path.empty()) return {true, "head.is_visible is true (built-in head)"};
  return {true, "head.is_visible is true (head.mesh_path)"};
}

struct FactRow {
  const char* name;
  bool SceneFeatures::*member;
  Decision (*decide)(const SceneDesc&, const RuntimeFacts&);
};

constexpr std::array kFacts{
    FactRow{"has_wind", &SceneFeatures::has_wind, decide_wind},
    FactRow{"has_turbulence", &SceneFeatures::has_turbulence, decide_turbulence},
    FactRow{"has_colliders", &SceneFeatures::has_colliders, decide_colliders},
    FactRow{"has_strand_viewers", &SceneFeatures::has_strand_viewers, decide_strand_viewers},
    FactRow{"has_frame_viewers", &SceneFeatures::has_frame_viewers, decide_frame_viewers},
    FactRow{"has_followers", &SceneFeatures::has_followers, decide_followers},
    FactRow{"has_head_mesh", &SceneFeatures::has_head_mesh, decide_head_mesh},
};
static_assert(sizeof(SceneFeatures) == kFacts.size(), "every fact has a row");

}  // namespace

SceneFeatures analyse(const SceneDesc& scene, const RuntimeFacts& facts) {
  SceneFeatures features;
  for (const FactRow& row : kFacts) features.*row.member = row.decide(scene, facts).value;
  return features;
}

std::vector<FeatureReason> explain(const SceneDesc& scene, const RuntimeFacts& facts) {
  std::vector<FeatureReason> reasons;
  for (const FactRow& row : kFacts) {
    const Decision decision = row.decide(scene, facts);
    reasons.push_back({row.name, decision.value, decision.reason});
  }
  return reasons;
}

}  // namespace strandcast
