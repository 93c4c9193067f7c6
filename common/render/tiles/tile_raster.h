// One tile of a picture: the head by ordinary triangles, strands in front of it blended front to back with
// exact coverage, the background behind all, as sRGB. No GL; one thread per tile.
#pragma once

#include <cstdint>
#include <vector>

#include "common/groom/mesh.h"
#include "common/render/tiles/strand_shading.h"
#include "common/render/tiles/tile_bins.h"
#include "common/render/tiles/tile_frame.h"
#include "common/simd/variants.h"

namespace strandcast {

/// The head of one picture.
struct HeadPicture {
  const Mesh* mesh = nullptr;
  const std::vector<float>* cover = nullptr;  // per vertex: 0 bare skin .. 1 under hair
  std::vector<glm::vec4> screen;  // per vertex: x, y in pixels, metres along the view, one over that
  std::vector<glm::vec4> box;     // per triangle, px; empty when it is not drawn
  float shadow_lift_m = 0.0f;     // how far above the skin the hair's shadow is looked up
};

/// Projects the mesh and finds its boxes.
void place_head(const View& view, WorkerPool& workers, HeadPicture& head);

/// What all tiles of a picture share.
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
/// A table for TileInput::srgb.
std::vector<uint8_t> make_srgb_table();
/// A table for TileInput::linear: what lies in the middle of the steps that become this value, so that what
/// nothing covers stays as it is.
std::vector<float> make_linear_table(const std::vector<uint8_t>& srgb);

/// Of one worker, reused from tile to tile.
struct TileScratch {
  std::vector<uint64_t> order;
  std::vector<uint64_t> sorted;
};

struct TileArguments {
  const TileInput* input;
  TileScratch* scratch;
  uint32_t tile;
};
void draw_tile(simd::InstructionSet set, const TileArguments& arguments);

}  // namespace strandcast
