// LightLattice: optical depth of drawn hair between each point and the key light, the rim light and the sky.
// Strands are summed into cells along the key light as integers, so their order does not matter. A running
// sum along the light gives its depth; sweeps through a lattice of half resolution give those of the other
// lights. No GL.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/groom/mesh.h"
#include "common/math/bust.h"
#include "common/render/head_occupancy.h"
#include "common/render/look_lights.h"
#include "common/simd/variants.h"

namespace strandcast {

struct StrandPoints;

/// Default number of cells along the hair's largest side.
inline constexpr uint32_t kLightCells = 112;

/// Properties of a scene that the lattice needs and that do not change between pictures.
struct LightLatticeDesc {
  float extent_m = 0.3f;         // of the hair at rest, its largest side
  uint32_t cells = kLightCells;  // along that side
  bool has_skull = false;        // a ball under the hair that has to have room
  FittedSphere skull;
  std::shared_ptr<const HeadOccupancy> solid;  // none: nothing but hair casts shadows
  BustRig bust = {};                           // of the head's mesh, as it is at rest in `solid`
  simd::InstructionSet set = simd::widest_set();
};

/// Properties of the strands that are summed.
struct LightStrands {
  float width_m = 0.0f;  // at the root
  float tip_scale = 1.0f;
  float tip_fade = 0.0f;
};

/// Optical depth of one stored unit; 16 bits reach 64.
inline constexpr float kLightDepthUnit = 64.0f / 65536.0f;

/// Position and orientation of the lattice's cells.
struct LatticeFrame {
  glm::vec3 axis[3];         // unit: across, across, away from the key light
  glm::vec3 origin_m{0.0f};  // middle of the first cell, along the axes
  float cell_m = 1.0f;
  float soft_m = 1.0f;      // what the head's shade is told apart by: a usual cell, or one that is larger
  glm::ivec3 size{0};       // of the key light's cells
  glm::ivec3 half_size{0};  // of the other lights' cells, twice as large
};

/// Fits the lattice around points of head space plus `room_m` on all sides; of many points only every n-th is
/// used.
LatticeFrame fit_lattice(const LightLatticeDesc& desc, const LightDirections& lights,
                         std::span<const glm::vec3> points_m, float room_m);

/// Optical depth of one unit of the sums of strands; 2^31 units are 32,768.
inline constexpr float kLightSumUnit = 1.0f / 65536.0f;
/// Samples per cell length of a segment: one sample up to two cells long, more if it is longer.
inline constexpr float kLightPiecesPerCell = 0.5f;
inline constexpr int kMaxLightCellsPerAxis = 160;
/// The head as an obstacle to light: its surface lies this deep below the skin, so that roots and skin stay
/// lit, and opacity ramps over this width. Skin looks up its light this far above itself. All in units of
/// LatticeFrame::soft_m.
inline constexpr float kSolidInset = 0.5f;
inline constexpr float kSolidRamp = 0.8f;
inline constexpr float kSkinLift = 0.9f;
/// From this far behind the head on, its edge counts in a wider ramp, which no cell's border shows in. Nearer
/// than that, lit skin would darken itself. Units of LatticeFrame::soft_m.
inline constexpr float kSolidFar = 3.0f;
inline constexpr float kSolidFarInset = 0.2f;
inline constexpr float kSolidFarRamp = 1.6f;
/// kSolidFar in whole cells of a lattice.
int solid_far_cells(const LatticeFrame& frame);
/// Cells along the lattice's sides in which the head has no effect. Lookups outside the lattice use them, and
/// a body that continues there must not shade itself.
inline constexpr int kSolidBorderCells = 2;
/// Optical depth behind the head, times the cube of the largest solidity passed; this makes an edge as soft
/// as the ramp.
inline constexpr float kSolidDepth = 12.0f;
/// Optical depth of the head per LatticeFrame::soft_m for rim light and sky, which sum it up. The sky's is
/// small, because each way stands for a part of the sky that is wide. Halved cells of which less than half is
/// head have none, or skin would shade itself in rings.
inline constexpr float kSolidRimDepth = 2.0f;
inline constexpr float kSolidSkyDepth = 0.2f;
/// The sky's depth is that of the mean light of its ways, when each loses exp(-this * depth) of it.
inline constexpr float kSkyReach = 0.16f;
/// Returns the optical depth that one metre of a strand of this width adds to its cell.
float strand_depth_per_m(const LatticeFrame& frame, float width_m);

/// Stored depths for lookups by kernels.
struct LightLatticeView : LatticeFrame {
  const uint16_t* key = nullptr;     // (size.z x size.y x size.x)
  const uint32_t* others = nullptr;  // (half_size): rim in the low 16 bits, sky in the high ones
  // (half_size): 1 where the eye sees nothing of what lies between the middles of a cell and of its next
  // ones.
  const uint8_t* hidden = nullptr;  // none: everything may be seen
};

class LightLattice {
 public:
  explicit LightLattice(const LightLatticeDesc& desc) : desc_(desc) {}

  /// Builds the lattice; `frame` must come from fit_lattice() with the same lights.
  void build(const LatticeFrame& frame, const StrandPoints& points, const LightStrands& strands,
             const LightDirections& lights, WorkerPool& workers);
  /// Finds what head and hair hide from an eye in head space, after build(); nothing where it is among them.
  void hide_from(const glm::vec3& eye_m);
  /// Sets the rotation of neck and chest from the next build() on.
  void set_bust(const BustTurn& turn) { bust_turn_ = turn; }
  const LightLatticeDesc& desc() const { return desc_; }
  const LightLatticeView& view() const { return view_; }
  uint64_t size_bytes() const;

 private:
  void sum_strands(const StrandPoints& points, const LightStrands& strands, WorkerPool& workers);
  void sweep_key(WorkerPool& workers);
  void store_others(WorkerPool& workers);
  bool has_solid() const { return desc_.solid && !desc_.solid->is_empty(); }
  void find_solid(int y, int z, std::vector<float>& below) const;
  /// Sweeps across the lattice of half resolution; the head has this opacity per LatticeFrame::soft_m.
  std::vector<float> halved_with(float solid_depth) const;
  void sweep_from_eye(const glm::vec3& eye, int axis);
  void sweep(const glm::vec3& to_light, const std::vector<float>& halved, std::vector<float>& depth) const;

  LightLatticeDesc desc_;
  BustTurn bust_turn_{0.0};
  LightLatticeView view_;
  std::vector<std::vector<int32_t>> sums_;  // one lattice per worker that sums
  std::vector<const int32_t*> summed_;      // those of the last build(), at least one
  std::vector<uint16_t> key_;
  std::vector<float> halved_;        // optical depth of strands across a halved cell
  std::vector<float> halved_solid_;  // likewise, how much of the way leads through the head, in whole cells
  std::vector<float> rim_depth_;
  std::array<std::vector<float>, kSkyWays> sky_depth_;  // along each way
  std::vector<uint32_t> others_;
  std::vector<float> eye_depth_;  // in front of a halved cell
  std::vector<uint8_t> hidden_;
};

}  // namespace strandcast
