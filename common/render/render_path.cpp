#include "common/render/render_path.h"

#include "common/render/passes/expand_pass.h"
#include "common/render/passes/expand_walks.h"
#include "common/render/shadow/shadow_method.h"
#include "common/render/transparency/transparency.h"

namespace strandcast {

// One maker per pass, each in passes/NAME_pass.cpp; those that hand a resource of their own to another pass
// have a header.
std::unique_ptr<RenderPass> make_upload_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_clear_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_head_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_resolve_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_lobe_table_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_scatter_table_pass(RenderScene& scene);

namespace {

/// Shadows: of the strands that are drawn, or of others that are chosen for the light's map.
void add_caster_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  if (scene.methods.shadow_detail == ShadowDetail::Same) return add_shadow_passes(scene, walks, passes);
  auto& casters = passes.keep(make_casters(scene));
  ExpandWalks caster_walks(make_caster_pass(scene, casters), casters);
  add_shadow_passes(scene, caster_walks, passes);
}

void add_segment_passes(RenderScene& scene, RenderPassList& passes) {
  scene.scene.set_layout(sample_layout(scene.methods.antialiasing));
  auto& expanded = passes.keep(make_expanded_strands(scene));
  ExpandWalks walks(make_expand_pass(scene, expanded), expanded);
  add_culling(scene, expanded, passes);
  passes.add(make_lobe_table_pass(scene));
  passes.add(make_scatter_table_pass(scene));
  passes.add(make_upload_pass(scene));
  add_caster_passes(scene, walks, passes);
  passes.add(make_clear_pass(scene));
  passes.add(make_head_pass(scene));
  add_transparency_passes(scene, walks, passes);
  passes.add(make_resolve_pass(scene));
}

}  // namespace

const RenderPath& segment_path() {
  static const RenderPath path{"segments", "camera-facing quads, depth test, a fixed pattern of coverage",
                               add_segment_passes, kSamplesPerSide, std::nullopt};
  return path;
}

bool has_main_methods(const LookDesc& look) {
  return look.methods == RenderMethodsDesc{};
}

const RenderPath& path_for(const LookDesc& look) {
  return has_main_methods(look) ? tile_path() : segment_path();
}

RenderPath segment_path_with(const RenderMethods& methods) {
  return {"segments", "camera-facing quads, depth test, a fixed pattern of coverage", add_segment_passes,
          kSamplesPerSide, methods};
}

}  // namespace strandcast
