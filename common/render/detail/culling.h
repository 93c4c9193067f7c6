// Culling: segments that the camera cannot see are not sent to be drawn, by a list and indirect draws that
// the GPU makes for itself behind each of the camera's walks. Shadows are drawn of all strands. A picture
// with it is the same as without, bit for bit. All calls that touch GL from the context's thread.
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
  /// Chooses among what is expanded now.
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

/// Makes the scene's culling, where its method is one: before any pass that draws strands is made.
void add_culling(RenderScene& scene, const ExpandedStrands& expanded, RenderPassList& passes);
/// A walk of the camera: what it expands, and what of that is chosen.
void add_camera_walk(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes,
                     const std::string& purpose = "");

}  // namespace strandcast
