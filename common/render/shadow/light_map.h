// LightMap: common part of the shadow methods that draw the hair as the light sees it: deep opacity maps,
// opacity shadow maps, the hybrid and deep shadow maps. All calls from the context's thread.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "common/render/passes/strand_pass.h"
#include "common/render/shadow/light_frame.h"
#include "common/render/shadow/shadow_method.h"

namespace strandcast {

/// A map with the light frame of the current draw.
class LightMap : public ShadowMap {
 public:
  LightMap(std::string name, uint32_t texels) : ShadowMap(std::move(name)), texels_(texels) {}
  /// Starts a draw before strands are drawn into the map: allocates and clears it.
  virtual void begin() = 0;
  void fit(const RenderScene& scene, const RenderTurn& turn);
  const LightFrame& frame() const { return frame_; }
  uint32_t texels() const { return texels_; }
  void set_uniforms(const gl::Program& program, uint32_t first_unit) const override;

 protected:
  /// Sets the textures and parameters of the method.
  virtual void set_method_uniforms(const gl::Program& program, uint32_t first_unit) const = 0;

 private:
  uint32_t texels_;
  LightFrame frame_;
  FittedSphere skull_;  // radius 0: none
};

/// Returns the skull under the hair for shaders/render/shadow.glsl; its radius is 0 if there is none.
FittedSphere shadowing_skull(const RenderScene& scene);
void set_skull_uniforms(const gl::Program& program, const FittedSphere& skull);

/// Makes the pass in front of the first walk, which sets the draw's light and the map's frame.
std::unique_ptr<RenderPass> make_light_frame_pass(RenderScene& scene, LightMap& map);

/// Draws strands as the light sees them, with a fragment stage that includes render/shadow_map.glsl.
class LightDraw {
 public:
  static Result<LightDraw> make(const RenderSetup& setup, const RenderScene& scene,
                                const std::string& fragment_stage, gl::Variant variant = {});
  /// Draws the expanded strands; the caller binds the target.
  void draw(const RenderScene& scene, const LightMap& map, const ExpandedStrands& expanded);
  const gl::Program& program() const { return strands_.program(); }

 private:
  StrandDraw strands_;
};

/// Draws the strands of each batch as the light sees them.
class LightDrawPass : public RenderPass {
 public:
  LightDrawPass(RenderScene& scene, ExpandedStrands& expanded, gl::PassDeclaration declaration,
                std::string fragment_stage, gl::Variant variant = {})
      : Pass(std::move(declaration)),
        scene_(scene),
        expanded_(expanded),
        fragment_stage_(std::move(fragment_stage)),
        variant_(std::move(variant)) {}
  bool is_batched() const override { return true; }
  uint64_t size_bytes() const override { return StrandDraw::size_bytes(); }
  Status prepare(const RenderSetup& setup) override;

 protected:
  RenderScene& scene_;
  ExpandedStrands& expanded_;
  LightDraw draw_;

 private:
  std::string fragment_stage_;
  gl::Variant variant_;
};

}  // namespace strandcast
