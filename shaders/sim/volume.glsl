// The hair volume around a vertex (common/kernels/volume/hair_volume.h): density of hair, its slope, and how the
// hair there moves, trilinear between eight nodes in head space.
#include "sim/step.glsl"

// Where the grid begins, in cells, w = cells per metre; nodes along each axis; then the nodes, x fastest: mean
// velocity relative to the head joint in world axes, m/s; w = density, m/m^3. With extras then as many of the
// share of the wind that comes there, and with a target as many of the density beyond the target's
// (pack_corners() in common/kernels/volume/volume_extras.h).
layout(binding = kUnitVolume) uniform lookup_table u_volume;

const uint kVolumeHeader = 2u;

struct VolumeGrid {
  vec3 first;
  float per_cell;  // cells per metre
  vec3 nodes;
};

struct VolumeHere {
  vec3 velocity;
  float density;
  vec3 slope;  // of the density, per metre, head space
};

// Where a point lies between nodes.
struct VolumePlace {
  lane_uint front;  // element of the node before it along each axis
  lane_uint back;   // the one a layer behind
  lane_uint row;
  vec3 share;
  lane_bool is_inside;
};

// Trilinear between eight elements: the value, and how it changes along x, y and z per cell, of the component
// that is asked for.
struct VolumeValue {
  vec4 x0;  // differences along x, front and back, and along y
  vec4 x1;
  vec4 y0;
  vec4 y1;
  vec4 z;
  vec4 value;
};

VolumeGrid volume_grid() {
  const vec4 first = look_up(u_volume, lane_uint(0u));
  const vec4 nodes = look_up(u_volume, lane_uint(1u));
  return VolumeGrid(first.xyz, first.w, nodes.xyz);
}

// `point` is head-relative in world axes. A place that is not inside is some other one.
VolumePlace volume_place(VolumeGrid grid, vec3 point) {
  const vec3 at = in_head(point) * grid.per_cell - grid.first;
  const vec3 last = grid.nodes - 1.0;
  VolumePlace place;
  place.is_inside =
      at.x >= 0.0 && at.y >= 0.0 && at.z >= 0.0 && at.x < last.x && at.y < last.y && at.z < last.z;
  const vec3 held = select(place.is_inside, at, vec3(0.0));
  const vec3 base = vec3(floor(held.x), floor(held.y), floor(held.z));
  place.share = held - base;
  // Whole numbers below 2^24: exact.
  place.row = lane_uint(grid.nodes.x);
  place.front =
      lane_uint((base.z * grid.nodes.y + base.y) * grid.nodes.x + base.x) + lane_uint(kVolumeHeader);
  place.back = place.front + lane_uint(grid.nodes.x * grid.nodes.y);
  return place;
}

VolumeValue volume_value(VolumePlace place, lane_uint offset) {
  const lane_uint front = place.front + offset;
  const lane_uint back = place.back + offset;
  const lane_uint front_row = front + place.row;
  const lane_uint back_row = back + place.row;
  const lane_uint one = lane_uint(1u);
  const vec4 n00 = look_up(u_volume, front);
  const vec4 n10 = look_up(u_volume, front_row);
  const vec4 n01 = look_up(u_volume, back);
  const vec4 n11 = look_up(u_volume, back_row);
  const vec4 x00 = look_up(u_volume, front + one) - n00;
  const vec4 x10 = look_up(u_volume, front_row + one) - n10;
  const vec4 x01 = look_up(u_volume, back + one) - n01;
  const vec4 x11 = look_up(u_volume, back_row + one) - n11;
  const vec3 share = place.share;
  const vec4 e00 = n00 + share.x * x00;
  const vec4 e01 = n01 + share.x * x01;
  VolumeValue found;
  found.x0 = x00 + share.y * (x10 - x00);
  found.x1 = x01 + share.y * (x11 - x01);
  found.y0 = (n10 + share.x * x10) - e00;
  found.y1 = (n11 + share.x * x11) - e01;
  const vec4 f0 = e00 + share.y * found.y0;
  found.z = (e01 + share.y * found.y1) - f0;
  found.value = f0 + share.z * found.z;
  return found;
}

// Beyond the grid there is no hair.
VolumeHere volume_at(VolumeGrid grid, VolumePlace place) {
  const VolumeValue found = volume_value(place, lane_uint(0u));
  const vec3 slope =
      vec3(found.x0.w + place.share.z * (found.x1.w - found.x0.w),
           found.y0.w + place.share.z * (found.y1.w - found.y0.w), found.z.w);
  VolumeHere here;
  here.velocity = select(place.is_inside, found.value.xyz, vec3(0.0));
  here.density = select(place.is_inside, found.value.w, 0.0);
  here.slope = select(place.is_inside, grid.per_cell * slope, vec3(0.0));
  return here;
}

#if HAS_EXTRAS
// One number of the extras between eight nodes, and how it changes along x, y and z per cell.
struct VolumeNumber {
  float value;
  vec3 slope;
};

// Trilinear; `part` counts the extras from 1.
VolumeNumber volume_number(VolumeGrid grid, VolumePlace place, uint part) {
  const lane_uint offset = lane_uint(grid.nodes.x * grid.nodes.y * grid.nodes.z) * lane_uint(part);
  const vec4 front = look_up(u_volume, place.front + offset);
  const vec4 back = look_up(u_volume, place.back + offset);
  const vec3 share = place.share;
  const float x00 = front.y - front.x;
  const float x10 = front.w - front.z;
  const float x01 = back.y - back.x;
  const float x11 = back.w - back.z;
  const float e00 = front.x + share.x * x00;
  const float e01 = back.x + share.x * x01;
  const float y0 = (front.z + share.x * x10) - e00;
  const float y1 = (back.z + share.x * x11) - e01;
  const float x0 = x00 + share.y * (x10 - x00);
  const float x1 = x01 + share.y * (x11 - x01);
  const float f0 = e00 + share.y * y0;
  const float z = (e01 + share.y * y1) - f0;
  return VolumeNumber(f0 + share.z * z, vec3(x0 + share.z * (x1 - x0), y0 + share.z * (y1 - y0), z));
}

// What of the wind comes through; beyond the grid all of it does.
float volume_wind(VolumeGrid grid, VolumePlace place) {
  const VolumeNumber found = volume_number(grid, place, 1u);
  return select(place.is_inside, found.value, 1.0);
}

// Slope of the density beyond the target's, per metre, head space.
vec3 volume_excess_slope(VolumeGrid grid, VolumePlace place) {
  const VolumeNumber found = volume_number(grid, place, 2u);
  return select(place.is_inside, grid.per_cell * found.slope, vec3(0.0));
}
#endif
