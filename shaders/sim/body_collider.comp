// The body below the head: capsules and planes in head space that move during the substep (common/kernels/
// body_input.h). After a substep of any model, vertices and the middles of segments that are nearer to it than their
// clearance move out of it, by one of four responses. `turn` and `sphere` turn segments about their start at their
// length, end then middle, as field_collider.comp does; what hangs on them follows the leader to where the model put
// it. `project` moves vertices alone, and `force` only velocities. Friction holds ends against what they touch, which
// moves: its way in the substep counts. What has passed through the middle of a capsule during the substep goes back to
// the side where it was, so thin and fast ones are not passed. Strands that begin inside stay as deep as they are, and
// come no deeper again than they ever were. One invocation per strand; what touches nothing is not moved, not by a
// rounding either.
#include "sim/carried.glsl"
#include "sim/turned_segment.glsl"

layout(local_size_x = kStrandLocalSize) in;

// 0 = friction, clearance gained to the tip, velocity gained per depth, whether the body is new
// 1 = response, the longest way of a capsule's end in the substep
// then 4 for each capsule: (from, radius), (axis, gain of radius along it), (way of `from`, how far normals lean towards
// the axis, by its length), (gain of that way along the axis, 1 / length^2); a radius of 0 ends the list
// then 2 for each plane: (normal, offset), (way of its surface, whether there is one)
layout(binding = kUnitBody) uniform lookup_table u_body;
layout(binding = kUnitPlaceBefore) uniform samplerBuffer u_before;  // head space, m; w = the clearance it has had
layout(std430, binding = kBindingPlaceBefore) writeonly restrict buffer PlaceBlock { vec4 value[]; } b_before;

const float kClearance = 0.0005;
// Below the clearance that a strand has, so that roundings are no contact.
const float kSlack = 1e-6;
// Two rounds, and more where so much is left: where two capsules meet.
const int kMostRounds = 5;
const float kResidue = 5e-5;
// An end that the middle's turn moved by more than twice this may have met something else.
const float kLookAgain = 2e-4;
const float kFar = 1e6;
// Of a segment's length: what of its side is less is made up by the side where it was.
const float kSideKept = 0.1;
const float kSideNoise = 1e-8;  // squared

struct BodyContact {
  vec3 normal;
  float depth;   // below the clearance, along the normal
  vec3 way;      // of what is touched, in the substep
  vec3 center;   // of the ball that is touched, inside of a capsule
  float radius;  // of that, with the clearance; 0 = a plane
};

// What of the body the point is deepest inside of, or nearest to.
BodyContact deepest_in_body(vec3 point, vec3 before, float clearance) {
  BodyContact deepest = BodyContact(vec3(0.0), -kFar, vec3(0.0), vec3(0.0), 0.0);
  for (uint i = 0u; i < kMaxBodyCapsules; ++i) {
    const vec4 from = look_up(u_body, lane_uint(2u + 4u * i));
    if (!is_any(from.w > 0.0)) break;
    const vec4 axis = look_up(u_body, lane_uint(3u + 4u * i));
    const vec4 way = look_up(u_body, lane_uint(4u + 4u * i));
    const vec4 turn = look_up(u_body, lane_uint(5u + 4u * i));
    const vec3 outward = point - from.xyz;
    const float along = dot(outward, axis.xyz);
    const float beside = max(dot(outward, outward) - along * along * turn.w, 0.0);
    const float share = clamp(along * turn.w + way.w * sqrt(beside), 0.0, 1.0);
    const vec3 radial = outward - share * axis.xyz;
    const float radius = from.w + share * axis.w + clearance;
    const float squared = max(dot(radial, radial), kTinySquared);
    const float inverse = inversesqrt(squared);

    // Where it was, seen from where the capsule was.
    const vec3 axis_then = axis.xyz - turn.xyz;
    const vec3 outward_then = before - (from.xyz - way.xyz);
    const vec3 radial_then = outward_then - clamp(dot(outward_then, axis_then) * turn.w, 0.0, 1.0) * axis_then;
    const vec3 path = radial - radial_then;
    const float squared_then = dot(radial_then, radial_then);
    const float nearest = clamp(-dot(radial_then, path) / max(dot(path, path), kTinySquared), 0.0, 1.0);
    const vec3 passing = radial_then + nearest * path;
    const lane_bool has_passed = dot(radial, radial_then) < 0.0 && squared_then > kTinySquared && radius > 0.0 &&
                                 dot(passing, passing) < radius * radius;

    const vec3 normal =
        select(has_passed, radial_then * inversesqrt(max(squared_then, kTinySquared)), radial * inverse);
    const float depth = radius - select(has_passed, dot(radial, normal), squared * inverse);
    const lane_bool is_deeper = depth > deepest.depth;
    deepest.normal = select(is_deeper, normal, deepest.normal);
    deepest.depth = select(is_deeper, depth, deepest.depth);
    deepest.way = select(is_deeper, way.xyz + share * turn.xyz, deepest.way);
    deepest.center = select(is_deeper, from.xyz + share * axis.xyz, deepest.center);
    deepest.radius = select(is_deeper, radius, deepest.radius);
  }
  for (uint i = 0u; i < kMaxBodyPlanes; ++i) {
    const vec4 way = look_up(u_body, lane_uint(3u + 4u * kMaxBodyCapsules + 2u * i));
    if (!is_any(way.w > 0.0)) break;
    const vec4 plane = look_up(u_body, lane_uint(2u + 4u * kMaxBodyCapsules + 2u * i));
    const float depth = clearance - (dot(plane.xyz, point) - plane.w);
    const lane_bool is_deeper = depth > deepest.depth;
    deepest.normal = select(is_deeper, plane.xyz, deepest.normal);
    deepest.depth = select(is_deeper, depth, deepest.depth);
    deepest.way = select(is_deeper, way.xyz, deepest.way);
    deepest.radius = select(is_deeper, 0.0, deepest.radius);
  }
  return deepest;
}

float distance_to_body(vec3 point) { return -deepest_in_body(point, point, 0.0).depth; }

// The end of a segment turned about its start until it lies on a ball: Woodhouse 2017, figure 4.1, at once, by the
// law of cosines; straight away from the ball where they have no solution. Of their two roots in the plane of segment
// and centre it is the one that the segment is nearer to, unless that is beyond the line from the start to the centre,
// seen from where the end was: nothing gets there but through the ball. Then its mirror image is; and what points nearly
// at the centre, so that its plane says little, leans the more towards where the end was. The side is never shorter than
// kSideKept / sqrt(2) that way, so the choice never flickers: it is at most as many times as unsteady as the segment as
// that is shorter than it, and never leaves the half where the end was.
vec3 turned_onto_ball(vec3 start, vec3 towards, vec3 was, float segment, vec3 center, float radius) {
  const vec3 to_center = center - start;
  const float squared = max(dot(to_center, to_center), kTinySquared);
  const float inverse = inversesqrt(squared);
  const vec3 axis = to_center * inverse;
  const float cosine =
      clamp((segment * segment + squared - radius * radius) * inverse / max(2.0 * segment, kTinySquared), -1.0, 1.0);
  const vec3 side_now = towards - axis * dot(towards, axis);
  const vec3 side_was = was - axis * dot(was, axis);
  const float was_squared = max(dot(side_was, side_was), kTinySquared);
  const vec3 mirrored = side_now - 2.0 * (min(dot(side_now, side_was), 0.0) / was_squared) * side_was;
  const float short_of = max(kSideKept * segment - sqrt(dot(mirrored, mirrored)), 0.0);
  const vec3 kept = mirrored + side_was * (short_of * inversesqrt(was_squared));
  const float noise = kSideNoise * segment * segment;  // shorter than this a side is made of roundings
  vec3 side = select(dot(side_now, side_now) > noise, side_now, any_side(axis));
  side = select(was_squared > noise, kept, side);
  side -= axis * dot(side, axis);  // once more: a short side is made of roundings along the axis
  const float sine = sqrt(1.0 - cosine * cosine) * inversesqrt(max(dot(side, side), kTinySquared));
  return start + segment * (cosine * axis + sine * side);
}

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  const vec4 how = look_up(u_body, lane_uint(0u));
  const vec4 more = look_up(u_body, lane_uint(1u));
  const lane_bool is_new = how.w > 0.0;
  const lane_bool turns = more.x < 1.5;
  const lane_bool is_ball = turns && more.x > 0.5;
  const lane_bool is_force = more.x > 2.5;
  uint at = (u_step.shape.z - 1u) * stride + strand;
  vec3 placed_start = in_head(texelFetch(u_position, int(at)).xyz);  // by the model
  vec3 start = placed_start;
  vec3 start_before = texelFetch(u_before, int(at)).xyz;
  start_before = select(is_broken(start_before), start, start_before);
  b_before.value[at] = vec4(start, 0.0);
  float room = 0.0;  // that the start has to the body, at least
  for (uint i = u_step.shape.z; i < u_step.shape.y; ++i) {
    at += stride;
    const vec4 position = texelFetch(u_position, int(at));
    const vec3 place = in_head(position.xyz);
    const vec3 edge = place - placed_start;
    const float segment = sqrt(dot(edge, edge));
    const lane_bool has_length = segment * segment > kTinySquared;
    vec3 end = place;
    const lane_bool is_led = turns && start != placed_start;
    if (is_any(is_led)) {
      const vec3 along = place - start;
      const float squared = dot(along, along);
      const vec3 direction = select(squared > kTinySquared, along * (segment * inversesqrt(squared)), edge);
      end = select(is_led, start + direction, end);
    }

    const vec4 stored = texelFetch(u_before, int(at));
    const vec3 before = select(is_broken(stored.xyz), end, stored.xyz);
    const float least = kClearance + how.y * position.w;
    const float clearance = select(is_new, -kFar, min(stored.w, least));
    float had = least;  // clearance from now on
    vec3 gained = vec3(0.0);
    room -= segment;
    const vec3 gone = end - before;
    const lane_bool is_near = has_length && room < least + more.y + sqrt(dot(gone, gone));
    lane_bool is_open = is_near;
    for (int attempt = 0; attempt < 2 && is_any(is_open); ++attempt) {
      lane_bool is_deep = is_open;
      for (int round = 0; round < kMostRounds; ++round) {
        const BodyContact contact = deepest_in_body(end, before, clearance);
        room = select(is_open && round == 0, select(is_new, -kFar, clearance - contact.depth), room);
        is_deep = is_deep && contact.depth > (round < 2 ? 0.0 : kResidue);
        if (!is_any(is_deep)) break;
        const vec3 was = before + contact.way;
        const vec3 held = held_back(was, end, contact.normal, how.x * contact.depth);
        const float height = dot(contact.normal, end - start) + contact.depth;
        vec3 out_there = turned_to_height(start, held - start, segment, contact.normal, height);
        if (is_any(is_ball))
          out_there = select(is_ball && contact.radius > 0.0,
                             turned_onto_ball(start, held - start, was - start, segment, contact.center,
                                              contact.radius),
                             out_there);
        out_there = select(turns, out_there, held + contact.depth * contact.normal);
        if (is_any(is_force && is_deep)) {
          const float push = how.z * contact.depth;
          const vec3 slower = held_back(was, end, contact.normal, how.x * push * u_step.head_velocity.w) - end;
          gained = select(is_force && is_deep, contact.normal * push + slower * u_step.push.w, gained);
        }
        end = select(is_deep && !is_force, out_there, end);
        is_deep = is_deep && !is_force;
        room = select(is_deep, min(room, 0.0), room);
      }

      is_open = is_open && turns && room < 0.5 * segment + least + more.y;
      if (!is_any(is_open)) break;
      const BodyContact below = deepest_in_body(0.5 * (start + end), 0.5 * (start_before + before), clearance);
      is_open = is_open && below.depth > 0.0;
      const float height = dot(below.normal, end - start) + 2.0 * below.depth;
      end = select(is_open, turned_to_height(start, end - start, segment, below.normal, height), end);
      room = select(is_open, min(room, 0.0), room);
      is_open = is_open && below.depth > kLookAgain;
    }
    // Who is inside by its own right: how far out it has come.
    const lane_bool is_inside = is_near && clearance < least;
    if (is_any(is_inside)) {
      const float now = min(distance_to_body(end), distance_to_body(0.5 * (start + end))) - kSlack;
      had = select(is_inside, min(max(now, clearance), least), had);
      room = select(is_inside, min(room, 0.0), room);
    }

    const lane_bool is_moved = end != place;
    if (is_any(is_moved || is_force)) {
      const vec3 way = select(is_moved, turned_with_head(end - place), vec3(0.0));
      move_vertex(at, position, way);
      const vec4 velocity = texelFetch(u_velocity, int(at));
      b_velocity.velocity[at] =
          vec4(velocity.xyz + way * u_step.push.w + turned_with_head(gained), velocity.w);
#if MEMORY == 2
      turn_axis(is_moved, at, turned_with_head(edge), turned_with_head(end - start));
#endif
    }
    b_before.value[at] = vec4(end, had);
    placed_start = place;
    start = end;
    start_before = before;
  }
}
