#include "common/render/passes/table_textures.h"

#include <epoxy/gl.h>

#include "shaders/shared/lobe_tables.h"

namespace strandcast {
namespace {

constexpr uint64_t kTexelBytes = 8;  // four half floats

uint64_t volume_bytes(uint64_t width, uint64_t height, uint64_t depth) {
  return kTexelBytes * width * height * depth;
}

// A cuticle that is tilted by an angle turns what it reflects by twice as much.
constexpr float kShiftPerTilt = -2.0f;
// What water takes of the width of highlights, as lib/hair_light.glsl has it.
constexpr float kWetTableSharp = 0.5f;

}  // namespace

gl::Texture upload_table(const std::string& label, const scatter::LookupTable& table) {
  const glm::uvec3& size = table.size;
  gl::Texture texture = gl::Texture::volume(label, GL_RGBA16F, size.x, size.y, size.z);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTextureSubImage3D(texture.name(), 0, 0, 0, 0, static_cast<GLsizei>(size.x), static_cast<GLsizei>(size.y),
                      static_cast<GLsizei>(size.z), GL_RGBA, GL_HALF_FLOAT, table.texels.data());
  return texture;
}

void LobeTables::make(const LookDesc& look) {
  longitudinal_ = upload_table("longitudinal table", scatter::make_longitudinal_table(lobe_shapes_of(look)));
  azimuthal_ = upload_table("azimuthal table", scatter::make_azimuthal_table({}));
}

uint64_t LobeTables::size_bytes() const {
  return volume_bytes(shader::kHalfAngleTexels, 1, 1) +
         volume_bytes(shader::kAzimuthTexels, shader::kDifferenceTexels, shader::kAbsorptionTexels);
}

void ScatterTables::make(const LookDesc& look) {
  averages_ = upload_table("average table", scatter::make_average_table(lobe_shapes_of(look), {}));
}

uint64_t ScatterTables::size_bytes() const {
  return volume_bytes(shader::kInclinationTexels, shader::kAverageAbsorptionTexels, shader::kAverageLayers);
}

void DensityTexture::upload(const LightVolume& volume) {
  if (size_ != volume.size()) {
    size_ = volume.size();
    const glm::uvec3 size(size_);
    texture_ = gl::Texture::volume("hair density", GL_R16F, size.x, size.y, size.z);
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTextureSubImage3D(texture_.name(), 0, 0, 0, 0, size_.x, size_.y, size_.z, GL_RED, GL_FLOAT,
                      volume.crossings_per_m().data());
}

std::array<scatter::LobeShape, 3> lobe_shapes_of(const LookDesc& look) {
  const HairShadingDesc& shading = look.shading;
  return scatter::lobe_shapes(
      glm::radians(shading.highlight_width_deg) * (1.0f - kWetTableSharp * shading.wetness),
      kShiftPerTilt * glm::radians(shading.cuticle_deg));
}

}  // namespace strandcast
