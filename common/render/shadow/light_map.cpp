#include "common/render/shadow/light_map.h"

namespace strandcast {
namespace {

class LightFramePass final : public RenderPass {
 public:
  LightFramePass(RenderScene& scene, LightMap& map)
      : Pass({"render/light_frame", {&scene.strands}, {&scene.light, &map}, true, {}}),
        scene_(scene),
        map_(map) {}

  Status run(RenderTurn& turn) override {
    scene_.light.set_light(scene_.look, turn.view, to_light_in_head(scene_, turn));
    map_.fit(scene_, turn);
    map_.begin();
    return {};
  }

 private:
  RenderScene& scene_;
  LightMap& map_;
};

}  // namespace

void LightMap::fit(const RenderScene& scene, const RenderTurn& turn) {
  frame_ = fit_light_frame(turn.strands.position_m, to_light_in_head(scene, turn), texels_,
                           shadow_margin_m(scene));
  skull_ = shadowing_skull(scene);
}

void LightMap::set_uniforms(const gl::Program& program, uint32_t first_unit) const {
  program.set("u_map_from_head", frame_.map_from_head);
  program.set("u_map_texels", static_cast<int>(texels_));
  set_skull_uniforms(program, skull_);
  set_method_uniforms(program, first_unit);
}

FittedSphere shadowing_skull(const RenderScene& scene) {
  return scene.light_volume.has_skull ? scene.light_volume.skull : FittedSphere{glm::vec3(0.0f), 0.0f};
}

void set_skull_uniforms(const gl::Program& program, const FittedSphere& skull) {
  program.set("u_skull_center_m", skull.center_m);
  program.set("u_skull_radius_m", skull.radius_m);
}

std::unique_ptr<RenderPass> make_light_frame_pass(RenderScene& scene, LightMap& map) {
  return std::make_unique<LightFramePass>(scene, map);
}

Result<LightDraw> LightDraw::make(const RenderSetup& setup, const RenderScene& scene,
                                  const std::string& fragment_stage, gl::Variant variant) {
  LightDraw draw;
  ASSIGN_OR_RETURN(draw.strands_, StrandDraw::make(setup, scene, fragment_stage, std::move(variant),
                                                   "render/shadow_map.vert"));
  return draw;
}

void LightDraw::draw(const RenderScene& scene, const LightMap& map, const ExpandedStrands& expanded) {
  strands_.bind(expanded);
  program().set("u_map_from_head", map.frame().map_from_head);
  program().set("u_map_texels", static_cast<int>(map.texels()));
  program().set("u_texels_per_m", map.frame().texels_per_m);
  program().set("u_depth_m", map.frame().depth_m);
  program().set("u_strand_width_m", expanded.width_m);
  program().set("u_tip_scale", scene.look.tip_scale);
  program().set("u_strand_opacity", scene.method_settings.strand_opacity);
  strands_.draw(scene, expanded);
}

Status LightDrawPass::prepare(const RenderSetup& setup) {
  ASSIGN_OR_RETURN(draw_, LightDraw::make(setup, scene_, fragment_stage_, variant_));
  return {};
}

}  // namespace strandcast
