#include "common/render/render_path.h"

#include "common/render/passes/expand_pass.h"
#include "common/render/passes/strand_pass.h"

namespace strandcast {

// One maker per pass, each in passes/NAME_pass.cpp; those that hand a resource of their own to another pass
// have a header.
std::unique_ptr<RenderPass> make_light_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_upload_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_clear_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_head_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_resolve_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_lobe_table_pass(RenderScene& scene);
std::unique_ptr<RenderPass> make_scatter_table_pass(RenderScene& scene);

const RenderPath& segment_path() {
  static const RenderPath path{"segments", "camera-facing quads, depth test, a fixed pattern of coverage",
                               [](RenderScene& scene, RenderPassList& passes) {
                                 auto& expanded = passes.keep(make_expanded_strands(scene));
                                 passes.add(make_lobe_table_pass(scene));
                                 passes.add(make_scatter_table_pass(scene));
                                 passes.add(make_light_pass(scene));
                                 passes.add(make_upload_pass(scene));
                                 passes.add(make_clear_pass(scene));
                                 passes.add(make_head_pass(scene));
                                 passes.add(make_expand_pass(scene, expanded));
                                 passes.add(make_strand_pass(scene, expanded));
                                 passes.add(make_resolve_pass(scene));
                               }};
  return path;
}

}  // namespace strandcast
