// How strands that cover a part of a pixel are put in front of one another, and how edges get smooth: each
// method of common/scene/shadow_methods.h is a file of this folder that adds its passes, and only what is
// chosen is compiled and allocated. All but `hashed` fill the strand layer, which the resolve pass lays over
// the scene.
#pragma once

#include <string>
#include <utility>

#include "common/render/detail/culling.h"
#include "common/render/passes/expand_walks.h"
#include "common/render/passes/strand_pass.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"

namespace strandcast {

/// A method adds the walks that it takes over the strands, and what it draws in each.
using AddStrandPasses = void (*)(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

void add_hashed(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_lists(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_three_depths(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_weighted(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_moments(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

/// The other ways to smooth edges, which go with `hashed`.
void add_msaa4(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_density_samples(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
/// Samples of the scene that a method draws into.
SampleLayout sample_layout(AntialiasingMethod method);

/// The method of the scene.
void add_transparency_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

/// Strands with a fragment stage that includes render/blended.glsl, one invocation per pixel, for the target
/// that is bound.
void begin_blended(StrandDraw& strands, const RenderScene& scene, const ExpandedStrands& expanded,
                   const RenderTurn& turn);

/// A triangle over all of the target that is bound.
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

/// Lays what a method has drawn of the strands over the scene.
class LayerBlendPass : public RenderPass {
 public:
  LayerBlendPass(RenderScene& scene, std::string name, gl::Resources reads, std::string fragment_stage)
      : Pass(strand_pass(scene, std::move(name), std::move(reads), {&scene.strand_layer})),
        layer_(scene.strand_layer),
        fragment_stage_(std::move(fragment_stage)) {}
  Status prepare(const RenderSetup& setup) override;
  Status run(RenderTurn& turn) override;

 protected:
  /// Binds what the method has drawn.
  virtual void bind(const gl::Program& program) const = 0;

 private:
  StrandLayer& layer_;
  std::string fragment_stage_;
  FullScreen screen_;
};

}  // namespace strandcast
