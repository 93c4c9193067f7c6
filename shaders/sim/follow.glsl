// Prediction and Follow-The-Leader placement of one vertex, with colliders and their friction. Woodhouse 2017,
// sections 2.1.4 and 4.2.3.
#pragma variant HAS_PINNED_TAIL 0 1
#include "lib/hash.glsl"
#include "sim/collider.glsl"
#include "sim/gust.glsl"

struct Vertex {
  vec3 target;     // groomed shape, turned with the head
  float segment;   // rest length of the segment before it
  vec3 old;        // position before the substep
  float arc;       // 0 at the root, 1 at the tip
  vec3 predicted;  // where forces alone would take it
  vec3 velocity;   // before the substep, relative to the head joint's during it
#ifdef BEGINS_INSIDE
  vec3 groomed;    // `target` is something else
#endif
  float inertia;   // how hard it holds to the prediction: 1 + what drag and pull add in an implicit step
};

// Thickness of this strand over the mean, squared, and the inverse of that: what pull and drag go with (see
// server/sim/strand_parameters.h). Kernels whose rows have the parameter set it first.
vec2 g_thickness = vec2(1.0);

void set_thickness(uint strand) {
  const uvec3 bits = floatBitsToUint(texelFetch(u_rest, int(strand)).xyz);
  const lane_uint hash = mix_u32(mix_u32(mix_u32(bits.x) ^ bits.y) ^ bits.z);
  const float thickness = 1.0 + u_step.contact.w * (2.0 * unit_float(hash) - 1.0);
  g_thickness = vec2(thickness * thickness, 1.0 / (thickness * thickness));
}

// What of a follower's correction its leader takes back: of a thrust, which points away from the leader, only
// the share that is kept.
vec3 taken_back(vec3 correction, vec3 along) {
  const float thrust = max(dot(correction, along), 0.0) / max(dot(along, along), kTinySquared);
  return correction - (u_step.contact.z * thrust) * along;
}

// Groom and a state of a vertex, not yet predicted. A broken state starts again from the groomed shape.
Vertex vertex_from(uint at, vec3 stored, float arc, vec3 stored_velocity) {
  const vec4 rest = texelFetch(u_rest, int(at));
  Vertex vertex;
  vertex.target = turned_with_head(rest.xyz);
  vertex.segment = rest.w;
  vertex.arc = arc;
  const lane_bool is_sane = !is_broken(stored) && !is_broken(stored_velocity);
  vertex.old = select(is_sane, stored, vertex.target);
  vertex.predicted = vertex.old;
  vertex.velocity = select(is_sane, stored_velocity - u_step.head_velocity.xyz, vec3(0.0));
  vertex.inertia = 1.0;
  return vertex;
}

Vertex read_vertex(uint at) {
  const vec4 state = texelFetch(u_position, int(at));
  return vertex_from(at, state.xyz, state.w, texelFetch(u_velocity, int(at)).xyz);
}

// Of the pull to the groomed shape, 1/s^2; `arc` is 0 at the root and 1 at the tip.
float style_stiffness(float arc) {
  const float from_tip = 1.0 - arc;
  return g_thickness.x * u_step.style.x * mix(u_step.style.y, 1.0, from_tip * from_tip);
}

// Velocity gained from what carries the groom's weight.
vec3 support_of(float stiffness) { return min(1.0, stiffness * u_step.support.w) * u_step.support.xyz; }

// Velocity gained by the pull to the groomed shape at the end of the substep, and by what it is more, or carries
// more of the weight, where it looks further ahead than that.
vec3 pulled(Vertex vertex, float stiffness) {
  const float pull = u_step.head_velocity.w * stiffness;
  vec3 gained = pull * (vertex.target - vertex.old);
  const uniform_float further = (u_step.wind.w - u_step.head_velocity.w) * u_step.push.w;
  if (further != 0.0) {
    const vec3 held = pull * vertex.target + support_of(stiffness);
    gained += further * (held - before_the_turn(held));
  }
  return gained;
}

// How fast it brakes a strand's own motion, 1/s.
float pull_rate(float stiffness) { return u_step.wind.w * stiffness; }

// Implicit in the drag and in the pull to the groomed shape, seen from the head joint (see predict() in
// server/sim/reference_strands.cpp for the equation).
Vertex predicted_from(Vertex vertex) {
  const float h = u_step.head_velocity.w;
  const float drag = g_thickness.y * u_step.contact.y;
  const float stiffness = style_stiffness(vertex.arc);
  const vec3 more_wind = (g_thickness.y - 1.0) * (h * u_step.contact.y) * u_step.wind.xyz;
  const vec3 push =
      u_step.push.xyz + support_of(stiffness) + (h * drag) * gust_velocity(vertex.old) + more_wind;
  vertex.inertia = 1.0 + h * (drag + pull_rate(stiffness));
  const vec3 moved = (vertex.velocity + push + pulled(vertex, stiffness)) / vertex.inertia;
  vertex.predicted = vertex.old + h * within_speed_limit(moved);
  return vertex;
}

Vertex predict(uint at) { return predicted_from(read_vertex(at)); }

// From a state of one's own.
Vertex predict_from(uint at, vec3 stored, vec3 stored_velocity) {
  return predicted_from(vertex_from(at, stored, texelFetch(u_position, int(at)).w, stored_velocity));
}

// Coulomb friction in displacements: sliding over the collider, which turns with the head or the bust, is undone
// up to the friction coefficient times the depth that the collider has to push back.
vec3 held_by_friction(vec3 old, vec3 end, vec4 sphere) {
  const vec3 outward = end - sphere.xyz;
  const float squared = max(dot(outward, outward), kTinySquared);
  const float inverse = inversesqrt(squared);
  const vec3 normal = outward * inverse;
  const vec3 slip = end - carried_by_skin(old);
  const vec3 sliding = slip - normal * dot(slip, normal);
  const float most = u_step.contact.x * (sphere.w - squared * inverse);
  return end - sliding * min(1.0, most * inversesqrt(max(dot(sliding, sliding), kTinySquared)));
}

// The end of a vertex's segment: as near to its prediction as the segment's length from `start`, the
// colliders and, with a pinned tail, the distance `reach` to `anchor` allow (exactly there for the last free
// vertex). `pushed` is what colliders moved it by.
vec3 placed(vec3 start, vec3 start_target, Vertex vertex, vec3 anchor, float reach, bool is_last,
            out vec3 pushed) {
  pushed = vec3(0.0);
  vec3 along = vertex.predicted - start;
  float squared = dot(along, along);
  // No direction to keep: take the groomed one.
  const vec3 groomed = vertex.target - start_target;
  const lane_bool has_direction = squared > kTinySquared;
  along = select(has_direction, along, groomed);
  squared = select(has_direction, squared, max(dot(groomed, groomed), kTinySquared));
  vec3 direction = along * inversesqrt(squared);
  vec3 end = start + vertex.segment * direction;

#if COLLIDERS >= 1
  for (int round = 0; round < PUSH_ROUNDS; ++round) {
#ifdef BEGINS_INSIDE
    vec4 deepest = deepest_collider(end);
    lane_bool is_inside = deepest.w > 0.0;
    if (!is_any(is_inside)) break;
    deepest = around_groomed(deepest, groomed_on_bust(vertex.groomed));
    const vec3 outward = end - deepest.xyz;
    is_inside = is_inside && dot(outward, outward) < deepest.w * deepest.w;
#else
    const vec4 deepest = deepest_collider(end);
    const lane_bool is_inside = deepest.w > 0.0;
#endif
    if (!is_any(is_inside)) break;
    const float per_segment = 1.0 / max(vertex.segment, kTinySquared);
    const vec3 held = (held_by_friction(vertex.old, end, deepest) - start) * per_segment;
    const vec3 turned = turned_onto_sphere(start, held, vertex.segment, deepest.xyz, deepest.w);
    pushed = select(is_inside, pushed + (turned - end), pushed);
    end = select(is_inside, turned, end);
    direction = select(is_inside, (turned - start) * per_segment, direction);
  }
#endif

#if HAS_PINNED_TAIL
  const lane_bool is_too_far = is_last || distance(end, anchor) > reach;
  if (is_any(is_too_far)) {
    end = select(is_too_far, turned_onto_sphere(start, direction, vertex.segment, anchor, reach), end);
  }
#endif
  return end;
}
