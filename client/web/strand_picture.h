// Pictures of strands for scripts, as plain functions like those of strand_core.h. Strands are expanded, lit
// and sorted for a graphics card, or drawn here tile by tile if there is none. One thread. Any call may grow
// the memory, so scripts must make new views of it after each.
#pragma once

#include <cstddef>
#include <cstdint>

struct StrandPicture;

/// A look's numbers: all of LookDesc (common/scene/scene_desc.h) except its colour name and methods.
// schema begin: look block
// clang-format off
struct StrandPictureLook {
  float root_color[3];  // 0
  float tip_color[3];  // 3
  float strand_radius_m;  // 6
  float tip_scale;  // 7
  float followers;  // 8
  float segments;  // 9
  float light_direction[3];  // 10
  float light_color[3];  // 13
  float ambient;  // 16
  float background[3];  // 17
  float skin_color[3];  // 20
  float eumelanin;  // 23
  float pheomelanin;  // 24
  float rim_direction[3];  // 25
  float rim_color[3];  // 28
  float exposure;  // 31
  float style_clump;  // 32
  float style_locks;  // 33
  float style_spread;  // 34
  float style_wave_m;  // 35
  float style_wave_count;  // 36
  float style_frizz_m;  // 37
  float style_frizz_count;  // 38
  float style_stray_share;  // 39
  float style_stray_spread;  // 40
  float style_length_spread;  // 41
  float style_short_share;  // 42
  float style_tip_fade;  // 43
  float shading_diffuse;  // 44
  float shading_scatter;  // 45
  float shading_highlight;  // 46
  float shading_transmission;  // 47
  float shading_second_highlight;  // 48
  float shading_highlight_width_deg;  // 49
  float shading_cuticle_deg;  // 50
  float shading_cuticle_spread_deg;  // 51
  float shading_root_darkening;  // 52
  float shading_strand_variation;  // 53
  float shading_lock_variation;  // 54
  float shading_warmth_variation;  // 55
  float shading_wetness;  // 56
};
static_assert(sizeof(StrandPictureLook) == 57 * sizeof(float));
// clang-format on
// schema end

/// View and size of one picture.
struct StrandPictureView {
  float width_px, height_px;
  float offset_m[3], target_m[3], fov_y_rad;  // of the camera
  float head_rotation[4];                     // w x y z
  float strand_share;                         // of those that a picture of this size shows
  float bust[3];                              // of the newest state
};
static_assert(sizeof(StrandPictureView) == 17 * sizeof(float));

/// Locations of the results for scripts; pointers are offsets in the module's memory.
struct StrandPictureParts {
  uint32_t block;          // 0: TileBlock, as shaders/render/tile_frame.glsl declares it
  uint32_t block_bytes;    // 4
  uint32_t point_count;    // 8
  uint32_t points;         // 12: (point_count + 2) x 3 f32: m, head space, one more at both ends
  uint32_t strands;        // 16: (strand_count) x 4 u32: first point, points, number among all, lock
  uint32_t strand_count;   // 20
  uint32_t strand_of;      // 24: (point_count) u32
  uint32_t layout_number;  // 28: another one where `strands` and `strand_of` are others
  uint32_t corner_count;   // 32
  uint32_t corners;  // 36: (corner_count) u32: triangles from back to front; point i has corners 2 i, 2 i + 1
  uint32_t key_depth;        // 40: (lattice_size) halves
  uint32_t other_depth;      // 44: 2 x (half_size) halves: rim, then sky
  uint32_t lattice_size[3];  // 48
  uint32_t half_size[3];     // 60
  uint32_t light_number;     // 72: another one where the depths are others
  uint32_t rgba;             // 76: (height x width x 4) of strand_picture_draw_tiles(), top row first
  uint32_t tile_count;       // 80: of the picture begun
  uint32_t head_number;      // 84: another one where the head's positions and normals are others
};
static_assert(sizeof(StrandPictureParts) == 88);

/// Mesh of the head under the hair.
struct StrandPictureHead {
  uint32_t vertex_count;    // 0
  uint32_t triangle_count;  // 4
  uint32_t positions;       // 8: (vertex_count) x 3 f32, m, head space
  uint32_t normals;         // 12: likewise
  uint32_t covers;          // 16: (vertex_count) f32: 0 bare skin .. 1 under hair
  uint32_t triangles;       // 20: (triangle_count) x 3 u32
};
static_assert(sizeof(StrandPictureHead) == 24);

extern "C" {

/// Makes the built-in head, which takes a while, before an asset that has it is here.
void strand_picture_expect_asset(void);
/// Makes a picture from the payload of an asset message; nullptr on failure, when strand_core_error() says
/// why.
StrandPicture* strand_picture_make(const std::byte* payload, size_t size_bytes);
void strand_picture_delete(StrandPicture* picture);
const StrandPictureHead* strand_picture_head(const StrandPicture* picture);

/// Sets the look; `hair_color` is a name of common/scene/hair_color.h.
void strand_picture_set_look(StrandPicture* picture, const StrandPictureLook* look, const char* hair_color,
                             size_t hair_color_bytes);
/// Returns the memory for the next state's positions: head space, m, (vertex_count x strand_count x 3), all
/// strands.
float* strand_picture_positions(StrandPicture* picture);
/// Notes that the positions have changed.
void strand_picture_changed(StrandPicture* picture);

/// Prepares strands for a graphics card; nullptr for an invalid view.
const StrandPictureParts* strand_picture_prepare(StrandPicture* picture, const StrandPictureView* view);
/// Begins a picture that this processor draws; strand_picture_draw_tiles() continues it.
const StrandPictureParts* strand_picture_begin(StrandPicture* picture, const StrandPictureView* view);
/// Draws some tiles of the picture, so that other work can run between calls. Call no other function of the
/// picture until all tiles are drawn.
void strand_picture_draw_tiles(StrandPicture* picture, uint32_t begin, uint32_t end);
}
