// The joints of direct_rod: stiffness and strain between the frames of two edges, and their place in the
// system.
#include "sim/direct_rod_band.glsl"

float clamp_stiffness(Rod rod, float tension, float segment) {
  const float b = rod.stiffness;
  const float pull = max(tension, 0.0) * segment * segment;
  return (b + 0.5 * sqrt(b * pull) + sqrt(b * (b + 0.25 * pull))) / segment;
}

// theta / sin(theta) from sin^2(theta / 2) = q: asin(s) / s as its power series, over cos(theta / 2).
float angle_per_sine(float q) {
  const float high = 15.0 / 336.0 + q * (105.0 / 3456.0 + q * (945.0 / 42240.0 + q * (10395.0 / 599040.0)));
  const float series = 1.0 + q * (1.0 / 6.0 + q * (3.0 / 40.0 + q * high));
  return series * inversesqrt(1.0 - q);
}

// Inertia and outer forces of a vertex, times `mass`; w = how inert it is.
void add_inertia(Rod rod, float mass, vec4 force, inout Row row) {
  const float rate = rod.now * rod.inverse_h;
  row.diagonal += of_positions(scaled(mass * rate * (rate * force.w + u_step.contact.y)));
  row.right += of_position(mass * force.xyz);
}

// One side of a joint: an edge, or a clamp that does not give way.
struct Side {
  vec3 direction;
  vec3 tangent;      // where the frame carries the rest tangent of the joint
  vec3 axis;         // of the frame, carried to the tangent
  vec4 rate;         // of the edge, m/s; w = of its spin, times its length
  float length_m;    // 0 = a clamp
  float is_clamp;    // 1 = turns with the head
};

Side clamp_side(vec3 direction, vec3 axis) {
  return Side(direction, direction, axis, vec4(0.0), 0.0, 1.0);
}

#if HAS_TWIST

// What the frame of an edge carries to the joint before it (sign = -1) or behind it (sign = 1).
Side edge_side(vec3 direction, vec3 axis, vec3 joint_tangent, int sign, vec4 rate, float soft) {
  const vec3 tangent = float(sign) * (joint_tangent.x * axis + joint_tangent.y * cross(direction, axis)) +
                       joint_tangent.z * direction;
  return Side(direction, tangent, carried_axis(axis, direction, tangent), rate, soft, 0.0);
}

// Change of tangent and twist with the edge and its spin (columns). An edge that changes by e turns its
// frame by t x e / length without spin, and the tangent v by t x e x v = e (t.v) - t (e.v); twist turns about
// `mean`.
mat4 response(Side side, vec3 mean, float bend_scale, float twist_scale) {
  const float per_length = select(side.length_m > 0.0, 1.0 / side.length_m, 0.0);
  const vec3 t = side.direction;
  const float bend = bend_scale * per_length;
  const float twist = twist_scale * per_length;
  const mat3 turned = scaled(bend * dot(t, side.tangent)) - outerProduct(t * bend, side.tangent);
  const vec3 twisted = twist * cross(mean, t);
  return mat4(vec4(turned[0], twisted.x), vec4(turned[1], twisted.y), vec4(turned[2], twisted.z),
              vec4(bend * cross(t, side.tangent), twist * dot(t, mean)));
}

mat4 without_spin_column(mat4 m) {
  m[3] = vec4(0.0);
  return m;
}
mat4 without_spin_row(mat4 m) {
  for (int c = 0; c < 4; ++c) m[c].w = 0.0;
  return m;
}

// Adds the joint between two edges to the rows of the vertices before, at and behind it.
void add_joint(Rod rod, Side before, Side after, float bending, float twisting, inout Row row0,
               inout Row row1, inout Row row2) {
  const vec3 d = after.tangent - before.tangent;
  const vec3 mean =
      (before.tangent + after.tangent) / max(1.0 + dot(before.tangent, after.tangent), kFoldedBack);
  const vec3 carried = carried_axis(before.axis, before.tangent, after.tangent);
  const float twist = atan(dot(cross(carried, after.axis), after.tangent), dot(carried, after.axis));
  const float damped = 1.0 + u_bending_damping * rod.now * rod.inverse_h;
  const float per_sine = angle_per_sine(min(0.25 * dot(d, d), kMaxHalfSineSquared));
  const float bend_scale = sqrt(bending * per_sine * damped);
  const float twist_scale = sqrt(twisting * damped);
  const mat4 a = response(before, mean, bend_scale, twist_scale);
  const mat4 b = response(after, mean, bend_scale, twist_scale);
  const vec3 clamp_turned =
      cross(rod.clamp_turn, after.is_clamp * after.tangent - before.is_clamp * before.tangent);
  const float clamp_twisted = (after.is_clamp - before.is_clamp) * dot(rod.clamp_turn, mean);
  const vec4 clamp_rate = vec4(bend_scale * clamp_turned, twist_scale * clamp_twisted);
  const vec4 rate = b * after.rate - a * before.rate + clamp_rate;
  const vec4 stress = (vec4(bend_scale * d, twist_scale * twist) + u_bending_damping * rate) / damped;

  // The strain changes by -a with the edge before and by b with the one after; the vertex between belongs to
  // both, but the spin after it does not.
  const vec4 on_before = stress * a;
  const vec4 on_after = stress * b;
  const vec3 at_end = on_after.xyz;
  row0.right.xyz -= on_before.xyz;
  row1.right += on_before + vec4(at_end, 0.0);
  row2.right -= on_after;
  const mat4 aa = transpose(a) * a;
  const mat4 bb = transpose(b) * b;
  const mat4 ab = transpose(a) * b;
  const mat4 aa0 = without_spin_row(aa);
  const mat4 ab1 = without_spin_column(ab);
  const mat4 bb1 = without_spin_row(bb);
  row0.diagonal += without_spin_column(aa0);
  row0.next -= aa0 + without_spin_row(ab1);
  row0.second += without_spin_row(ab);
  row1.diagonal += aa + ab1 + transpose(ab1) + without_spin_column(bb1);
  row1.next -= ab + bb1;
  row2.diagonal += bb;
}

#else

// The frame behind the joint is not needed: the tangent is the edge's direction, and the edge before carries
// the rest direction.
Side edge_side(vec3 direction, vec3 axis, vec3 rest, int sign, vec4 rate, float soft) {
  const vec3 tangent =
      sign > 0 ? rest.x * axis + rest.y * cross(direction, axis) + rest.z * direction : direction;
  return Side(direction, tangent, axis, rate, soft, 0.0);
}

void add_joint(Rod rod, Side before_side, Side after_side, float bending, float twisting, inout Row row0,
               inout Row row1, inout Row row2) {
  const vec3 before = before_side.direction;
  const vec3 after = after_side.direction;
  const vec3 rest = before_side.tangent;
  const vec3 d = after - rest;
  float weight = bending * angle_per_sine(min(0.25 * dot(d, d), kMaxHalfSineSquared));
  const float along = dot(before, rest);
  const vec3 side = rest - along * before;
  const float to_before = select(before_side.length_m > 0.0, 1.0 / before_side.length_m, 0.0);
  const float to_after = select(after_side.length_m > 0.0, 1.0 / after_side.length_m, 0.0);

  const vec3 moved_before =
      (before_side.rate.xyz - before * dot(before, before_side.rate.xyz)) * to_before;
  const vec3 moved_after = (after_side.rate.xyz - after * dot(after, after_side.rate.xyz)) * to_after;
  const vec3 clamp_turned =
      cross(rod.clamp_turn, before_side.is_clamp * rest - after_side.is_clamp * after);
  const vec3 rest_rate = along * moved_before - before * dot(rest, moved_before) + clamp_turned;
  const vec3 stress = weight * (d + u_bending_damping * (moved_after - rest_rate));

  // Transposes of C and A times the stress.
  const vec3 on_after = (stress - after * dot(after, stress)) * to_after;
  const vec3 turned = along * stress - rest * dot(before, stress);
  const vec3 on_before = (turned - before * dot(before, turned)) * to_before;
  row0.right -= on_before;
  row1.right += on_before + on_after;
  row2.right -= on_after;

  weight *= 1.0 + u_bending_damping * rod.now * rod.inverse_h;
  const float cosine = dot(before, after);
  const mat3 bb = across(after, weight * to_after * to_after);
  const float both = weight * to_before * to_after;
  const float only = weight * to_before * to_before;
  const mat3 aa = across(before, only * along * along) + outerProduct(only * side, side);
  // -A^T C = side (P_after before)^T - along P_before P_after
  const mat3 turned_both =
      across(before, both * along) - outerProduct((both * along) * (after - cosine * before), after);
  const mat3 ab = outerProduct(both * side, before - cosine * after) - turned_both;
  const mat3 ba = transpose(ab);
  row0.diagonal += aa;
  row0.next += ab - aa;
  row0.second -= ab;
  row1.diagonal += aa + bb - ab - ba;
  row1.next += ab - bb;
  row2.diagonal += bb;
}

#endif
