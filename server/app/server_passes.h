// The passes of all threads of a server as one list, in the order in which a head pose becomes pixels: a
// running server reports it, --explain plans and measures it. Pure functions, any thread.
#pragma once

#include <string>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/pass_list.h"
#include "common/scene/features.h"
#include "common/strands/scene_asset.h"
#include "server/encode/picture_views.h"
#include "server/source/sim_stages.h"

namespace strandcast {

/// What each thread says of itself.
struct ThreadPasses {
  gl::PassReports simulation;
  gl::PassReports strands;   // one per class that was ever needed
  gl::PassReports pictures;  // of the frame thread
};

/// One list of them; pictures that nobody watches run nothing.
gl::PassReports join_passes(ThreadPasses threads, bool is_watched_as_pictures);

/// The list of a server with these viewers before it has a thread or GL; who watches frames has the
/// assumed_view().
Result<gl::PassReports> plan_server(const SceneDesc& scene, const SceneAsset& asset,
                                    const RuntimeFacts& facts);

/// The scene's own view, in the best codec that is there.
PictureView assumed_view(const SceneDesc& scene);

/// Lines for /metrics in Prometheus text form: passes with their times and bytes, and what OpenGL holds.
std::string format_passes(const gl::PassReports& passes, const gl::ObjectCounts& objects);

StageSizes stage_sizes(const SceneDesc& scene, const SceneAsset& asset);

/// Bytes of the passes that run, or of all the others.
uint64_t kept_bytes(const gl::PassReports& passes);
uint64_t saved_bytes(const gl::PassReports& passes);

}  // namespace strandcast
