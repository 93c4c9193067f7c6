// How much of the light reaches a strand through the others: each method of common/scene/shadow_methods.h
// adds its passes, and only what is chosen is compiled and allocated. What a method knows of the hair it
// hands to shaders/render/shadow.glsl, for strands and head alike. `volume` is the light pass.
#pragma once

#include "common/gl/pass_plan.h"
#include "common/gl/program.h"
#include "common/render/passes/expand_walks.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"

namespace strandcast {

/// What a method other than `volume` and `none` keeps.
class ShadowMap : public gl::Resource {
 public:
  using Resource::Resource;
  /// For shaders that include render/light.glsl; takes texture units from `first_unit` on.
  virtual void set_uniforms(const gl::Program& program, uint32_t first_unit) const = 0;
};

/// Texture units of a ShadowMap: behind the light volume's, at most kShadowUnits.
inline constexpr uint32_t kFirstShadowUnit = 1;
inline constexpr uint32_t kShadowUnits = 6;

/// A method fills scene.light with the light itself; those with a map make it scene.shadow.
void add_shadow_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

void add_none(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_deep_opacity(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_opacity_maps(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_density_rays(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_deep_shadow(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_hybrid(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

/// How far drawn strands may stray from the key strands.
float shadow_margin_m(const RenderScene& scene);
/// Towards the light of the look, unit, head space; from above when it has no direction.
glm::vec3 to_light_in_head(const RenderScene& scene, const RenderTurn& turn);

}  // namespace strandcast
