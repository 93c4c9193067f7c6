// angular_projection: two scalar equations of angular momentum per segment, one segment after the other from
// root to tip. Equations in server/sim/solvers/angular_projection/angular_projection.h.
#include "sim/chain.glsl"

// Force on vertex i and all beyond before the round; their inertia.
vec4 g_load[kMaxVertexCount];
vec4 g_start[kMaxVertexCount];  // where segment i started then

struct Joint {
  float stiffness;
  vec3 moment;  // that turns the segment after it away
};

// The joint before segment i; `before` is the frame there, `turn_before` how far it turned during the step.
Joint joint_at(Strand strand, uint i, Frame before, vec3 turn_before, float tension) {
  const float h = u_step.head_velocity.w;
  const float segment = max(g_along[i].w, kMinLength);
  const bool is_clamp = i == strand.first;
  const float span = is_clamp ? segment : segment + max(g_along[i - 1u].w, kMinLength);
  const float tension_m2ps2 = tension * u_step.push.w * u_step.push.w;
  const float clamp_bend = clamp_stiffness(u_bend_stiffness, tension_m2ps2, segment);
  const float bend = h * h * (is_clamp ? clamp_bend : 2.0 * u_bend_stiffness / span);
  const float rate = u_bending_damping * u_step.push.w;
  Joint joint;
  joint.moment = bend * (bend_between(out_of(before, g_rest[i].xyz), g_along[i].xyz) +
                         rate * (g_turn[i].xyz - turn_before));
  joint.stiffness = bend * (1.0 + rate);
  return joint;
}

// Turns segment i by its two angles; `force` is on everything beyond, `before` and `turn_before` are of the
// segment before. Returns the way of its end.
vec3 turned_segment(Strand strand, uint i, vec3 force, Frame before, vec3 turn_before, inout lane_bool is_bad) {
  const vec4 edge = g_along[i];
  const float segment = max(edge.w, kMinLength);
  const float tension = dot(force, edge.xyz);
  const Frame now = carried_to(before, edge.xyz);
  const Joint joint = joint_at(strand, i, before, turn_before, tension);
  vec3 moment = segment * cross(edge.xyz, force) - joint.moment;
  float inertia = segment * (segment * g_load[i].w + max(tension, 0.0)) + joint.stiffness;
  if (i < strand.last) {
    const Joint next = joint_at(strand, i + 1u, now, g_turn[i].xyz, 0.0);
    moment += next.moment;
    inertia += next.stiffness;
  }
  // The angles in the two planes through the segment and an axis of its frame.
  const vec3 second = cross(now.along, now.axis);
  vec3 turn = (dot(moment, now.axis) * now.axis + dot(moment, second) * second) / inertia;
  is_bad = is_bad || is_broken(turn);
  turn *= min(1.0, kMaxTurn * inversesqrt(max(dot(turn, turn), kTinySquared)));
  const Frame after = carried_to(before, turned(now, turn).along);
  g_along[i].xyz = after.along;
  g_axis[i].xyz = after.axis;
  g_turn[i].xyz += turn;
  return edge.w * (after.along - edge.xyz);
}

vec3 turn_at(Strand strand, uint i) { return i < strand.first ? strand.clamp_turn : g_turn[i].xyz; }

// From the tip to the root: gathers the loads and, unless it is the first time, turns the segments.
void gather(Strand strand, vec3 position, bool is_turning, inout lane_bool is_bad) {
  vec4 load = vec4(0.0);
  for (uint i = strand.last; i >= strand.first; --i) {
    load += vec4(g_aim[i].w * (g_aim[i].xyz - position), g_aim[i].w);
    position -= g_along[i].w * g_along[i].xyz;
    g_load[i] = load;
    if (is_turning) {
      const vec3 moved =
          turned_segment(strand, i, load.xyz, frame_at(strand, i - 1u), turn_at(strand, i - 1u), is_bad);
      load.xyz -= load.w * moved;
      g_load[i].xyz = load.xyz;
    }
    g_start[i] = vec4(position, 0.0);
  }
}

// There and back: a sweep that treats root and tip alike never feeds energy into the strand, whatever the
// step; one from root to tip alone does.
vec3 turned_chain(Strand strand, vec3 position, inout lane_bool is_bad) {
  gather(strand, position, false, is_bad);
  vec3 start = strand.root;
  vec3 turn_before = strand.clamp_turn;
  Frame before = strand.clamp;
  for (uint i = strand.first; i <= strand.last; ++i) {
    const vec3 force = g_load[i].xyz - g_load[i].w * (start - g_start[i].xyz);
    turned_segment(strand, i, force, before, turn_before, is_bad);
    before = Frame(g_along[i].xyz, g_axis[i].xyz);
    turn_before = g_turn[i].xyz;
    start += g_along[i].w * before.along;
  }
  gather(strand, start, true, is_bad);
  position = strand.root;
  for (uint i = strand.first; i <= strand.last; ++i) position += g_along[i].w * g_along[i].xyz;
  return position;
}
