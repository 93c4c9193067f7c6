// Passes that make the lookup tables of shading, at load and when the highlights get another shape: a picture
// only reads them.

#include "common/render/render_path.h"

namespace strandcast {
namespace {

template <class Tables>
class TablePass final : public RenderPass {
 public:
  TablePass(const char* name, RenderScene& scene, Tables& tables, const Fact& wanted)
      : Pass({name, {}, {&tables}, wanted.value, wanted.reason}, gl::PassClock::Host),
        scene_(scene),
        tables_(tables) {}

  Status prepare(const RenderSetup&) override {
    make();
    return {};
  }
  Status run(RenderTurn&) override {
    const HairShadingDesc& now = scene_.look.shading;
    if (now.highlight_width_deg != made_for_.highlight_width_deg ||
        now.cuticle_deg != made_for_.cuticle_deg || now.wetness != made_for_.wetness)
      make();
    return {};
  }

 private:
  void make() {
    made_for_ = scene_.look.shading;
    tables_.make(scene_.look);
  }

  RenderScene& scene_;
  Tables& tables_;
  HairShadingDesc made_for_;
};

}  // namespace

std::unique_ptr<RenderPass> make_lobe_table_pass(RenderScene& scene) {
  return std::make_unique<TablePass<LobeTables>>("render/lobe_tables", scene, scene.lobe_tables,
                                                 scene.features.has_lobe_tables);
}

std::unique_ptr<RenderPass> make_scatter_table_pass(RenderScene& scene) {
  return std::make_unique<TablePass<ScatterTables>>("render/scatter_tables", scene, scene.scatter_tables,
                                                    scene.features.has_scatter_tables);
}

}  // namespace strandcast
