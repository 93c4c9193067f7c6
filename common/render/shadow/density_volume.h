// DensityVolume: density of drawn strands in a cube of cells, as the loss of a ray towards the light per
// metre. Filled by shaders/render/density.comp. All calls from the context's thread.
#pragma once

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/shadow/light_frame.h"
#include "common/render/shadow/shadow_method.h"

namespace strandcast {

class DensityVolume final : public ShadowMap {
 public:
  DensityVolume() : ShadowMap("density volume") {}
  /// Starts a draw: allocates and clears all cells.
  void begin(const RenderScene& scene, const RenderTurn& turn);
  /// Adds the currently expanded strands; `program` must be density.comp.
  void add(const gl::Program& program, const RenderScene& scene, const ExpandedStrands& expanded) const;
  /// Copies the sums to the texture that is looked up.
  void finish() const;
  void set_uniforms(const gl::Program& program, uint32_t first_unit) const override;
  /// Sets the uniforms of the density only, for lookups along other rays.
  void set_density_uniforms(const gl::Program& program, uint32_t unit) const;
  uint64_t size_bytes() const override { return cell_.size_bytes() + texture_.size_bytes(); }

 private:
  gl::Buffer cell_;
  gl::Texture texture_;
  HairCube cube_;
  glm::vec3 to_light_{0.0f, 1.0f, 0.0f};
  FittedSphere skull_;
};

/// Adds the passes that fill the volume, with a walk of their own.
void add_density_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes,
                        DensityVolume& volume);

}  // namespace strandcast
