// Hair from far away as a volume (vkhr; reference: 003, 6.3 asks for a fall-back): where strands are much
// thinner than a pixel, rays through their density show what all of them together look like. In between some
// pixels show the one and some the other. All calls from the context's thread.
#pragma once

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/passes/expand_walks.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"
#include "common/render/shadow/light_frame.h"

namespace strandcast {

/// Per cell of a cube around the hair: what a ray from the eye loses, the mean way of the strands, and how
/// far along them it is.
class FarVolume final : public gl::Resource {
 public:
  FarVolume() : Resource("far volume") {}
  /// Once per draw; empties all cells where the volume is seen.
  void begin(const RenderScene& scene, RenderTurn& turn);
  /// Adds what is expanded now; `program` is of far_volume_sum.comp.
  void add(const gl::Program& program, const RenderScene& scene, const ExpandedStrands& expanded,
           const RenderTurn& turn) const;
  void finish() const;
  void set_uniforms(const gl::Program& program, const RenderTurn& turn) const;
  bool is_seen() const { return share_ > 0.0f; }
  /// 0: strands alone; 1: the volume alone.
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

/// How much of the hair is shown as a volume: by how wide a strand is on the screen.
float far_share(const RenderScene& scene, const View& view);

/// The passes that fill it, before the camera's walk; and the one that draws it, behind the strands.
FarVolume& add_far_volume(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_far_volume_draw(RenderScene& scene, RenderPassList& passes, FarVolume& volume);

}  // namespace strandcast
