// The banded system of direct_rod: rows of blocks, up to two off the diagonal, eliminated from the root.
#include "sim/direct_rod_state.glsl"

// Unknowns of a vertex: its displacement; with twist also the spin of the edge that ends there, times its
// length.
#if HAS_TWIST
#define Unknown vec4
#define Block mat4
const uint kUnknowns = 4u;
#else
#define Unknown vec3
#define Block mat3
const uint kUnknowns = 3u;
#endif

// Stiffness so many times the inertia is beyond hair and beyond float: a few roundings of it are added to the
// pivots, which keeps them positive.
const float kMaxStiffnessPerInertia = 3e5;
const float kPivotGuard = 3e-7;

// Planes of the scratch buffer, per vertex.
const uint kPlaneNext = 0u;                        // columns of pivot^-1 U1; without twist w = pivot^-1 r
const uint kPlaneSecond = kPlaneNext + kUnknowns;  // columns of pivot^-1 U2
const uint kPlaneIterate = kPlaneSecond + kUnknowns;  // position of the iterate; w = tension
#if HAS_TWIST
const uint kPlaneRight = kPlaneIterate + 1u;  // pivot^-1 r
const uint kPlaneAxis = kPlaneRight + 1u;     // of the iterate; w = spin in this step
const uint kScratchPlanes = kPlaneAxis + 1u;
#else
const uint kScratchPlanes = kPlaneIterate + 1u;
#endif

// A row of the system while it is assembled.
struct Row {
  Block diagonal;
  Block next;
  Block second;
  Unknown right;
};

// What later rows need of an eliminated one.
struct Eliminated {
  Block next;
  Block second;
  Block solved_next;
  Block solved_second;
  Unknown solved_right;
};

vec4 scratch(Rod rod, uint plane, uint vertex) {
  return b_scratch.value[(vertex * kScratchPlanes + plane) * rod.slots + rod.slot];
}
void store_scratch(Rod rod, uint plane, uint vertex, vec4 value) {
  b_scratch.value[(vertex * kScratchPlanes + plane) * rod.slots + rod.slot] = value;
}

mat3 scaled(float scale) { return mat3(scale, 0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, scale); }

// scale * (1 - d d^T)
mat3 across(vec3 d, float scale) { return scaled(scale) - outerProduct(d * scale, d); }

// Inverse of a symmetric positive matrix by its factors L D L^T. Cofactors would lose the square of the ratio
// of an edge's stiffness along and across.
mat3 symmetric_inverse(mat3 m) {
  const float d0 = 1.0 / m[0].x;
  const float l10 = m[0].y * d0;
  const float l20 = m[0].z * d0;
  const float d1 = 1.0 / (m[1].y - l10 * m[0].y);
  const float s21 = m[1].z - l20 * m[0].y;
  const float l21 = s21 * d1;
  const float d2 = 1.0 / (m[2].z - l20 * m[0].z - l21 * s21);
  const float i20 = l10 * l21 - l20;
  const float o21 = -l21 * d2;
  const float o20 = i20 * d2;
  const float o10 = -l10 * d1 + i20 * o21;
  return mat3(d0 + l10 * l10 * d1 + i20 * o20, o10, o20, o10, d1 - l21 * o21, o21, o20, o21, d2);
}

Row empty_row() { return Row(Block(0.0), Block(0.0), Block(0.0), Unknown(0.0)); }
Eliminated nothing_eliminated() {
  return Eliminated(Block(0.0), Block(0.0), Block(0.0), Block(0.0), Unknown(0.0));
}

#if HAS_TWIST
Unknown of_position(vec3 value) { return vec4(value, 0.0); }
Block of_positions(mat3 m) { return mat4(vec4(m[0], 0.0), vec4(m[1], 0.0), vec4(m[2], 0.0), vec4(0.0)); }

// The spin first, then the rest by cofactors.
Block block_inverse(Block m) {
  const vec3 coupling = m[3].xyz;
  const float inverse_spin = 1.0 / m[3].w;
  const mat3 rest = mat3(m[0].xyz, m[1].xyz, m[2].xyz) - outerProduct(coupling * inverse_spin, coupling);
  const mat3 inverse = symmetric_inverse(rest);
  const vec3 side = -inverse_spin * (inverse * coupling);
  const float corner = inverse_spin - inverse_spin * dot(coupling, side);
  return mat4(vec4(inverse[0], side.x), vec4(inverse[1], side.y), vec4(inverse[2], side.z),
              vec4(side, corner));
}
#else
Unknown of_position(vec3 value) { return value; }
Block of_positions(mat3 m) { return m; }
Block block_inverse(Block m) { return symmetric_inverse(m); }
#endif

// Takes the two rows before out of this one and stores what the way back needs. Symmetry is kept by hand: in
// float the factorisation of more than 48 vertices breaks down without.
Eliminated eliminate(Rod rod, uint vertex, Row row, Eliminated first, Eliminated second) {
#if HAS_TWIST && HAS_PINNED_TAIL
  // The pinned end does not move; the edge before it may spin.
  if (vertex == rod.tail) {
    for (int c = 0; c < 3; ++c) row.diagonal[c] = vec4(float(c == 0), float(c == 1), float(c == 2), 0.0);
    row.diagonal[3].xyz = vec3(0.0);
    row.right.xyz = vec3(0.0);
  }
  const float moves_next = vertex + 1u == rod.tail ? 0.0 : 1.0;
  const float moves_second = vertex + 2u == rod.tail ? 0.0 : 1.0;
  for (int c = 0; c < 3; ++c) {
    row.next[c] *= moves_next;
    row.second[c] *= moves_second;
  }
#endif
  Block pivot = row.diagonal - transpose(first.next) * first.solved_next -
                transpose(second.second) * second.solved_second;
  pivot = 0.5 * (pivot + transpose(pivot));
  const float trace = row.diagonal[0].x + row.diagonal[1].y + row.diagonal[2].z;
  const float inertia = rod.mean_segment * rod.now * rod.now * rod.inverse_h * rod.inverse_h;
  const float guard = kPivotGuard * max(trace - kMaxStiffnessPerInertia * inertia, 0.0);
  for (int c = 0; c < int(kUnknowns); ++c) pivot[c][c] += guard;
  const Block inverse = block_inverse(pivot);
  Eliminated result;
  result.next = row.next - transpose(first.next) * first.solved_second;
  result.second = row.second;
  const Unknown right = row.right - first.solved_right * first.next - second.solved_right * second.second;
  result.solved_next = inverse * result.next;
  result.solved_second = inverse * result.second;
  result.solved_right = inverse * right;
  for (int c = 0; c < int(kUnknowns); ++c) {
#if HAS_TWIST
    store_scratch(rod, kPlaneNext + uint(c), vertex, result.solved_next[c]);
    store_scratch(rod, kPlaneSecond + uint(c), vertex, result.solved_second[c]);
#else
    store_scratch(rod, kPlaneNext + uint(c), vertex, vec4(result.solved_next[c], result.solved_right[c]));
    store_scratch(rod, kPlaneSecond + uint(c), vertex, vec4(result.solved_second[c], 0.0));
#endif
  }
#if HAS_TWIST
  store_scratch(rod, kPlaneRight, vertex, result.solved_right);
#endif
  return result;
}

// Displacement of a vertex from those of the two behind it.
Unknown solved(Rod rod, uint vertex, Unknown moved1, Unknown moved2) {
#if HAS_TWIST
  Block next;
  Block second;
  for (int c = 0; c < 4; ++c) {
    next[c] = scratch(rod, kPlaneNext + uint(c), vertex);
    second[c] = scratch(rod, kPlaneSecond + uint(c), vertex);
  }
  return scratch(rod, kPlaneRight, vertex) - next * moved1 - second * moved2;
#else
  const vec4 n0 = scratch(rod, kPlaneNext, vertex);
  const vec4 n1 = scratch(rod, kPlaneNext + 1u, vertex);
  const vec4 n2 = scratch(rod, kPlaneNext + 2u, vertex);
  const mat3 second =
      mat3(scratch(rod, kPlaneSecond, vertex).xyz, scratch(rod, kPlaneSecond + 1u, vertex).xyz,
           scratch(rod, kPlaneSecond + 2u, vertex).xyz);
  return vec3(n0.w, n1.w, n2.w) - mat3(n0.xyz, n1.xyz, n2.xyz) * moved1 - second * moved2;
#endif
}
