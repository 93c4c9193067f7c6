// Expands simulated strands to the points that are drawn: curves through the vertices of key strands, and
// followers between three of them (shaders/lib/strand_style.glsl). What does not change between pictures is
// computed once. No GL.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/render/strand_detail.h"
#include "common/render/strand_style.h"
#include "common/render/tiles/tile_frame.h"
#include "common/simd/variants.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

class StrandExpansion {
 public:
  /// Prepares an asset; `mean_length_m` is that of a key strand at rest.
  StrandExpansion(const SceneAsset& asset, float mean_length_m);

  /// Sets the lengths and counts of the look's style.
  void set_look(const LookDesc& look);
  uint32_t key_count() const { return key_count_; }
  /// Computes the points. `position_m`: (vertex_count x key_count), vertex-major, head space.
  void expand(const std::vector<glm::vec3>& position_m, const StrandDetail& detail, WorkerPool& workers,
              simd::InstructionSet set, StrandPoints& points);
  uint64_t size_bytes() const;

 private:
  uint32_t key_count_;
  uint32_t vertex_count_;
  float mean_length_m_;
  uint32_t max_followers_ = 0;
  StyleNumbers style_;
  // Per root triangle: its keys, whose hair falls to different sides where the first bit of `is_parted` says
  // so.
  std::vector<RootTriangle> triangle_;
  std::vector<uint8_t> is_parted_;
  // Per key strand: samples of its curve, x, y and z in rows of `row_floats`.
  std::vector<float> samples_;
};

}  // namespace strandcast
