// Head pass: the mesh under the hair, with skin that is lit and shadowed by the light volume.

#include <epoxy/gl.h>

#include "common/render/render_path.h"
#include "common/render/scalp_cover.h"
#include "common/render/shadow/shadow_method.h"
#include "common/scene/hair_color.h"

namespace strandcast {
namespace {

constexpr uint32_t kLightUnit = 0;
// How far above the skin the hair's shadow is looked up.
constexpr float kShadowLiftCells = 1.0f;
// A root tints the skin this far around it, of the hair's extent.
constexpr float kCoverReach = 0.025f;

void attach(const gl::VertexArray& array, uint32_t slot, const gl::Buffer& values, int components) {
  glVertexArrayVertexBuffer(array.name(), slot, values.name(), 0,
                            components * static_cast<int>(sizeof(float)));
  glVertexArrayAttribFormat(array.name(), slot, components, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribBinding(array.name(), slot, slot);
  glEnableVertexArrayAttrib(array.name(), slot);
}

/// The mesh as it lies on the GPU: positions, normals, cover per vertex; corners per triangle.
uint64_t mesh_bytes(const RenderScene& scene) {
  return uint64_t{scene.head_vertex_count} * (2 * sizeof(glm::vec3) + sizeof(float)) +
         uint64_t{scene.head_triangle_count} * sizeof(glm::uvec3);
}

class HeadPass final : public RenderPass {
 public:
  explicit HeadPass(RenderScene& scene)
      : Pass({"render/head",
              {&scene.light},
              {&scene.scene},
              scene.features.has_head_mesh.value,
              scene.features.has_head_mesh.reason}),
        scene_(scene),
        size_bytes_(mesh_bytes(scene)) {}

  uint64_t size_bytes() const override { return size_bytes_; }

  Status prepare(const RenderSetup& setup) override {
    const Mesh& mesh = setup.asset.head;
    ASSIGN_OR_RETURN(program_, gl::Program::make(setup.shaders, {"render/head.vert", "render/head.frag"},
                                                 {{"SHADOW", static_cast<int>(scene_.methods.shadow)}}));
    vertex_array_ = gl::VertexArray("head");
    position_ = gl::Buffer::of("head position", mesh.position_m);
    normal_ = gl::Buffer::of("head normal", mesh.normal);
    cover_ = gl::Buffer::of("head cover", scalp_cover(setup.asset, scene_.rest.extent_m * kCoverReach));
    index_ = gl::Buffer::of("head index", mesh.triangle);
    index_count_ = static_cast<int>(3 * mesh.triangle.size());
    attach(vertex_array_, 0, position_, 3);
    attach(vertex_array_, 1, normal_, 3);
    attach(vertex_array_, 2, cover_, 1);
    glVertexArrayElementBuffer(vertex_array_.name(), index_.name());
    return {};
  }

  Status run(RenderTurn& turn) override {
    scene_.scene.begin();
    program_.use();
    vertex_array_.bind();
    scene_.light.set_uniforms(program_, kLightUnit);
    if (scene_.shadow != nullptr) scene_.shadow->set_uniforms(program_, kFirstShadowUnit);
    program_.set("u_clip_from_head", turn.view.clip_from_head);
    program_.set("u_eye_m", turn.view.eye_m);
    program_.set("u_skin_color", scene_.look.skin_color);
    program_.set("u_root_color", colors_of(scene_.look).root);
    program_.set("u_shadow_lift_m", kShadowLiftCells * scene_.light_volume.cell_m);
    glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
    return {};
  }

 private:
  RenderScene& scene_;
  uint64_t size_bytes_;
  gl::Program program_;
  gl::VertexArray vertex_array_;
  gl::Buffer position_;
  gl::Buffer normal_;
  gl::Buffer cover_;
  gl::Buffer index_;
  int index_count_ = 0;
};

}  // namespace

std::unique_ptr<RenderPass> make_head_pass(RenderScene& scene) {
  return std::make_unique<HeadPass>(scene);
}

}  // namespace strandcast
