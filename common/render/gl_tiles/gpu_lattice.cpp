#include "common/render/gl_tiles/gpu_lattice.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>

#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/tiles.h"

namespace strandcast {
namespace {

// Of the kernels that walk a slice of cells, one invocation each.
constexpr uint32_t kSliceGroupColumns = 32;
constexpr uint32_t kSliceGroupRows = 2;

uint64_t cell_count(const glm::ivec3& size) {
  return uint64_t{1} * static_cast<uint32_t>(size.x) * static_cast<uint32_t>(size.y) *
         static_cast<uint32_t>(size.z);
}

void dispatch_cells(int columns, int rows, int slices) {
  glDispatchCompute((static_cast<uint32_t>(columns) + kSliceGroupColumns - 1) / kSliceGroupColumns,
                    (static_cast<uint32_t>(rows) + kSliceGroupRows - 1) / kSliceGroupRows,
                    static_cast<uint32_t>(slices));
}

gl::Texture depth_volume(const char* label, const glm::ivec3& size) {
  const glm::uvec3 cells(size);
  return gl::Texture::volume(label, GL_R32F, cells.x, cells.y, cells.z);
}

void bind_depth_image(const gl::Texture& depth) {
  glBindImageTexture(shader::kImageTileDepth, depth.name(), 0, GL_TRUE, 0, GL_WRITE_ONLY, GL_R32F);
}

}  // namespace

Status GpuLattice::prepare(const gl::ShaderLibrary& shaders, const HeadOccupancy& solid) {
  ASSIGN_OR_RETURN(sum_, gl::Program::make(shaders, {"render/tile_light_sum.comp"}, {}));
  ASSIGN_OR_RETURN(key_, gl::Program::make(shaders, {"render/tile_light_key.comp"}, {}));
  ASSIGN_OR_RETURN(half_, gl::Program::make(shaders, {"render/tile_light_half.comp"}, {}));
  ASSIGN_OR_RETURN(sweep_, gl::Program::make(shaders, {"render/tile_light_sweep.comp"}, {}));
  ASSIGN_OR_RETURN(mean_, gl::Program::make(shaders, {"render/tile_light_mean.comp"}, {}));
  if (solid.is_empty()) return {};
  const glm::uvec3 cells(solid.size);
  solid_ = gl::Texture::volume("head occupancy", GL_R8_SNORM, cells.x, cells.y, cells.z);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage3D(solid_.name(), 0, 0, 0, 0, solid.size.x, solid.size.y, solid.size.z, GL_RED, GL_BYTE,
                      solid.distance.data());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  constexpr float kMostSteps = 127.0f;  // that 1 of the texture stands for
  solid_origin_m_ = solid.origin_m - 0.5f * solid.cell_m;
  solid_from_m_ = 1.0f / (glm::vec3(solid.size) * solid.cell_m);
  solid_reach_m_ = solid.cell_m * kMostSteps / kDistanceStepsPerCell;
  return {};
}

void GpuLattice::set_bust(const BustRig& rig, const BustTurn& turn) {
  bust_ = glm::mat4(0.0f);
  if (!rig.exists() || turn == BustTurn(0.0)) return;
  bust_[0] = glm::vec4(glm::dvec4(turn, std::sqrt(std::max(1.0 - glm::dot(turn, turn), 0.0))));
  bust_[1] = glm::vec4(rig.pivot_m, 1.0f);
  bust_[2] = rig.share;
}

uint64_t GpuLattice::size_bytes() const {
  return sums_.size_bytes() + halved_.size_bytes() + swept_.size_bytes() + key_depth_.size_bytes() +
         rim_depth_.size_bytes() + sky_depth_.size_bytes() + solid_.size_bytes();
}

void GpuLattice::resize(const LatticeFrame& frame) {
  sums_.reserve(cell_count(frame.size) * sizeof(int32_t));
  halved_.reserve(cell_count(frame.half_size) * sizeof(float));
  swept_.reserve(kSkyWays * cell_count(frame.half_size) * sizeof(float));
  if (size_ == frame.size) return;
  size_ = frame.size;
  key_depth_ = depth_volume("key depth", frame.size);
  rim_depth_ = depth_volume("rim depth", frame.half_size);
  sky_depth_ = depth_volume("sky depth", frame.half_size);
}

void GpuLattice::build(const LatticeFrame& frame, const LightDirections& lights, uint32_t strand_count,
                       float width_m) {
  resize(frame);
  glClearNamedBufferData(sums_.buffer().name(), GL_R32I, GL_RED_INTEGER, GL_INT, nullptr);
  sums_.buffer().bind_storage(shader::kBindingDensity);
  halved_.buffer().bind_storage(shader::kBindingTileHalved);
  swept_.buffer().bind_storage(shader::kBindingTileSwept);
  sum_.use();
  sum_.set("u_sum_per_m", strand_depth_per_m(frame, width_m) / kLightSumUnit);
  sum_.set("u_max_pieces", kMaxLightCellsPerAxis);
  sum_.set("u_pieces_per_m", kLightPiecesPerCell / frame.cell_m);
  glDispatchCompute((strand_count + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize, 1, 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  key_.use();
  key_.set("u_sum_unit", kLightSumUnit);
  key_.set("u_solid_depth", kSolidDepth);
  key_.set("u_solid_border", kSolidBorderCells);
  key_.set("u_soft_m", frame.soft_m);
  key_.set("u_solid_near", glm::vec2(kSolidInset, kSolidRamp));
  key_.set("u_solid_far", glm::vec2(kSolidFarInset, kSolidFarRamp));
  key_.set("u_solid_far_cells", solid_far_cells(frame));
  key_.set("u_solid_reach_m", solid_reach_m_);
  key_.set("u_solid_origin_m", solid_origin_m_);
  key_.set("u_solid_from_m", solid_from_m_);
  key_.set("u_bust", bust_);
  if (solid_from_m_.x > 0.0f) solid_.bind(shader::kUnitTileSolid);
  bind_depth_image(key_depth_);
  dispatch_cells(frame.size.x, frame.size.y, 1);
  halve(frame, kSolidSkyDepth);
  sweep(frame, sky_ways(lights.up), sky_depth_);
  if (lights.has_rim) {
    if (solid_from_m_.x > 0.0f) halve(frame, kSolidRimDepth);
    sweep(frame, std::span(&lights.to_rim, 1), rim_depth_);
  } else {
    const float none = 0.0f;
    glClearTexImage(rim_depth_.name(), 0, GL_RED, GL_FLOAT, &none);
  }
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
}

void GpuLattice::halve(const LatticeFrame& frame, float solid_depth) {
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  half_.use();
  half_.set("u_solid_depth", solid_depth);
  half_.set("u_solid_near", glm::vec2(kSolidInset, kSolidRamp));
  dispatch_cells(frame.half_size.x, frame.half_size.y, frame.half_size.z);
}

void GpuLattice::sweep(const LatticeFrame& frame, std::span<const glm::vec3> to_light,
                       const gl::Texture& depth) {
  static_assert(kSkyWays <= 8);
  glm::mat4 ways[2] = {glm::mat4(0.0f), glm::mat4(0.0f)};
  for (size_t i = 0; i < to_light.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      ways[i / 4][static_cast<int>(i % 4)][axis] = glm::dot(to_light[i], frame.axis[axis]);
  const glm::ivec3 size = frame.half_size;
  const int most = std::max({size.x, size.y, size.z});
  sweep_.use();
  sweep_.set("u_ways", ways[0]);
  sweep_.set("u_more_ways", ways[1]);
  for (int slice = 0; slice < most; ++slice) {
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    sweep_.set("u_slice", slice);
    dispatch_cells(most, most, static_cast<int>(to_light.size()));
  }
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  mean_.use();
  mean_.set("u_way_count", static_cast<int>(to_light.size()));
  mean_.set("u_reach", kSkyReach);
  bind_depth_image(depth);
  dispatch_cells(size.x, size.y, size.z);
}

void GpuLattice::bind() const {
  key_depth_.bind(shader::kUnitTileKeyDepth);
  rim_depth_.bind(shader::kUnitTileRimDepth);
  sky_depth_.bind(shader::kUnitTileSkyDepth);
}

}  // namespace strandcast
