// What all kernels of the tile renderer know of one picture (common/render/gl_tiles/tile_block.h), and the looks and lights
// of the laws made from it. Spaces: head space, m; pixels count from the top left.
#include "shared/bindings.h"
#include "shared/limits.h"
#include "shared/tiles.h"
#include "lib/hair_light.glsl"

layout(std140, binding = kBindingTileFrame) uniform TileFrameBlock {
  mat4 clip_from_head;
  mat4 head_from_clip;
  vec4 eye;             // m; w = near, m
  vec4 target;          // size, px; pixels per metre at 1 m; far, m
  vec4 strand;          // width at the root, m; share of it at the tip; where tips begin to fade; unused
  vec4 root_color;      // w = ambient
  vec4 tip_color;       // w = unused
  // schema begin: shader block
  vec4 shading[4];     // numbers of HairLook in their order, from diffuse on
  // schema end
  vec4 to_key;          // unit; w = 1: there is a rim light
  vec4 key_color;
  vec4 to_rim;          // unit
  vec4 rim_color;
  vec4 up;              // unit; w = how far above the skin the hair's shadow is looked up, m
  vec4 skin_color;
  vec4 background;      // linear, at middle height
  vec4 style[3];        // clump, locks, spread, wave | waves, frizz, frizz count, strays | their spread, lengths, short ones
  vec4 lattice_axis[3]; // unit: across, across, away from the key light
  vec4 lattice_origin;  // middle of the first cell, along the axes; w = cell, m
  ivec4 lattice_size;   // cells; w = unused
  ivec4 half_size;      // cells of the other lights
  uvec4 strands;        // drawn, key strands, vertices of each, segments per gap
  uvec4 followers;      // drawn and numbered per triangle; points that a strand has room for; unused
  uvec4 grid;           // tiles across and down, strands that are drawn of those expanded, unused
} u_frame;

// schema begin: shader block reader
HairLook frame_look() {
  return HairLook(u_frame.root_color.rgb, u_frame.tip_color.rgb, u_frame.shading[0].x, u_frame.shading[0].y,
                  u_frame.shading[0].z, u_frame.shading[0].w, u_frame.shading[1].x, u_frame.shading[1].y,
                  u_frame.shading[1].z, u_frame.shading[1].w, u_frame.shading[2].x, u_frame.shading[2].y,
                  u_frame.shading[2].z, u_frame.shading[2].w, u_frame.shading[3].x);
}
// schema end

HairLights frame_lights() {
  return HairLights(u_frame.to_key.xyz, u_frame.key_color.rgb, u_frame.to_rim.xyz, u_frame.rim_color.rgb,
                    u_frame.to_key.w > 0.0, u_frame.up.xyz, u_frame.root_color.w);
}

// Of the lattice, along its axes.
vec3 lattice_cell(vec3 point_m) {
  vec3 along = vec3(dot(point_m, u_frame.lattice_axis[0].xyz), dot(point_m, u_frame.lattice_axis[1].xyz),
                    dot(point_m, u_frame.lattice_axis[2].xyz));
  return (along - u_frame.lattice_origin.xyz) / u_frame.lattice_origin.w;
}
