// Lookup tables and hair density on the GPU, for certain shading methods. The passes that write them allocate
// them if a look names such a method. All calls that touch GL come from the context's thread.
#pragma once

#include <cstdint>
#include <string>

#include "common/gl/objects.h"
#include "common/gl/pass_plan.h"
#include "common/render/light_volume.h"
#include "common/render/scatter/lobe_tables.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Uploads a table as a texture of half floats with the shape of the table and linear filtering.
gl::Texture upload_table(const std::string& label, const scatter::LookupTable& table);

/// Lobes M and N of a smooth fibre (shaders/shared/lobe_tables.h), for Marschner's model.
class LobeTables final : public gl::Resource {
 public:
  LobeTables() : Resource("lobe tables") {}
  void make(const LookDesc& look);
  const gl::Texture& longitudinal() const { return longitudinal_; }
  const gl::Texture& azimuthal() const { return azimuthal_; }
  uint64_t size_bytes() const override;

 private:
  gl::Texture longitudinal_;
  gl::Texture azimuthal_;
};

/// Forward and backward scattering of a smooth fibre, for dual scattering.
class ScatterTables final : public gl::Resource {
 public:
  ScatterTables() : Resource("scatter tables") {}
  void make(const LookDesc& look);
  const gl::Texture& averages() const { return averages_; }
  uint64_t size_bytes() const override;

 private:
  gl::Texture averages_;
};

/// Strands crossed per metre in each cell of the light volume, for normals of the hair as a surface.
class DensityTexture final : public gl::Resource {
 public:
  DensityTexture() : Resource("hair density") {}
  /// Uploads the density; reallocates if the volume's size has changed.
  void upload(const LightVolume& volume);
  const gl::Texture& density() const { return texture_; }
  /// Returns the texture's bytes, which depend on the extent of the hair; 0 before the first upload.
  uint64_t size_bytes() const override { return texture_.size_bytes(); }

 private:
  gl::Texture texture_;
  glm::ivec3 size_{0};
};

/// Returns the longitudinal shifts and widths that a look states, rad.
std::array<scatter::LobeShape, 3> lobe_shapes_of(const LookDesc& look);

}  // namespace strandcast
