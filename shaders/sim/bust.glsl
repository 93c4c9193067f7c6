// A bust in a pose of its own (common/math/bust.h, where the numbers come from): places of its skin at rest, and where
// they are under a turn of the chest. `turn` is a unit quaternion, w last; `share` of the rig.
const int kBustRounds = 4;
const float kLeastBustSlope = 1e-9;

// 0 head .. 1 chest, of a place at rest.
float bust_share(vec3 rest, vec4 share) {
  const float t = clamp(share.w - dot(share.xyz, rest), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

// About the origin by a part of the turn.
vec3 turned_by_part(vec3 point, float part, vec3 axis, float turn_w) {
  const vec3 q = part * axis;
  const float real = 1.0 - part + part * turn_w;
  const vec3 across = cross(q, point);
  return point + (2.0 / (dot(q, q) + real * real)) * (real * across + cross(q, across));
}

// Where the line from `over` at `low` to `under` at `high` is 0.
float crossing(float low, float over, float high, float under) {
  const float slope = over - under;
  return select(slope > kLeastBustSlope, low + (high - low) * (over / max(slope, kLeastBustSlope)), low);
}

// Which part of the turn the skin at this place takes: the zero between 0 and 1, by the Illinois method (Dowell and
// Jarratt 1971).
float bust_part_at(vec3 point, vec4 turn, vec3 pivot, vec4 share) {
  const vec3 arm = point - pivot;
  float low = 0.0;
  float high = 1.0;
  float side = 0.0;
  float over = bust_share(point, share);
  float part = 0.0;
  if (is_any(over > 0.0)) {
    float under = bust_share(pivot + turned_by_part(arm, 1.0, -turn.xyz, turn.w), share) - 1.0;
    part = crossing(low, over, high, under);
    for (int round = 0; round < kBustRounds; ++round) {
      const float error = bust_share(pivot + turned_by_part(arm, part, -turn.xyz, turn.w), share) - part;
      const lane_bool is_below = error > 0.0;
      under = select(is_below, select(side > 0.0, 0.5 * under, under), error);
      over = select(is_below, error, select(side < 0.0, 0.5 * over, over));
      low = select(is_below, part, low);
      high = select(is_below, high, part);
      side = select(is_below, 1.0, -1.0);
      part = crossing(low, over, high, under);
    }
  }
  return part;
}
