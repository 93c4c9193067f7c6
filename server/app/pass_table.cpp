#include "server/app/pass_table.h"

#include <algorithm>

#include "server/sim/solver.h"

namespace strandcast {
namespace {

constexpr uint64_t kVec4Bytes = 16;
constexpr uint64_t kVec3Bytes = 12;
constexpr uint64_t kPixelBytes = 4;
constexpr uint64_t kSamples = 4;           // of the multisampled picture
constexpr uint64_t kColorDepthBytes = 12;  // per sample: half-float colour and depth

/// Names of the resources between the passes.
std::vector<gl::ResourceDeclaration> make_resources(const SceneDesc& scene, const SceneAsset& asset) {
  const uint64_t vertices = uint64_t{asset.strand_count} * asset.vertex_count;
  const uint64_t drawn_strands = asset.strand_count + uint64_t{scene.look.followers} * asset.triangle.size();
  const uint64_t drawn_points = drawn_strands * (uint64_t{asset.vertex_count - 1} * scene.look.segments + 1);
  const uint64_t pixels = uint64_t{scene.stream.frame_width} * scene.stream.frame_height;
  const uint64_t colliders = std::max<uint64_t>(scene.colliders.size(), scene.has_auto_collider ? 1 : 0);
  return {
      {"wind", kVec4Bytes},
      {"gusts", kMaxGustWaves * 2 * kVec4Bytes},
      {"colliders", colliders * kVec4Bytes},
      {"rest shape", vertices * kVec4Bytes},
      {"strand state", 2 * vertices * kVec4Bytes},
      {"state on the host", 2 * vertices * kVec3Bytes},
      {"snapshot", vertices * kVec3Bytes},
      {"strand frames", vertices * kVec3Bytes},
      {"decoded snapshot", vertices * 2 * kVec3Bytes},
      {"expanded strands", drawn_points * kVec4Bytes},
      {"head mesh", asset.head.position_m.size() * 2 * kVec3Bytes + asset.head.triangle.size() * kVec3Bytes},
      {"picture", pixels * kSamples * kColorDepthBytes},
      {"resolved picture", pixels * kPixelBytes},
      {"jpeg frames", pixels * kPixelBytes}};
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
  plan.resources = make_resources(scene, asset);
  const std::vector<FeatureReason> reasons = explain(scene, facts);
  const SceneFeatures features = analyse(scene, facts);
  const auto pass = [](const char* name, std::vector<std::string> reads, std::vector<std::string> writes) {
    return gl::PassDeclaration{name, true, {}, std::move(reads), std::move(writes)};
  };
  std::vector<std::string> step_reads = {"rest shape"};
  if (features.has_wind) step_reads.push_back("wind");
  if (features.has_turbulence) step_reads.push_back("gusts");
  if (features.has_colliders) step_reads.push_back("colliders");
  std::vector<std::string> draw_reads = {"expanded strands"};
  if (features.has_head_mesh) draw_reads.push_back("head mesh");

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
  ASSIGN_OR_RETURN(plan.plan, gl::make_pass_plan(plan.passes, plan.resources, {"rest shape"}, wanted));
  return plan;
}

uint64_t written_bytes(const ServerPlan& plan, const gl::PassDeclaration& pass) {
  uint64_t bytes = 0;
  for (const gl::ResourceDeclaration& resource : plan.resources)
    if (std::find(pass.writes.begin(), pass.writes.end(), resource.name) != pass.writes.end())
      bytes += resource.size_bytes;
  return bytes;
}

}  // namespace strandcast
