// Culling: leaves out segments that the camera cannot see. After each of the camera's walks the GPU makes a
// list of visible segments and their indirect draws. All strands cast shadows. The picture is the same, bit
// for bit, as without culling. All calls that touch GL come from the context's thread.
#pragma once

#include <memory>
#include <string>

#include "common/gl/program.h"
#include "common/render/detail/chosen_segments.h"
#include "common/render/detail/running_sum.h"
#include "common/render/passes/expand_walks.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"

namespace strandcast {

class Culling final : public gl::Resource {
 public:
  Culling(const RenderScene& scene, const ExpandedStrands& expanded);
  Status prepare(const gl::ShaderLibrary& shaders);
  /// Chooses among the currently expanded segments.
  void run(const RenderScene& scene, const ExpandedStrands& expanded, const RenderTurn& turn);
  const ChosenSegments& chosen() const { return chosen_; }
  uint64_t size_bytes() const override;

 private:
  void find_depths(const RenderScene& scene, bool is_new_picture);

  uint64_t max_segments_;
  bool has_occlusion_;
  ChosenSegments chosen_;
  RunningSum sum_;
  gl::Buffer mask_;
  gl::Buffer depth_;
  glm::ivec2 blocks_{0};  // of the scene's depth
  gl::Program depth_program_;
  gl::Program mask_program_;
  gl::Program list_program_;
};

/// Adds culling to the scene if its method uses it; call it before any pass that draws strands is made.
void add_culling(RenderScene& scene, const ExpandedStrands& expanded, RenderPassList& passes);
/// Adds a walk of the camera: the pass that expands strands and the pass that chooses among them.
void add_camera_walk(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes,
                     const std::string& purpose = "");

}  // namespace strandcast
