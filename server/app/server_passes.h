// The passes of all threads of a server as one list, ordered from a head pose to its pixels. A running server
// reports it; --explain plans and measures it. Pure functions, any thread.
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

/// Pass reports of each thread.
struct ThreadPasses {
  gl::PassReports simulation;
  gl::PassReports strands;   // one per class that was ever needed
  gl::PassReports pictures;  // of the frame thread
};

/// Joins the reports into one list; passes of pictures that nobody watches are marked as not running.
gl::PassReports join_passes(ThreadPasses threads, bool is_watched_as_pictures);

/// Returns the list of a server with these viewers before it has threads or GL. A viewer of pictures is
/// assumed to have assumed_view().
Result<gl::PassReports> plan_server(const SceneDesc& scene, const SceneAsset& asset,
                                    const RuntimeFacts& facts);

/// Returns the scene's own view, in the best codec of this build.
PictureView assumed_view(const SceneDesc& scene);

/// Returns lines for /metrics as Prometheus text: passes with their times and bytes, and counts of OpenGL
/// objects.
std::string format_passes(const gl::PassReports& passes, const gl::ObjectCounts& objects);

StageSizes stage_sizes(const SceneDesc& scene, const SceneAsset& asset);

/// Return the bytes of the passes that run, and of all others.
uint64_t kept_bytes(const gl::PassReports& passes);
uint64_t saved_bytes(const gl::PassReports& passes);

}  // namespace strandcast
