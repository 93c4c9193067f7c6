// LightVolume: share of light that reaches each place in the hair. Key strands are summed into cells fixed in
// head space, and optical depth is swept from the light through them. Costs about a millisecond of CPU; no
// GL, one thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/groom/mesh.h"

namespace strandcast {

/// Properties of a scene that the volume needs and that do not change between pictures.
struct LightVolumeDesc {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;  // per strand
  float cell_m = 0.012f;
  float strands_per_key = 1.0f;  // drawn strands that one key strand stands for
  float strand_width_m = 0.0002f;
  float segment_m = 0.0f;  // mean length between two vertices of a strand; 0 = below a cell
  bool has_skull = false;  // an opaque ball under the hair
  FittedSphere skull;
};

/// Largest number of cells per axis; hair outside casts no shadow.
inline constexpr int kMaxLightCells = 64;

class LightVolume {
 public:
  explicit LightVolume(const LightVolumeDesc& desc) : desc_(desc) {}

  /// Builds the volume. `position_m`: (vertex_count x strand_count), vertex-major, head space; `to_light`:
  /// unit, head space.
  void build(const std::vector<glm::vec3>& position_m, const glm::vec3& to_light);

  const glm::ivec3& size() const { return size_; }
  const glm::vec3& origin_m() const { return origin_m_; }
  float cell_m() const { return desc_.cell_m; }
  /// Returns the shares of direct and of ambient light, (size.z x size.y x size.x x 2); 65535 = all.
  const std::vector<uint16_t>& texels() const { return texels_; }
  /// Returns strands crossed per metre in each cell, before light is swept through (for tests).
  const std::vector<float>& crossings_per_m() const { return crossings_per_m_; }

 private:
  void fit_lattice(const std::vector<glm::vec3>& position_m);
  void add_strands(const std::vector<glm::vec3>& position_m);
  void splat(const glm::vec3& point_m, float amount);
  void add_skull();
  void sweep(const glm::vec3& to_light, std::vector<float>& depth) const;
  size_t index(int x, int y, int z) const { return (static_cast<size_t>(z) * size_.y + y) * size_.x + x; }

  LightVolumeDesc desc_;
  glm::ivec3 size_{0};
  glm::vec3 origin_m_{0.0f};
  std::vector<float> crossings_per_m_;
  std::vector<float> depth_;
  std::vector<float> surrounding_;
  std::vector<uint16_t> texels_;
};

}  // namespace strandcast
