// Shadow methods: how much light reaches a strand through other strands. Each method of
// common/scene/shadow_methods.h adds its passes; only the chosen one is compiled and allocated. It provides
// its data to shaders/render/shadow.glsl, for strands and head alike. The method `volume` is the light pass.
#pragma once

#include "common/gl/pass_plan.h"
#include "common/gl/program.h"
#include "common/render/passes/expand_walks.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"

namespace strandcast {

/// Data of a shadow method other than `volume` and `none`.
class ShadowMap : public gl::Resource {
 public:
  using Resource::Resource;
  /// Sets the uniforms of a shader that includes render/light.glsl; uses texture units from `first_unit` on.
  virtual void set_uniforms(const gl::Program& program, uint32_t first_unit) const = 0;
};

/// Texture units of a ShadowMap: after the light volume's unit, at most kShadowUnits.
inline constexpr uint32_t kFirstShadowUnit = 1;
inline constexpr uint32_t kShadowUnits = 6;

/// Add the passes of the scene's method. A method either fills scene.light itself or sets its map as
/// scene.shadow.
void add_shadow_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

void add_none(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_deep_opacity(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_opacity_maps(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_density_rays(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_deep_shadow(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);
void add_hybrid(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

/// Returns the largest distance of drawn strands from the key strands.
float shadow_margin_m(const RenderScene& scene);
/// Returns the unit direction towards the look's light in head space; from above if it has no direction.
glm::vec3 to_light_in_head(const RenderScene& scene, const RenderTurn& turn);

}  // namespace strandcast
