// The head as a distance field (common/groom/distance_field.h) that strands collide with: after a substep of any
// model, a segment whose end or middle is nearer to the skin than its clearance is turned about its start, at its
// length, until it is not: rounds for the end, until it is there from either side, then one for the middle, and both
// once more where that one was large. The clearance is half a millimetre, or what the groom itself has there: strands
// of real grooms begin inside, and nothing pops. Friction holds end and middle against sliding over the skin. What hangs
// on it follows the leader to where the model put it. Seen from the head throughout, so the skin moves with it, and the
// bust's with the chest (sim/bust.glsl); what a vertex is moved by counts as an impulse, once in its velocity. One
// invocation per strand; what touches nothing is not written, not by a rounding either.
#include "sim/carried.glsl"
#include "sim/turned_segment.glsl"

layout(local_size_x = kStrandLocalSize) in;

layout(binding = kUnitField) uniform lookup_table u_field;           // distances, m; 2 x 2 nodes in x and y
layout(binding = kUnitPlaceBefore) uniform samplerBuffer u_before;  // head space, m; after the substep before
layout(std430, binding = kBindingPlaceBefore) writeonly restrict buffer PlaceBlock { vec4 value[]; } b_before;

uniform float u_origin_x;  // of the grid; head space, m
uniform float u_origin_y;
uniform float u_origin_z;
uniform float u_cells_per_m;
uniform float u_last_x;  // cell along each axis
uniform float u_last_y;
uniform float u_last_z;
uniform float u_row_nodes;
uniform float u_slice_nodes;

const float kClearance = 0.0005;
// Below the groom's own clearance, so that roundings are no contact.
const float kSlack = 1e-6;
// Distances between nodes change by at most so much per way.
const float kMostSlope = 1.3;
const float kLeastSlopeSquared = 0.25;
// Rounds until no more than so much is left, either way: skin is round, and bends where a bust is turned.
const int kMostRounds = 5;
const float kResidue = 2e-6;
// An end that the middle's turn moved by more than twice this may have met something else.
const float kLookAgain = 2e-4;
const float kFarFromBend = 1e6;

// xyz = gradient, w = distance: trilinear between nodes, of the skin at rest.
vec4 sample_at_rest(vec3 point) {
  const vec3 at = (point - vec3(u_origin_x, u_origin_y, u_origin_z)) * u_cells_per_m;
  const vec3 cell = vec3(floor(clamp(at.x, 0.0, u_last_x)), floor(clamp(at.y, 0.0, u_last_y)),
                         floor(clamp(at.z, 0.0, u_last_z)));
  const vec3 f = vec3(clamp(at.x - cell.x, 0.0, 1.0), clamp(at.y - cell.y, 0.0, 1.0),
                      clamp(at.z - cell.z, 0.0, 1.0));
  const float index = cell.z * u_slice_nodes + (cell.y * u_row_nodes + cell.x);
  const vec4 low = look_up(u_field, lane_uint(index));
  const vec4 high = look_up(u_field, lane_uint(index + u_slice_nodes));
  const vec4 rise = high - low;
  const vec4 here = low + f.z * rise;
  const float left = here.x + f.y * (here.z - here.x);
  const float right = here.y + f.y * (here.w - here.y);
  const float near = here.x + f.x * (here.y - here.x);
  const float far = here.z + f.x * (here.w - here.z);
  const float rise_near = rise.x + f.x * (rise.y - rise.x);
  const float rise_far = rise.z + f.x * (rise.w - rise.z);
  return vec4(u_cells_per_m * vec3(right - left, far - near, rise_near + f.y * (rise_far - rise_near)),
              near + f.y * (far - near));
}

// The same of the skin as it is: where the place would be at rest, and the gradient turned back.
vec4 sample_field(vec3 point) {
  vec4 found = vec4(0.0);
  if (u_step.bust[2].w > 0.0) {
    const vec3 pivot = u_step.bust[2].xyz;
    const vec4 turn = u_step.bust[0];
    const float part = bust_part_at(point, turn, pivot, u_step.bust[3]);
    found = sample_at_rest(pivot + turned_by_part(point - pivot, part, -turn.xyz, turn.w));
    found = vec4(turned_by_part(found.xyz, part, turn.xyz, turn.w), found.w);
  } else {
    found = sample_at_rest(point);
  }
  return found;
}

// How far the place is from where neck and skin bend: there distances change faster than kMostSlope says. Head and
// chest, where they are rigid, end at planes.
float way_to_bend(vec3 point) {
  float way = kFarFromBend;
  if (u_step.bust[2].w > 0.0) {
    const vec3 pivot = u_step.bust[2].xyz;
    const vec4 turn = u_step.bust[0];
    const vec4 share = u_step.bust[3];
    const float down = share.w - dot(share.xyz, point);
    const vec3 rest = pivot + turned_by_part(point - pivot, 1.0, -turn.xyz, turn.w);
    const float down_at_rest = share.w - dot(share.xyz, rest);
    way = max(-down, min(down, down_at_rest - 1.0)) * inversesqrt(max(dot(share.xyz, share.xyz), kTinySquared));
  }
  return way;
}

float clearance_at(vec3 groomed) { return min(kClearance, sample_at_rest(groomed).w - kSlack); }

// Where what lay on the skin before the substep is now.
vec3 carried_by_bust(vec3 before) {
  vec3 carried = before;
  if (u_step.bust[2].w > 0.0) carried = moved_with_bust(before);
  return carried;
}

vec3 normal_of(vec4 found) { return found.xyz * inversesqrt(max(dot(found.xyz, found.xyz), kTinySquared)); }

// How far the place is below its clearance, along the normal.
float depth_of(vec4 found, float clearance) {
  return (clearance - found.w) * inversesqrt(max(dot(found.xyz, found.xyz), kLeastSlopeSquared));
}

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  uint at = (u_step.shape.z - 1u) * stride + strand;
  vec3 placed_start = in_head(texelFetch(u_position, int(at)).xyz);  // by the model
  vec3 start = placed_start;
  vec3 start_before = start;
  float room = 0.0;  // that the start has to the skin, at least
  for (uint i = u_step.shape.z; i < u_step.shape.y; ++i) {
    at += stride;
    const vec4 position = texelFetch(u_position, int(at));
    const vec3 place = in_head(position.xyz);
    const vec3 edge = place - placed_start;
    const float segment = sqrt(dot(edge, edge));
    const lane_bool has_length = segment * segment > kTinySquared;
    vec3 end = place;
    const lane_bool is_led = start != placed_start;
    if (is_any(is_led)) {
      const vec3 along = place - start;
      const float squared = dot(along, along);
      const vec3 direction = select(squared > kTinySquared, along * (segment * inversesqrt(squared)), edge);
      end = select(is_led, start + direction, end);
    }
    const vec3 stored = texelFetch(u_before, int(at)).xyz;
    const vec3 before = select(is_broken(stored), end, stored);

    room -= kMostSlope * segment;
    const lane_bool is_near = room < kClearance && has_length;
    lane_bool is_open = is_near;
    for (int attempt = 0; attempt < 2 && is_any(is_open); ++attempt) {
      vec4 found = sample_field(end);
      room = select(is_open, min(found.w, way_to_bend(end)), room);
      lane_bool is_deep = is_open && found.w < kClearance;
      if (is_any(is_deep)) {
        const lane_bool was_deep = is_deep;
        const float clearance = clearance_at(texelFetch(u_rest, int(at)).xyz);
        is_deep = is_deep && found.w < clearance;
        const vec3 was = carried_by_bust(before);
        for (int round = 0; round < kMostRounds; ++round) {
          if (round > 0) found = sample_field(end);
          is_deep = is_deep && (round == 0 || abs(clearance - found.w) > kResidue);
          if (!is_any(is_deep)) break;
          const vec3 normal = normal_of(found);
          const float depth = depth_of(found, clearance);
          const vec3 held = held_back(was, end, normal, u_step.contact.x * max(depth, 0.0));
          const float height = dot(normal, end - start) + depth;
          end = select(is_deep, turned_to_height(start, held - start, segment, normal, height), end);
        }
        room = select(was_deep, min(room, 0.0), room);
      }

      is_open = is_open && room < 0.5 * kMostSlope * segment + kClearance;
      if (!is_any(is_open)) break;
      const vec3 middle = 0.5 * (start + end);
      const vec4 below = sample_field(middle);
      is_open = is_open && below.w < kClearance;
      if (!is_any(is_open)) break;
      const float clearance =
          clearance_at(0.5 * (texelFetch(u_rest, int(at - stride)).xyz + texelFetch(u_rest, int(at)).xyz));
      is_open = is_open && below.w < clearance;
      const vec3 normal = normal_of(below);
      const float depth = depth_of(below, clearance);
      const vec3 held =
          held_back(carried_by_bust(0.5 * (start_before + before)), middle, normal, u_step.contact.x * depth);
      const float height = dot(normal, end - start) + 2.0 * depth;
      end = select(is_open, turned_to_height(start, held - start, segment, normal, height), end);
      room = select(is_open, min(room, 0.0), room);
      is_open = is_open && depth > kLookAgain;
    }

    const lane_bool is_moved = end != place;
    if (is_any(is_moved)) {
      const vec3 way = select(is_moved, turned_with_head(end - place), vec3(0.0));
      move_vertex(at, position, way);
      const vec4 velocity = texelFetch(u_velocity, int(at));
      b_velocity.velocity[at] = vec4(velocity.xyz + way * u_step.push.w, velocity.w);
#if MEMORY == 2
      turn_axis(is_moved, at, turned_with_head(edge), turned_with_head(end - start));
#endif
    }
    b_before.value[at] = vec4(end, 0.0);
    placed_start = place;
    start = end;
    start_before = before;
  }
}
