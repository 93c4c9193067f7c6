#include "server/app/server_passes.h"

#include <algorithm>
#include <utility>

#include "common/groom/head_spheres.h"
#include "server/app/viewers.h"
#include "server/encode/picture_painter.h"
#include "server/encode/strand_encode_worker.h"

namespace strandcast {
namespace {

uint64_t sum_bytes(const gl::PassReports& passes, bool is_kept) {
  uint64_t bytes = 0;
  for (const gl::PassReport& pass : passes)
    if ((pass.fate == gl::PassFate::Kept) == is_kept) bytes += pass.size_bytes;
  return bytes;
}

}  // namespace

gl::PassReports join_passes(ThreadPasses threads, bool is_watched_as_pictures) {
  gl::PassReports passes = std::move(threads.simulation);
  for (gl::PassReport& pass : threads.strands) passes.push_back(std::move(pass));
  for (gl::PassReport& pass : threads.pictures) {
    if (!is_watched_as_pictures && pass.fate == gl::PassFate::Kept) {
      pass.fate = gl::PassFate::Unread;
      pass.reason = "no viewer receives pictures";
    }
    passes.push_back(std::move(pass));
  }
  return passes;
}

StageSizes stage_sizes(const SceneDesc& scene, const SceneAsset& asset) {
  const size_t colliders =
      scene.colliders.empty() && scene.has_auto_collider && scene.head.collider == kSphereCollider
          ? kHeadSpheres
          : scene.colliders.size();
  // About: the box of the mesh is not known before it is loaded.
  const uint64_t nodes =
      uint64_t{scene.head.field_resolution} * scene.head.field_resolution * scene.head.field_resolution;
  return {asset.strand_count, asset.vertex_count, scene.substeps, static_cast<uint32_t>(colliders),
          scene.head.collider == kFieldCollider ? nodes * sizeof(glm::vec4) : 0};
}

PictureView assumed_view(const SceneDesc& scene) {
  return make_scene_view(scene, scene_picture_size(scene), kAllPictureCodecs);
}

Result<gl::PassReports> plan_server(const SceneDesc& scene, const SceneAsset& asset,
                                    const RuntimeFacts& facts) {
  ThreadPasses threads;
  SimStages stages(stage_sizes(scene, asset), explain(scene, facts));
  stages.set_watched(facts.strand_viewers + facts.frame_viewers > 0);
  threads.simulation = stages.report();
  // Pictures are drawn from the strand frames of the first class.
  const bool is_encoding = facts.strand_viewers + facts.frame_viewers > 0;
  threads.strands = {strand_encode_report(0, is_encoding, StageTimer())};
  const PictureCodecs wanted = facts.frame_viewers > 0 ? codec_bit(assumed_view(scene).codec) : 0;
  ASSIGN_OR_RETURN(threads.pictures,
                   plan_picture_passes(asset, scene.look, likely_renderer("auto", scene.look), wanted));
  return join_passes(std::move(threads), facts.frame_viewers > 0);
}

std::string format_passes(const gl::PassReports& passes, const gl::ObjectCounts& objects) {
  std::string text;
  const auto head = [&](const char* name, const char* type, const char* help) {
    text += fmt::format("# HELP strandcast_{0} {2}\n# TYPE strandcast_{0} {1}\n", name, type, help);
  };
  const auto line = [&](const char* name, const char* label, const std::string& of, double value) {
    text += fmt::format("strandcast_{}{{{}=\"{}\"}} {:.10g}\n", name, label, of, value);
  };
  const auto plain = [&](const char* name, const char* type, const char* help, uint64_t value) {
    head(name, type, help);
    text += fmt::format("strandcast_{} {}\n", name, value);
  };
  head("pass_is_kept", "gauge", "1 for a pass that somebody wants something of, as --explain lists them.");
  for (const gl::PassReport& pass : passes)
    line("pass_is_kept", "pass", pass.name, pass.fate == gl::PassFate::Kept ? 1.0 : 0.0);
  head("pass_runs_total", "counter", "Runs of a pass since it was made.");
  for (const gl::PassReport& pass : passes)
    line("pass_runs_total", "pass", pass.name, static_cast<double>(pass.runs));
  head("pass_median_ms", "gauge", "Median time of the last runs of a pass.");
  for (const gl::PassReport& pass : passes) line("pass_median_ms", "pass", pass.name, pass.median_ms);
  head("pass_bytes", "gauge", "What a pass keeps and is the first to write.");
  for (const gl::PassReport& pass : passes)
    line("pass_bytes", "pass", pass.name, static_cast<double>(pass.size_bytes));
  head("gl_objects", "gauge", "OpenGL objects of this process.");
  for (size_t i = 0; i < gl::kObjectKindCount; ++i) {
    const auto kind = static_cast<gl::ObjectKind>(i);
    line("gl_objects", "kind", gl::to_string(kind), static_cast<double>(objects.of(kind)));
  }
  plain("gl_contexts", "gauge", "OpenGL contexts of this process.", objects.contexts);
  plain("gl_bytes", "gauge", "Storage of its buffers and textures.", objects.size_bytes);
  plain("gl_compiled_programs_total", "counter", "Programs compiled since start.", objects.compiled_programs);
  return text;
}

uint64_t kept_bytes(const gl::PassReports& passes) {
  return sum_bytes(passes, true);
}

uint64_t saved_bytes(const gl::PassReports& passes) {
  return sum_bytes(passes, false);
}

}  // namespace strandcast
