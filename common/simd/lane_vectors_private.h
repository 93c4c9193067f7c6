// GLSL's vectors over the Float type of the including header: lanes (common/simd/lanes.h) or pairs of lanes
// (common/simd/lane_pairs.h). Included inside their namespaces.

struct vec2 {
  Float x, y;
  vec2() = default;
  STRANDCAST_LANES constexpr vec2(Float all) : x(all), y(all) {}
  STRANDCAST_LANES constexpr vec2(Float a, Float b) : x(a), y(b) {}
};
struct vec3 {
  Float x, y, z;
  vec3() = default;
  STRANDCAST_LANES constexpr vec3(Float all) : x(all), y(all), z(all) {}
  STRANDCAST_LANES constexpr vec3(Float a, Float b, Float c) : x(a), y(b), z(c) {}
  /// Converts any three-component vector to one with that value in all lanes.
  template <class Vector>
  requires requires(const Vector& v) { v.x, v.y, v.z, v[2]; }
  STRANDCAST_LANES vec3(const Vector& v) : x(v.x), y(v.y), z(v.z) {}
  STRANDCAST_LANES Float& operator[](uint32_t axis) { return (&x)[axis]; }
  STRANDCAST_LANES const Float& operator[](uint32_t axis) const { return (&x)[axis]; }
  STRANDCAST_LANES vec3& xyz() { return *this; }
  STRANDCAST_LANES const vec3& xyz() const { return *this; }
};

STRANDCAST_LANES vec2 operator+(vec2 a, vec2 b) {
  return {a.x + b.x, a.y + b.y};
}
STRANDCAST_LANES vec2 operator-(vec2 a, vec2 b) {
  return {a.x - b.x, a.y - b.y};
}
STRANDCAST_LANES vec2 operator*(vec2 a, vec2 b) {
  return {a.x * b.x, a.y * b.y};
}
STRANDCAST_LANES Float dot(vec2 a, vec2 b) {
  return a.y * b.y + a.x * b.x;
}

STRANDCAST_LANES vec3 operator+(vec3 a, vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
STRANDCAST_LANES vec3 operator-(vec3 a, vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
STRANDCAST_LANES vec3 operator*(vec3 a, vec3 b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
STRANDCAST_LANES vec3 operator/(vec3 a, vec3 b) {
  return {a.x / b.x, a.y / b.y, a.z / b.z};
}
STRANDCAST_LANES vec3 operator-(vec3 a) {
  return {-a.x, -a.y, -a.z};
}
STRANDCAST_LANES vec3 operator+(vec3 a, Float b) {
  return {a.x + b, a.y + b, a.z + b};
}
STRANDCAST_LANES vec3 operator-(vec3 a, Float b) {
  return {a.x - b, a.y - b, a.z - b};
}
STRANDCAST_LANES vec3 operator*(vec3 a, Float b) {
  return {a.x * b, a.y * b, a.z * b};
}
STRANDCAST_LANES vec3 operator*(Float a, vec3 b) {
  return {a * b.x, a * b.y, a * b.z};
}
STRANDCAST_LANES vec3 operator/(vec3 a, Float b) {
  return {a.x / b, a.y / b, a.z / b};
}
STRANDCAST_LANES vec3& operator+=(vec3& a, vec3 b) {
  return a = a + b;
}
STRANDCAST_LANES vec3& operator-=(vec3& a, vec3 b) {
  return a = a - b;
}
STRANDCAST_LANES vec3& operator*=(vec3& a, vec3 b) {
  return a = a * b;
}
STRANDCAST_LANES Float dot(vec3 a, vec3 b) {
  return (a.z * b.z + a.y * b.y) + a.x * b.x;
}
STRANDCAST_LANES vec3 cross(vec3 a, vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
STRANDCAST_LANES Float length(vec3 a) {
  return sqrt(dot(a, a));
}
STRANDCAST_LANES vec3 normalize(vec3 a) {
  return a * vec3(inversesqrt(dot(a, a)));
}
STRANDCAST_LANES vec3 min(vec3 a, Float b) {
  return {min(a.x, b), min(a.y, b), min(a.z, b)};
}
STRANDCAST_LANES vec3 max(vec3 a, Float b) {
  return {max(a.x, b), max(a.y, b), max(a.z, b)};
}
STRANDCAST_LANES vec3 min(vec3 a, vec3 b) {
  return {min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)};
}
STRANDCAST_LANES vec3 max(vec3 a, vec3 b) {
  return {max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)};
}
STRANDCAST_LANES vec3 mix(vec3 a, vec3 b, Float share) {
  return {mix(a.x, b.x, share), mix(a.y, b.y, share), mix(a.z, b.z, share)};
}
STRANDCAST_LANES vec3 clamp(vec3 x, Float low, Float high) {
  return {clamp(x.x, low, high), clamp(x.y, low, high), clamp(x.z, low, high)};
}
STRANDCAST_LANES vec3 sqrt(vec3 x) {
  return {sqrt(x.x), sqrt(x.y), sqrt(x.z)};
}
STRANDCAST_LANES vec3 exp(vec3 x) {
  return {exp(x.x), exp(x.y), exp(x.z)};
}
STRANDCAST_LANES vec3 pow(vec3 x, vec3 p) {
  return {pow(x.x, p.x), pow(x.y, p.y), pow(x.z, p.z)};
}
STRANDCAST_LANES vec3 select(Bool which, vec3 yes, vec3 no) {
  return {select(which, yes.x, no.x), select(which, yes.y, no.y), select(which, yes.z, no.z)};
}
