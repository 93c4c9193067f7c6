// Distant hair as a volume, after vkhr. Where strands are much thinner than a pixel, rays through their
// density show how all of them look together. At intermediate distances some pixels show strands and others
// the volume. All calls from the context's thread.
#pragma once

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/passes/expand_walks.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"
#include "common/render/shadow/light_frame.h"

namespace strandcast {

/// Volume around the hair. Each cell holds the extinction along a ray from the eye, the mean direction of its
/// strands, and the position along them.
class FarVolume final : public gl::Resource {
 public:
  FarVolume() : Resource("far volume") {}
  /// Starts a draw; clears all cells if the volume is visible.
  void begin(const RenderScene& scene, RenderTurn& turn);
  /// Adds the currently expanded strands; `program` must be far_volume_sum.comp.
  void add(const gl::Program& program, const RenderScene& scene, const ExpandedStrands& expanded,
           const RenderTurn& turn) const;
  void finish() const;
  void set_uniforms(const gl::Program& program, const RenderTurn& turn) const;
  bool is_seen() const { return share_ > 0.0f; }
  /// Share of the volume in the picture: 0 = strands alone, 1 = volume alone.
  float share() const { return share_; }
  uint64_t size_bytes() const override {
    return cell_.size_bytes() + way_.size_bytes() + along_.size_bytes();
  }

 private:
  float share_ = 0.0f;
  HairCube cube_;
  gl::Buffer cell_;
  gl::Texture way_;    // mean way times depth, depth
  gl::Texture along_;  // times depth
};

/// Returns the share of hair that is shown as a volume, which depends on the width of a strand on the screen.
float far_share(const RenderScene& scene, const View& view);

/// Add the passes that fill the volume, before the camera's walk, and the pass that draws it, after the
/// strands.
FarVolume& add_far_volume(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_far_volume_draw(RenderScene& scene, RenderPassList& passes, FarVolume& volume);

}  // namespace strandcast
