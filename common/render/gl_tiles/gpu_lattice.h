// GpuLattice: the light lattice (common/render/light_lattice.h) on the GPU. From the points of drawn strands
// it computes the optical depth towards key light, rim light and sky, in three volumes. All calls from the
// context's thread; the frame's uniform block must be bound.
#pragma once

#include "common/gl/pass_plan.h"
#include "common/gl/program.h"
#include "common/render/gl_tiles/grown_buffer.h"
#include "common/render/light_lattice.h"

namespace strandcast {

class GpuLattice final : public gl::Resource {
 public:
  GpuLattice() : Resource("light lattice") {}
  Status prepare(const gl::ShaderLibrary& shaders, const HeadOccupancy& solid);
  /// Sets the rotation of neck and chest from the next build() on.
  void set_bust(const BustRig& rig, const BustTurn& turn);
  /// Builds the volumes from the points and strands bound to kUnitTilePoints and kUnitTileStrands.
  void build(const LatticeFrame& frame, const LightDirections& lights, uint32_t strand_count, float width_m);
  /// Binds the depths to the units that shaders/render/tile_light.glsl reads.
  void bind() const;
  uint64_t size_bytes() const override;

 private:
  void resize(const LatticeFrame& frame);
  void halve(const LatticeFrame& frame, float solid_depth);
  void sweep(const LatticeFrame& frame, std::span<const glm::vec3> to_light, const gl::Texture& depth);

  gl::Program sum_, key_, half_, sweep_, mean_;
  GrownBuffer sums_{"light sums"};
  GrownBuffer halved_{"light halved"};
  GrownBuffer swept_{"light swept"};
  gl::Texture key_depth_, rim_depth_, sky_depth_;
  gl::Texture solid_;
  glm::vec3 solid_origin_m_{0.0f};  // corner of its first cell
  glm::vec3 solid_from_m_{0.0f};
  float solid_reach_m_ = 0.0f;
  glm::mat4 bust_{0.0f};  // turn; pivot, w = 1: it is turned; share of the rig
  glm::ivec3 size_{0};
};

}  // namespace strandcast
