#include "server/app/pass_table.h"

#include <algorithm>
#include <map>
#include <utility>

#include "server/sim/solver.h"

namespace strandcast {
namespace {

constexpr uint64_t kVec4Bytes = 16;
constexpr uint64_t kVec3Bytes = 12;
constexpr uint64_t kPixelBytes = 4;
constexpr uint64_t kSamples = 4;           // of the multisampled picture
constexpr uint64_t kColorDepthBytes = 12;  // per sample: half-float colour and depth

/// What the passes hand to one another, by name.
class ResourceTable {
 public:
  ResourceTable(const SceneDesc& scene, const SceneAsset& asset);
  const gl::Resource* operator[](const std::string& name) const { return by_name_.at(name); }
  std::vector<std::unique_ptr<gl::Resource>> take() { return std::move(resources_); }

 private:
  void add(const char* name, uint64_t size_bytes) {
    resources_.push_back(std::make_unique<gl::Resource>(name, size_bytes));
    by_name_[name] = resources_.back().get();
  }
  std::vector<std::unique_ptr<gl::Resource>> resources_;
  std::map<std::string, const gl::Resource*> by_name_;
};

ResourceTable::ResourceTable(const SceneDesc& scene, const SceneAsset& asset) {
  const uint64_t vertices = uint64_t{asset.strand_count} * asset.vertex_count;
  const uint64_t drawn_strands = asset.strand_count + uint64_t{scene.look.followers} * asset.triangle.size();
  const uint64_t drawn_points = drawn_strands * (uint64_t{asset.vertex_count - 1} * scene.look.segments + 1);
  const uint64_t pixels = uint64_t{scene.stream.frame_width} * scene.stream.frame_height;
  const uint64_t colliders = std::max<uint64_t>(scene.colliders.size(), scene.has_auto_collider ? 1 : 0);
  add("wind", kVec4Bytes);
  add("gusts", kMaxGustWaves * 2 * kVec4Bytes);
  add("colliders", colliders * kVec4Bytes);
  add("rest shape", vertices * kVec4Bytes);
  add("strand state", 2 * vertices * kVec4Bytes);
  add("state on the host", 2 * vertices * kVec3Bytes);
  add("snapshot", vertices * kVec3Bytes);
  add("strand frames", vertices * kVec3Bytes);
  add("decoded snapshot", vertices * 2 * kVec3Bytes);
  add("expanded strands", drawn_points * kVec4Bytes);
  add("head mesh", asset.head.position_m.size() * 2 * kVec3Bytes + asset.head.triangle.size() * kVec3Bytes);
  add("picture", pixels * kSamples * kColorDepthBytes);
  add("resolved picture", pixels * kPixelBytes);
  add("jpeg frames", pixels * kPixelBytes);
}

/// A pass that runs only under a fact, with the fact's own words when it does not hold.
gl::PassDeclaration under_fact(gl::PassDeclaration pass, const std::vector<FeatureReason>& reasons,
                               const std::string& fact) {
  for (const FeatureReason& reason : reasons) {
    if (reason.name != fact) continue;
    pass.is_enabled = reason.value;
    pass.disabled_reason = reason.reason;
  }
  return pass;
}

}  // namespace

Result<ServerPlan> make_server_plan(const SceneDesc& scene, const SceneAsset& asset,
                                    const RuntimeFacts& facts) {
  ServerPlan plan;
  ResourceTable table(scene, asset);
  std::vector<FeatureReason> reasons = explain(scene, facts);
  const PictureFeatures picture = analyse_picture(asset, scene.look);
  for (const FeatureReason& reason : explain(picture)) reasons.push_back(reason);
  const SceneFeatures features = analyse(scene, facts);
  const auto named = [&](const std::vector<std::string>& names) {
    gl::Resources resources;
    for (const std::string& name : names) resources.push_back(table[name]);
    return resources;
  };
  const auto pass = [&](const char* name, const std::vector<std::string>& reads,
                        const std::vector<std::string>& writes) {
    return gl::PassDeclaration{name, named(reads), named(writes), true, {}};
  };
  std::vector<std::string> step_reads = {"rest shape"};
  if (features.has_wind) step_reads.push_back("wind");
  if (features.has_turbulence) step_reads.push_back("gusts");
  if (features.has_colliders) step_reads.push_back("colliders");
  std::vector<std::string> draw_reads = {"expanded strands"};
  if (picture.has_head_mesh.value) draw_reads.push_back("head mesh");

  plan.passes = {
      under_fact(pass("scene/wind", {}, {"wind"}), reasons, "has_wind"),
      under_fact(pass("scene/gusts", {}, {"gusts"}), reasons, "has_turbulence"),
      under_fact(pass("scene/colliders", {}, {"colliders"}), reasons, "has_colliders"),
      pass("sim/step", step_reads, {"strand state"}),
      pass("publish/read", {"strand state"}, {"state on the host"}),
      pass("publish/quantise", {"state on the host"}, {"snapshot"}),
      pass("encode/strands", {"snapshot"}, {"strand frames"}),
      under_fact(pass("encode/decode", {"strand frames"}, {"decoded snapshot"}), reasons,
                 "has_frame_viewers"),
      under_fact(pass("render/expand", {"decoded snapshot"}, {"expanded strands"}), reasons,
                 "has_frame_viewers"),
      under_fact(pass("render/head", {}, {"head mesh"}), reasons,
                 features.has_frame_viewers ? "has_head_mesh" : "has_frame_viewers"),
      under_fact(pass("render/strands", draw_reads, {"picture"}), reasons, "has_frame_viewers"),
      under_fact(pass("render/resolve", {"picture"}, {"resolved picture"}), reasons, "has_frame_viewers"),
      under_fact(pass("encode/jpeg", {"resolved picture"}, {"jpeg frames"}), reasons, "has_frame_viewers"),
  };
  std::vector<std::string> wanted = {"strand state"};
  if (features.has_strand_viewers) wanted.push_back("strand frames");
  if (features.has_frame_viewers) wanted.push_back("jpeg frames");
  ASSIGN_OR_RETURN(plan.plan, gl::make_pass_plan(plan.passes, named({"rest shape"}), named(wanted)));
  plan.resources = table.take();
  return plan;
}

uint64_t written_bytes(const ServerPlan& plan, const gl::PassDeclaration& pass) {
  uint64_t bytes = 0;
  for (const auto& resource : plan.resources)
    if (std::find(pass.writes.begin(), pass.writes.end(), resource.get()) != pass.writes.end())
      bytes += resource->size_bytes();
  return bytes;
}

}  // namespace strandcast
