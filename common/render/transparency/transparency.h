// Transparency and antialiasing methods: how strands that cover part of a pixel are ordered, and how edges
// become smooth. Each method of common/scene/shadow_methods.h is a file of this folder that adds its passes;
// only the chosen one is compiled and allocated. All but `hashed` fill the strand layer, which the resolve
// pass blends over the scene.
#pragma once

#include <string>
#include <utility>

#include "common/render/detail/culling.h"
#include "common/render/passes/expand_walks.h"
#include "common/render/passes/strand_pass.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"

namespace strandcast {

/// Function that adds a method's walks over the strands and the passes that draw in each.
using AddStrandPasses = void (*)(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

void add_hashed(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_lists(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_three_depths(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_weighted(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_moments(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

/// Alternative antialiasing methods, which require `hashed`.
void add_msaa4(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_density_samples(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
/// Returns the scene's sample layout for a method.
SampleLayout sample_layout(AntialiasingMethod method);

/// Adds the passes of the scene's method.
void add_transparency_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

/// Prepares drawing strands to the bound target with a fragment stage that includes render/blended.glsl, one
/// invocation per pixel.
void begin_blended(StrandDraw& strands, const RenderScene& scene, const ExpandedStrands& expanded,
                   const RenderTurn& turn);

/// A triangle that covers the whole bound target.
class FullScreen {
 public:
  static Result<FullScreen> make(const RenderSetup& setup, const std::string& fragment_stage,
                                 const gl::Variant& variant = {});
  const gl::Program& program() const { return program_; }
  void draw() const;

 private:
  gl::Program program_;
  gl::VertexArray no_attributes_;
};

/// Blends the strands that a method has drawn over the scene.
class LayerBlendPass : public RenderPass {
 public:
  LayerBlendPass(RenderScene& scene, std::string name, gl::Resources reads, std::string fragment_stage)
      : Pass(strand_pass(scene, std::move(name), std::move(reads), {&scene.strand_layer})),
        layer_(scene.strand_layer),
        fragment_stage_(std::move(fragment_stage)) {}
  Status prepare(const RenderSetup& setup) override;
  Status run(RenderTurn& turn) override;

 protected:
  /// Binds the textures that the method has drawn.
  virtual void bind(const gl::Program& program) const = 0;

 private:
  StrandLayer& layer_;
  std::string fragment_stage_;
  FullScreen screen_;
};

}  // namespace strandcast
