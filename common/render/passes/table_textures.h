// Lookup tables on the GPU, and the density of the hair: what single methods of shading read. Allocated by
// the passes that write them, when a look names such a method. All calls that touch GL from the context's
// thread.
#pragma once

#include <cstdint>
#include <string>

#include "common/gl/objects.h"
#include "common/gl/pass_plan.h"
#include "common/render/light_volume.h"
#include "common/render/scatter/lobe_tables.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Texture of half floats in the shape of a scatter::LookupTable, filtered linearly.
gl::Texture upload_table(const std::string& label, const scatter::LookupTable& table);

/// M and N of a smooth fibre (shaders/shared/lobe_tables.h), for Marschner's model.
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

/// What such a fibre scatters forward and back, for dual scattering.
class ScatterTables final : public gl::Resource {
 public:
  ScatterTables() : Resource("scatter tables") {}
  void make(const LookDesc& look);
  const gl::Texture& averages() const { return averages_; }
  uint64_t size_bytes() const override;

 private:
  gl::Texture averages_;
};

/// Strands crossed per metre in the cells of the light volume, for normals of the hair as a surface.
class DensityTexture final : public gl::Resource {
 public:
  DensityTexture() : Resource("hair density") {}
  /// Allocates when the volume has another size than the last.
  void upload(const LightVolume& volume);
  const gl::Texture& density() const { return texture_; }
  /// Follows the hair: 0 before the first upload.
  uint64_t size_bytes() const override { return texture_.size_bytes(); }

 private:
  gl::Texture texture_;
  glm::ivec3 size_{0};
};

/// Longitudinal shifts and widths that a look asks for, rad.
std::array<scatter::LobeShape, 3> lobe_shapes_of(const LookDesc& look);

}  // namespace strandcast
