// Draws one tile of a picture as sRGB: the head as triangles, strands in front of it blended front to back
// with exact coverage, the background behind. No GL; one thread per tile.
#pragma once

#include <cstdint>
#include <vector>

#include "common/groom/mesh.h"
#include "common/render/tiles/strand_shading.h"
#include "common/render/tiles/tile_bins.h"
#include "common/render/tiles/tile_frame.h"
#include "common/simd/variants.h"

namespace strandcast {

/// The head in one picture.
struct HeadPicture {
  const Mesh* mesh = nullptr;
  const std::vector<float>* cover = nullptr;  // per vertex: 0 bare skin .. 1 under hair
  std::vector<glm::vec4> screen;  // per vertex: x, y in pixels, metres along the view, one over that
  std::vector<glm::vec4> box;     // per triangle, px; empty when it is not drawn
  float shadow_lift_m = 0.0f;     // how far above the skin the hair's shadow is looked up
};

/// Projects the mesh and computes the boxes of its triangles.
void place_head(const View& view, WorkerPool& workers, HeadPicture& head);

/// Inputs shared by all tiles of a picture.
struct TileInput {
  const StrandPoints* points;
  const TileBins* bins;
  const HeadPicture* head;
  const ShadeInput* shade;
  TileGrid grid;
  glm::vec3 background;  // linear, at middle height
  const uint8_t* srgb;   // (kSrgbSteps + 1) of equal steps of 0 .. 1
  uint8_t* rgba;         // (height x width x 4), top row first
  // Behind all instead of the background: sRGB, of the same shape; null: the background.
  const uint8_t* backdrop = nullptr;
  const float* linear = nullptr;  // of each value of sRGB, for the backdrop
};
inline constexpr uint32_t kSrgbSteps = 4096;
/// Returns the table for TileInput::srgb.
std::vector<uint8_t> make_srgb_table();
/// Returns the table for TileInput::linear. Each entry is the middle of the linear range that rounds to an
/// sRGB value, so that uncovered pixels keep their value.
std::vector<float> make_linear_table(const std::vector<uint8_t>& srgb);

/// Memory of one worker, reused from tile to tile.
struct TileScratch {
  std::vector<uint64_t> order;
  std::vector<uint64_t> sorted;
  std::vector<StrandPoint> end;  // two of each segment
};

struct TileArguments {
  const TileInput* input;
  TileScratch* scratch;
  uint32_t tile;
};
void draw_tile(simd::InstructionSet set, const TileArguments& arguments);

}  // namespace strandcast
