#include "common/render/gl_tiles/gpu_bins.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <vector>

#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/tiles.h"

namespace strandcast {
namespace {

constexpr uint64_t kPairBytes = 2 * sizeof(uint32_t);
// Groups along x of a dispatch at most, as OpenGL guarantees; the rest goes along y.
constexpr uint64_t kMaxGroups = 65535;

void dispatch_segments(uint64_t segments) {
  const uint64_t groups = (segments + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize;
  const uint64_t columns = std::min(groups, kMaxGroups);
  if (groups == 0) return;
  glDispatchCompute(static_cast<uint32_t>(columns), static_cast<uint32_t>((groups + columns - 1) / columns),
                    1);
}

}  // namespace

GpuBins::GpuBins() : Resource("tiles"), first_("tile first", GL_R32UI), pairs_("tile pairs", GL_RG32UI) {}

Status GpuBins::prepare(const gl::ShaderLibrary& shaders) {
  ASSIGN_OR_RETURN(count_, gl::Program::make(shaders, {"render/tile_segments.comp"}, {{"IS_FILLING", 0}}));
  ASSIGN_OR_RETURN(fill_, gl::Program::make(shaders, {"render/tile_segments.comp"}, {{"IS_FILLING", 1}}));
  ASSIGN_OR_RETURN(offsets_, gl::Program::make(shaders, {"render/tile_offsets.comp"}, {}));
  ASSIGN_OR_RETURN(order_, gl::Program::make(shaders, {"render/tile_order.comp"}, {}));
  ASSIGN_OR_RETURN(merge_, gl::Program::make(shaders, {"render/tile_merge.comp"}, {}));
  return {};
}

uint64_t GpuBins::size_bytes() const {
  return counts_.size_bytes() + first_.size_bytes() + totals_.size_bytes() + pairs_.size_bytes() +
         grouped_.size_bytes() + full_.size_bytes();
}

GpuBinCounts GpuBins::count(glm::uvec2 tiles, uint64_t segments) {
  const uint64_t tile_count = uint64_t{tiles.x} * tiles.y;
  counts_.reserve(tile_count * sizeof(uint32_t));
  first_.reserve((tile_count + 1) * sizeof(uint32_t));
  totals_.reserve(shader::kTotalCount * sizeof(uint32_t));
  full_.reserve(tile_count * sizeof(uint32_t));
  for (const GrownBuffer* cleared : {&counts_, &totals_})
    glClearNamedBufferData(cleared->buffer().name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  counts_.buffer().bind_storage(shader::kBindingTileCounts);
  first_.buffer().bind_storage(shader::kBindingTileFirst);
  totals_.buffer().bind_storage(shader::kBindingTileTotals);
  count_.use();
  dispatch_segments(segments);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  offsets_.use();
  glDispatchCompute(1, 1, 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
  std::vector<uint32_t> total(shader::kTotalCount);
  totals_.buffer().read(0, std::as_writable_bytes(std::span(total)));
  return {total[shader::kTotalPairs], total[shader::kTotalSegments], total[shader::kTotalNotFinite]};
}

void GpuBins::fill(glm::uvec2 tiles, uint64_t segments, uint64_t pairs) {
  // Never without storage: an empty list is read nowhere, but its view has to be there.
  pairs_.reserve(std::max(pairs, uint64_t{1}) * kPairBytes);
  grouped_.reserve(std::max(pairs, uint64_t{1}) * kPairBytes);
  if (pairs == 0) return;
  counts_.buffer().bind_storage(shader::kBindingTileCounts);
  pairs_.buffer().bind_storage(shader::kBindingTilePairs);
  fill_.use();
  dispatch_segments(segments);
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
  first_.bind_texels(shader::kUnitTileFirst);
  pairs_.bind_texels(shader::kUnitTilePairs);
  grouped_.buffer().bind_storage(shader::kBindingTileGrouped);
  order_.use();
  full_.buffer().bind_storage(shader::kBindingTileFull);
  glDispatchCompute(tiles.x, tiles.y, 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
  merge_.use();
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, totals_.buffer().name());
  glDispatchComputeIndirect(shader::kTotalFullTiles * sizeof(uint32_t));
  glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, 0);
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
}

void GpuBins::bind() const {
  pairs_.bind_texels(shader::kUnitTileOrder);
  first_.bind_texels(shader::kUnitTileFirst);
}

}  // namespace strandcast
