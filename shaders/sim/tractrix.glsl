// The tractrix step: where the tail of a rigid segment goes when its head is moved along a straight line and
// the tail only ever follows the segment. Source: Zappe 2020, 2.2.3, after Sreenivasan, Goel and
// Ghosal 2010.
//
// With u the unit vector from head to tail, s that of the head's way d and l the segment's length, the tail's
// velocity is the part of the head's along u, so l du/dx = (s.u) u - s. The angle theta between u and s then
// has tan(theta'/2) = tan(theta/2) exp(d/l). In components along and across s, with E = exp(-d/l),
// a = 1 - u.s, b = 1 + u.s and D = a + b E^2:
//   u'.s = (b E^2 - a) / D          across: multiplied by 2 E / D
// No angle, root or inverse function is left, and nothing has a special case: d = 0 gives u; u = -s (head
// pulls) gives u; u = s (head pushes along the segment, an equilibrium that is not stable) gives u, the
// segment is pushed like a rod; any other head that moves towards its tail turns the segment around.
#include "sim/follow.glsl"

const float kTinyLength = 1e-10;
// Below this 1 - exp(-x) is a short series to rounding, above it a difference.
const float kSeriesBelow = 0.125;

// u' - u: zero to the last bit where nothing moves.
vec3 tractrix_turn(vec3 direction, vec3 shift, float segment) {
  const float squared = dot(shift, shift);
  const float inverse = inversesqrt(max(squared, kTinySquared));
  const vec3 along = shift * inverse;
  const float x = squared * inverse / max(segment, kTinyLength);
  const float series = x * (1.0 - x * (1.0 / 2.0) * (1.0 - x * (1.0 / 3.0) * (1.0 - x * (1.0 / 4.0))));
  const float lost = select(x < kSeriesBelow, series, 1.0 - exp(-x));  // 1 - E
  const float kept = 1.0 - lost;
  // From the difference of the two unit vectors, so that a is exact where it is small: there a rounding is
  // what the push lets grow.
  const vec3 apart = direction - along;
  const float a = 0.5 * dot(apart, apart);
  const float b = 2.0 - a;
  const vec3 across = apart + a * along;
  const float sum = a + b * kept * kept;
  // Pushed along itself so far that E^2 is no number any more: as from the equilibrium.
  const float scale = select(sum > 0.0, lost / sum, 0.0);
  return scale * ((b * kept - a) * across - (a * b * (1.0 + kept)) * along);
}

// Where the tail goes that was at `tail` when the head was at `head_before` and goes to `head`.
vec3 tractrix_followed(vec3 head_before, vec3 head, vec3 tail, float segment) {
  const vec3 edge = tail - head_before;
  const float squared = dot(edge, edge);
  const vec3 shift = head - head_before;
  // A segment without a direction is carried along.
  const vec3 turn = tractrix_turn(edge * inversesqrt(max(squared, kTinySquared)), shift, segment);
  return tail + select(squared > kTinySquared, shift + segment * turn, shift);
}

// The same for a segment that does not have its length, which it gets.
vec3 tractrix_fitted(vec3 head_before, vec3 head, vec3 tail, float segment) {
  const vec3 edge = tail - head_before;
  const vec3 direction = edge * inversesqrt(max(dot(edge, edge), kTinySquared));
  const vec3 turned = direction + tractrix_turn(direction, head - head_before, segment);
  return head + turned * (segment * inversesqrt(max(dot(turned, turned), kTinySquared)));
}
