// direct_rod: one invocation per strand. Three walks along the strand per step: forward, from the root,
// assembles and eliminates the banded system as it goes; backward solves it; the finish restores lengths,
// meets colliders and stores the state. Equations in server/sim/solvers/direct_rod/direct_rod.h and
// direct_rod_reference.cpp; every quantity is per mass per length.
#pragma variant HAS_TWIST 0 1
#include "sim/direct_rod_joint.glsl"

layout(local_size_x = kStrandLocalSize) in;

// One edge of the iterate, and what the walk forward needs of it later.
struct Edge {
  vec3 direction;
  vec3 axis;
  vec4 rate;
  float length_m;
  float tension;
};

// Inertia of the edge, half at either end, and its tension.
void add_edge(Rod rod, Edge edge, float excess, vec4 force0, vec4 force1, float end_length, inout Row row0,
              inout Row row1) {
  add_inertia(rod, 0.5 * edge.length_m, force0, row0);
  add_inertia(rod, 0.5 * edge.length_m + end_length, force1, row1);
  const float per_length = rod.penalty / edge.length_m;
  const float transverse = max(edge.tension, 0.0) / edge.length_m;
  const Unknown pull = of_position((edge.tension + per_length * excess) * edge.direction);
  const mat3 along = outerProduct((per_length - transverse) * edge.direction, edge.direction);
  const Block stiffness = of_positions(scaled(transverse) + along);
  row0.right += pull;
  row1.right -= pull;
  row0.diagonal += stiffness;
  row1.diagonal += stiffness;
  row0.next -= stiffness;
#if HAS_TWIST
  const float rate = rod.now * rod.inverse_h;
  row1.diagonal[3].w += u_spin_inertia / edge.length_m * rate * rate;
#endif
}

// The joint before an edge; `edge` is a clamp behind a pinned tip.
void add_joint_between(Rod rod, uint vertex, Edge before, Edge edge, vec3 joint_tangent, inout Row row0,
                       inout Row row1, inout Row row2) {
  float per_length = 2.0 / (before.length_m + edge.length_m);
  float bending = rod.stiffness * per_length;
  Side start = edge_side(before.direction, before.axis, joint_tangent, 1, before.rate, before.length_m);
  Side end = edge_side(edge.direction, edge.axis, joint_tangent, -1, edge.rate, edge.length_m);
  if (vertex == rod.first) {
    start = clamp_side(rod.clamp_direction, rod.clamp_axis);
    bending = clamp_stiffness(rod, edge.tension, edge.length_m);
  }
#if HAS_PINNED_TAIL
  if (vertex > rod.tail) {
    end = clamp_side(rod.tail_direction, rod.tail_axis);
    per_length = 2.0 / before.length_m;
    bending = clamp_stiffness(rod, before.tension, before.length_m);
  }
#endif
  add_joint(rod, start, end, bending, rod.twist_stiffness * per_length, row0, row1, row2);
}

void forward(Rod rod, uint solve) {
#if HAS_PINNED_TAIL
  const uint last = min(rod.tail + 1u, u_step.shape.y - 1u);
  const uint end = rod.tail + 2u + uint(HAS_TWIST);
#else
  const uint last = u_step.shape.y - 1u;
  const uint end = rod.tail + 2u;
#endif
  uint at = element(rod, rod.first - 1u);
  vec3 position = target_at(at);
  vec3 unrestored = position;
  Node node = load_node(rod, at);
  vec3 rate = rate_at(rod, position, node);
  vec4 force = vec4(0.0, 0.0, 0.0, 1.0);
  Edge before = Edge(rod.clamp_direction, rod.clamp_axis, vec4(0.0), 0.0, 0.0);
  vec3 old_direction = rod.clamp_direction;
  Row row0 = empty_row();
  Row row1 = empty_row();
  Eliminated done1 = nothing_eliminated();
  Eliminated done2 = nothing_eliminated();
  for (uint i = rod.first; i < min(last + 3u, end); ++i) {
    Row row2 = empty_row();
    if (i <= last) {
      at += rod.stride;
      const vec4 edge_rest = texelFetch(u_edge, int(at));
      const vec3 old = node.old;
      node = load_node(rod, at);
      vec4 iterate;
      if (solve == 0u) {
        iterate = vec4(predicted(rod, node), node.tension);
      } else {
        iterate = scratch(rod, kPlaneIterate, i);
      }
      if (i >= rod.tail) iterate.xyz = target_at(at);
      const vec3 way = iterate.xyz - unrestored;
      Edge edge;
      edge.direction = edge_direction(rod, way, at, edge_rest.w, before.direction);
      edge.length_m = soft_length(rod, edge_rest.w);
      edge.tension = iterate.w;
      unrestored = iterate.xyz;
      float excess = 0.0;
#if HAS_PINNED_TAIL
      const vec3 moved = iterate.xyz;
      excess = dot(way, edge.direction) - edge_rest.w;
#else
      const vec3 moved = position + edge_rest.w * edge.direction;
#endif
      store_scratch(rod, kPlaneIterate, i, vec4(moved, iterate.w));
      const vec3 moved_rate = rate_at(rod, moved, node);
      edge.rate = vec4(moved_rate - rate, 0.0);
      rate = moved_rate;
      position = moved;
#if HAS_TWIST
      const vec4 stored = texelFetch(u_axis, int(at));
      vec4 axis;
      old_direction = edge_direction(rod, node.old - old, at, edge_rest.w, old_direction);
      if (solve == 0u) {
        // Carried in time, without spin.
        axis = vec4(carried_axis(stored.xyz, old_direction, edge.direction), 0.0);
      } else {
        axis = scratch(rod, kPlaneAxis, i);
      }
      store_scratch(rod, kPlaneAxis, i, axis);
      edge.axis = axis.xyz;
      edge.rate.w = edge.length_m * (rod.now * axis.w - rod.before * stored.w) * rod.inverse_h;
#else
      // Carried along the strand.
      edge.axis = carried_axis(before.axis, before.direction, edge.direction);
#endif
      const vec4 force_before = force;
      force = vec4(outer_force(rod, node, rate), node.inertia);
#if HAS_PINNED_TAIL
      const float end_length = 0.0;
#else
      const float end_length = i == last ? u_tip_length : 0.0;
#endif
      add_edge(rod, edge, excess, force_before, force, end_length, row1, row2);
      add_joint_between(rod, i, before, edge, edge_rest.xyz, row0, row1, row2);
      before = edge;
    }
    if (i >= rod.first + 2u) {
      const Eliminated done = eliminate(rod, i - 2u, row0, done1, done2);
      done2 = done1;
      done1 = done;
    }
    row0 = row1;
    row1 = row2;
  }
}

// What an edge behind `vertex` that is too short for a direction of its own continues; else nothing.
vec3 direction_before(Rod rod, uint vertex, float segment) {
  vec3 direction = rod.clamp_direction;
  lane_bool is_open = segment <= rod.shortest;
  for (uint i = vertex; is_any(is_open) && i >= rod.first; --i) {
    const uint at = element(rod, i);
    const float length = texelFetch(u_edge, int(at)).w;
    const lane_bool is_here = is_open && length > rod.shortest;
    vec3 start = target_at(at - rod.stride);
    if (i > rod.first) start = scratch(rod, kPlaneIterate, i - 1u).xyz;
    const vec3 found =
        edge_direction(rod, scratch(rod, kPlaneIterate, i).xyz - start, at, length, direction);
    direction = select(is_here, found, direction);
    is_open = is_open && !is_here;
  }
  return direction;
}

// Solves from the tip, moves the iterate and updates the tensions; true when something came out broken.
lane_bool backward(Rod rod) {
  Unknown moved1 = Unknown(0.0);
  Unknown moved2 = Unknown(0.0);
  lane_bool is_bad = lanes_that(false);
  vec4 ahead = vec4(0.0);
#if HAS_PINNED_TAIL
  ahead = scratch(rod, kPlaneIterate, rod.tail);
#if HAS_TWIST
  moved1 = scratch(rod, kPlaneRight, rod.tail);
#endif
#endif
  for (uint i = rod.tail; i-- > rod.first - 1u;) {
    vec4 iterate;
    Unknown moved = Unknown(0.0);
    if (i >= rod.first) {
      iterate = scratch(rod, kPlaneIterate, i);
      moved = solved(rod, i, moved1, moved2);
      is_bad = is_bad || is_broken(moved.xyz);
    } else {
      iterate = vec4(target_at(element(rod, i)), 0.0);
    }
    // The edge after vertex i; without a pinned tail there is none behind the tip.
    if (i + 1u < rod.tail || HAS_PINNED_TAIL == 1) {
      const uint end = element(rod, i + 1u);
      const float segment = texelFetch(u_edge, int(end)).w;
      const float soft = soft_length(rod, segment);
      const vec3 edge = ahead.xyz - iterate.xyz;
      const vec3 opened = moved1.xyz - moved.xyz;
      const vec3 direction = edge_direction(rod, edge, end, segment, direction_before(rod, i, segment));
      float excess = 0.0;
#if HAS_PINNED_TAIL
      excess = dot(edge, direction) - segment;
#endif
      ahead.w += rod.penalty / soft * (excess + dot(direction, opened));
      store_scratch(rod, kPlaneIterate, i + 1u, vec4(ahead.xyz + moved1.xyz, ahead.w));
#if HAS_TWIST
      const vec4 axis = scratch(rod, kPlaneAxis, i + 1u);
      const float spin = moved1.w / soft;
      const vec3 spun = cos(spin) * axis.xyz + sin(spin) * cross(direction, axis.xyz);
      const vec3 moved_direction = edge_direction(rod, edge + opened, end, segment, direction);
      const vec3 carried = carried_axis(spun, direction, moved_direction);
      is_bad = is_bad || is_broken(carried);
      store_scratch(rod, kPlaneAxis, i + 1u, vec4(carried, axis.w + spin));
#endif
    }
    ahead = iterate;
    moved2 = moved1;
    moved1 = moved;
  }
  return is_bad;
}

void store_node(uint at, vec3 position, vec3 velocity, float tension, vec3 displacement,
                vec3 velocity_change) {
  store_vertex(at, position, texelFetch(u_position, int(at)).w);
  b_velocity.velocity[at] = vec4(velocity, tension);
  b_displacement.value[at] = vec4(displacement, 0.0);
  b_velocity_change.value[at] = vec4(velocity_change, 0.0);
}

#if HAS_TWIST
// The frame of the edge from `start` to `end`, which the solve left along `direction`.
void store_axis(Rod rod, uint vertex, vec3 direction, vec3 start, vec3 end, float segment) {
  const uint at = element(rod, vertex);
  const vec4 axis = scratch(rod, kPlaneAxis, vertex);
  vec3 stored = axis.xyz;
#if HAS_PINNED_TAIL || COLLIDERS > 0
  stored = carried_axis(stored, direction, edge_direction(rod, end - start, at, segment, direction));
#endif
  b_axis.value[at] = vec4(stored, axis.w);
}
#endif

void store_pinned(Rod rod, uint vertex, float kept) {
  const uint at = element(rod, vertex);
  const vec3 target = target_at(at);
  const vec3 way = target - load_node(rod, at).old;
  store_node(at, target, way * rod.inverse_h, kept, way, vec3(0.0));
}

// Exact lengths, colliders, velocities. What colliders or a pinned tip move a vertex by counts as an impulse:
// once in the velocity, not in its history, which order 2 would turn into a rebound.
void finish(Rod rod) {
  vec3 restored = target_at(element(rod, rod.first - 1u));
  vec3 unrestored = restored;
  vec3 start = restored;
  vec3 along = rod.clamp_direction;
  for (uint i = 0u; i < rod.first; ++i) store_pinned(rod, i, i == 0u ? rod.h : 0.0);
#if HAS_PINNED_TAIL
  const vec3 anchor = target_at(element(rod, rod.tail));
  float reach = 0.0;
  for (uint i = rod.first; i <= rod.tail; ++i) reach += texelFetch(u_edge, int(element(rod, i))).w;
#endif
  for (uint i = rod.first; i < rod.tail; ++i) {
    const uint at = element(rod, i);
    const float segment = texelFetch(u_edge, int(at)).w;
    const Node node = load_node(rod, at);
    const vec4 iterate = scratch(rod, kPlaneIterate, i);
    along = edge_direction(rod, iterate.xyz - unrestored, at, segment, along);
    unrestored = iterate.xyz;
#if HAS_PINNED_TAIL
    restored = iterate.xyz;
#else
    const lane_bool is_shifted = start != restored;
    restored += segment * along;
#endif
    vec3 end = restored;
#if HAS_PINNED_TAIL || COLLIDERS > 0
    Vertex vertex;
    vertex.target = segment * along;
    vertex.groomed = target_at(at);
    vertex.segment = segment;
    vertex.old = node.stored;
    vertex.arc = 0.0;
    vertex.predicted = restored;
    vec3 pushed;
#if HAS_PINNED_TAIL
    reach -= segment;
    if (i + 1u == rod.tail) reach = texelFetch(u_edge, int(at + rod.stride)).w;
    end = placed(start, vec3(0.0), vertex, anchor, reach, i + 1u == rod.tail, pushed);
#else
    const vec3 placed_end = placed(start, vec3(0.0), vertex, vec3(0.0), 0.0, false, pushed);
    // Without contact nothing moves, not by a rounding either.
    end = select(is_shifted || dot(pushed, pushed) > 0.0, placed_end, restored);
#endif
#endif
    const vec3 velocity = rate_at(rod, restored, node);
    const vec3 impulse = (end - restored) * rod.inverse_h;
    store_node(at, end, velocity + impulse, iterate.w, end - node.old, velocity - node.velocity);
#if HAS_TWIST
    store_axis(rod, i, along, start, end, segment);
#endif
    start = end;
  }
#if HAS_TWIST && HAS_PINNED_TAIL
  if (rod.tail > rod.first) {
    const uint at = element(rod, rod.tail);
    const float segment = texelFetch(u_edge, int(at)).w;
    along = edge_direction(rod, anchor - unrestored, at, segment, along);
    store_axis(rod, rod.tail, along, start, anchor, segment);
  }
#endif
  for (uint i = rod.tail; i < u_step.shape.y; ++i) {
    store_pinned(rod, i, i == rod.tail && rod.tail > rod.first ? scratch(rod, kPlaneIterate, i).w : 0.0);
  }
}

// A broken strand starts again from the groomed shape, without twist. Of strands that are not, what finish()
// stored stays.
void reset(Rod rod, lane_bool is_bad) {
  vec3 before = rod.clamp_direction;
  vec3 axis = rod.clamp_axis;
  for (uint i = 0u; i < u_step.shape.y; ++i) {
    const uint at = element(rod, i);
    const vec3 target = target_at(at);
    const vec4 position = texelFetch(u_position, int(at));
    b_position.position[at] = vec4(select(is_bad, target, position.xyz), position.w);
    b_velocity.velocity[at] =
        select(is_bad, vec4(u_step.head_velocity.xyz, 0.0), texelFetch(u_velocity, int(at)));
    b_displacement.value[at] = select(is_bad, vec4(0.0), texelFetch(u_displacement, int(at)));
    b_velocity_change.value[at] = select(is_bad, vec4(0.0), texelFetch(u_velocity_change, int(at)));
#if HAS_TWIST
    if (i >= rod.first) {
      const vec3 edge = target - target_at(at - rod.stride);
      const float segment = texelFetch(u_edge, int(at)).w;
      const vec3 direction = select(segment > rod.shortest, normalize(edge), before);
      const vec3 c = i == rod.first ? vec3(0.0, 0.0, 1.0) : texelFetch(u_edge, int(at)).xyz;
      const vec3 tangent = c.x * axis + c.y * cross(before, axis) + c.z * before;
      const vec3 unstrained = 2.0 * dot(tangent, before) * tangent - before;
      axis = carried_axis(carried_axis(axis, before, unstrained), unstrained, direction);
      before = direction;
    }
    b_axis.value[at] = select(is_bad, vec4(axis, 0.0), texelFetch(u_axis, int(at)));
#endif
  }
}

Rod make_rod(uint strand) {
  Rod rod;
  rod.strand = strand;
  rod.stride = u_step.shape.x;
  rod.slot = strand - u_strand_begin;
  rod.slots = u_strand_end - u_strand_begin;
  rod.first = u_step.shape.z;
  rod.tail = u_step.shape.w;
  rod.h = u_step.head_velocity.w;
  rod.inverse_h = u_step.push.w;
  rod.history_h = texelFetch(u_velocity, int(strand)).w;
  const lane_bool has_history =
      u_order > 1u && rod.history_h > 0.0 && rod.h <= kMaxStepRatio * rod.history_h;
  const float ratio = rod.h / rod.history_h;
  rod.ratio = select(has_history, ratio, 0.0);
  rod.now = select(has_history, (1.0 + 2.0 * ratio) / (1.0 + ratio), 1.0);
  rod.before = select(has_history, ratio * ratio / (1.0 + ratio), 0.0);
  const vec4 clamp_and_mean = texelFetch(u_strand, int(strand));
  rod.clamp_direction = turned_with_head(clamp_and_mean.xyz);
  const vec4 axis_and_shortest = texelFetch(u_strand, int(rod.stride + strand));
  rod.clamp_axis = turned_with_head(axis_and_shortest.xyz);
  rod.shortest = axis_and_shortest.w;
  rod.clamp_turn = 0.5 * rod.inverse_h *
                   vec3(u_step.carry[1].z - u_step.carry[2].y, u_step.carry[2].x - u_step.carry[0].z,
                        u_step.carry[0].y - u_step.carry[1].x);
  const vec4 tail_and_stiffness = texelFetch(u_strand, int(2u * rod.stride + strand));
  rod.stiffness = tail_and_stiffness.w;
  const vec4 tail_axis_and_twist = texelFetch(u_strand, int(3u * rod.stride + strand));
  rod.twist_stiffness = tail_axis_and_twist.w;
#if HAS_PINNED_TAIL
  rod.tail_direction = turned_with_head(tail_and_stiffness.xyz);
  rod.tail_axis = turned_with_head(tail_axis_and_twist.xyz);
#endif
  rod.mean_segment = clamp_and_mean.w;

  // The block's push is the relative velocity gained from gravity and wind; drag is against the world here.
  rod.force = u_step.push.xyz * rod.inverse_h + u_step.contact.y * u_step.head_velocity.xyz;
  const float length = rod.mean_segment * float(u_step.shape.y - rod.first);
  const float rate = rod.now * rod.inverse_h;
  rod.penalty = kTensionPerCrossing * length * (length + u_tip_length) * rate * rate;
  return rod;
}

void main() {
  const uint strand = u_strand_begin + gl_GlobalInvocationID.x;
  if (strand >= u_strand_end) return;
  const Rod rod = make_rod(strand);
  lane_bool is_bad = lanes_that(false);
  for (uint solve = 0u; solve < u_solves; ++solve) {
    if (rod.tail > rod.first) forward(rod, solve);
    if (rod.tail > rod.first) is_bad = backward(rod) || is_bad;
  }
  if (is_any(!is_bad)) finish(rod);
  if (is_any(is_bad)) reset(rod, is_bad);
}
