// The server's passes as the plan sees them: what each needs, reads and writes, and what that costs in
// memory. --explain prints it. Pure functions, any thread.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/gl/pass_plan.h"
#include "common/scene/features.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

struct ServerPlan {
  std::vector<gl::PassDeclaration> passes;
  std::vector<std::unique_ptr<gl::Resource>> resources;
  gl::PassPlan plan;
};

/// The plan for a scene with these facts. Sizes of encoded streams are upper bounds.
Result<ServerPlan> make_server_plan(const SceneDesc& scene, const SceneAsset& asset,
                                    const RuntimeFacts& facts);

/// Bytes that a pass writes.
uint64_t written_bytes(const ServerPlan& plan, const gl::PassDeclaration& pass);

}  // namespace strandcast
