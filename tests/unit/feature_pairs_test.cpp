// Two features of a scene together: each of them still acts, hair keeps its length and stays out of what it
// meets, and the same walk leads to the same bits.
#include "tests/support/stepped_hair.h"

#include <gmock/gmock.h>

#include <set>

namespace strandcast::feature_pairs_test {
namespace {

struct Feature {
  const char* name;
  void (*add)(SceneDesc& scene);
};

const std::vector<Feature>& features() {
  static const std::vector<Feature> all = {
      {"wind",
       [](SceneDesc& scene) {
         scene.wind.mean_mps = {3.0f, 0.0f, 1.0f};
       }},
      {"gusts",
       [](SceneDesc& scene) {
         scene.wind.mean_mps = {3.0f, 0.0f, 1.0f};
         scene.wind.gust_intensity = 0.5f;
       }},
      {"oriented drag", [](SceneDesc& scene) { scene.wind.along_share = 0.3f; }},
      {"friction", [](SceneDesc& scene) { scene.volume.friction_per_s = 20.0; }},
      {"bend limit",
       [](SceneDesc& scene) { scene.bend_limit.most_root_deg = scene.bend_limit.most_tip_deg = 8.0; }},
      {"follicle limit", [](SceneDesc& scene) { scene.follicle_limit_deg = 5.0; }},
      {"spheres",
       [](SceneDesc& scene) {
         scene.colliders = {{glm::vec3(0.0f, -0.02f, 0.0f), 0.14f}};
       }},
      {"field",
       [](SceneDesc& scene) { scene.has_auto_collider = true, scene.head.collider = kFieldCollider; }},
      {"capsules",
       [](SceneDesc& scene) {
         scene.body.capsules = {{kJoint, kJoint, {}, {}, 0.09f, 0.09f}};
       }},
      {"substeps", [](SceneDesc& scene) { scene.substeps = 2; }},
  };
  return all;
}

/// Beside the second of these the first says nothing.
const std::set<std::pair<std::string, std::string>> kMeaningless = {
    {"wind", "gusts"},  // which have a mean
};

SceneDesc bare_scene() {
  SceneDesc scene = stepped_scene(40, 8);
  scene.wind = {};
  scene.volume = {};
  scene.bend_limit = {};
  scene.detail = {};
  scene.body = {};
  scene.colliders.clear();
  scene.head.collider = kSphereCollider;
  scene.head.field_resolution = 16;
  scene.has_auto_collider = false;
  scene.follicle_limit_deg = 180.0;
  scene.substeps = 1;
  return scene;
}

/// To fit the head takes long: it is as a sphere, or as a field.
const SceneContent& content_of(const SceneDesc& scene) {
  static std::map<std::string, SceneContent> known;
  auto found = known.find(scene.head.collider);
  if (found == known.end()) {
    auto content = load_scene_content(scene);
    EXPECT_TRUE(content) << content.error().to_string();
    found = known.emplace(scene.head.collider, std::move(content).value()).first;
  }
  return found->second;
}

uint64_t hash_of_a_second(const SceneDesc& scene) {
  SceneContent content = content_of(scene);
  content.colliders = colliders_of(scene, content.head_colliders);
  SteppedHair hair(scene, std::move(content));
  hair.settle(59);
  const SteppedState state = hair.step();
  const std::vector<glm::vec3>& rest = hair.rest_in_head_m();
  const size_t strands = hair.strand_count();
  double stretch = 0.0;
  for (size_t i = strands; i < rest.size(); ++i) {
    const double length = glm::distance(rest[i], rest[i - strands]);
    const auto& now = state.position_in_head_m;
    stretch = std::fmax(stretch, std::abs(glm::distance(now[i], now[i - strands]) / length - 1.0));
  }
  EXPECT_LT(stretch, 1e-4);
  return state_hash(state.snapshot);
}

TEST(FeaturePairs, EachStillActsBesideEachOther) {
  std::map<std::string, uint64_t> alone;
  for (const Feature& feature : features()) {
    SceneDesc scene = bare_scene();
    feature.add(scene);
    alone[feature.name] = hash_of_a_second(scene);
    EXPECT_NE(alone[feature.name], hash_of_a_second(bare_scene())) << feature.name << " does nothing";
  }
  for (size_t i = 0; i < features().size(); ++i) {
    for (size_t k = 0; k < i; ++k) {
      const Feature &first = features()[k], &second = features()[i];
      SCOPED_TRACE(std::string(first.name) + " with " + second.name);
      SceneDesc scene = bare_scene();
      first.add(scene);
      second.add(scene);
      const uint64_t both = hash_of_a_second(scene);
      EXPECT_EQ(both, hash_of_a_second(scene)) << "once more";
      EXPECT_NE(both, alone[first.name]) << second.name << " does nothing";
      const bool is_meaningless = kMeaningless.contains({first.name, second.name});
      EXPECT_EQ(both == alone[second.name], is_meaningless) << first.name << " does nothing";
    }
  }
}

}  // namespace
}  // namespace strandcast::feature_pairs_test
