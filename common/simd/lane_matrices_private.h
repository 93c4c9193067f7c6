// GLSL's four-component vectors, matrices, unsigned vectors and uniform vectors over the Float type of the
// including header. Included inside its namespace, as common/simd/lane_vectors_private.h is.

/// A vector with one value for all lanes, laid out as in a uniform block.
struct alignas(16) UniformVec4 {
  float x, y, z, w;
  STRANDCAST_LANES vec3 xyz() const { return {Float(x), Float(y), Float(z)}; }
};
struct alignas(16) UniformUvec4 {
  uint32_t x, y, z, w;
};

struct vec4 : vec3 {
  Float w;
  vec4() = default;
  STRANDCAST_LANES explicit vec4(Float all) : vec3(all), w(all) {}
  STRANDCAST_LANES vec4(Float a, Float b, Float c, Float d) : vec3(a, b, c), w(d) {}
  STRANDCAST_LANES vec4(vec3 v, Float d) : vec3(v), w(d) {}
  STRANDCAST_LANES vec4(const UniformVec4& v) : vec3(Float(v.x), Float(v.y), Float(v.z)), w(v.w) {}
  STRANDCAST_LANES vec3& xyz() { return *this; }
  STRANDCAST_LANES const vec3& xyz() const { return *this; }
  STRANDCAST_LANES Float& operator[](uint32_t axis) { return (&x)[axis]; }
  STRANDCAST_LANES const Float& operator[](uint32_t axis) const { return (&x)[axis]; }
};
STRANDCAST_LANES vec4 operator+(vec4 a, vec4 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w};
}
STRANDCAST_LANES vec4 operator-(vec4 a, vec4 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w};
}
STRANDCAST_LANES vec4 operator-(vec4 a) {
  return {-a.x, -a.y, -a.z, -a.w};
}
STRANDCAST_LANES vec4 operator*(vec4 a, Float b) {
  return {a.x * b, a.y * b, a.z * b, a.w * b};
}
STRANDCAST_LANES vec4 operator*(Float a, vec4 b) {
  return {a * b.x, a * b.y, a * b.z, a * b.w};
}
STRANDCAST_LANES vec4 operator/(vec4 a, Float b) {
  return {a.x / b, a.y / b, a.z / b, a.w / b};
}
STRANDCAST_LANES vec4& operator+=(vec4& a, vec4 b) {
  return a = a + b;
}
STRANDCAST_LANES vec4& operator-=(vec4& a, vec4 b) {
  return a = a - b;
}
STRANDCAST_LANES vec4& operator*=(vec4& a, Float b) {
  return a = a * b;
}
STRANDCAST_LANES Float dot(vec4 a, vec4 b) {
  return ((a.w * b.w + a.z * b.z) + a.y * b.y) + a.x * b.x;
}
STRANDCAST_LANES vec4 normalize(vec4 a) {
  return a * inversesqrt(dot(a, a));
}
STRANDCAST_LANES vec4 select(Bool which, vec4 yes, vec4 no) {
  return {select(which, yes.x, no.x), select(which, yes.y, no.y), select(which, yes.z, no.z),
          select(which, yes.w, no.w)};
}

STRANDCAST_LANES Float distance(vec3 a, vec3 b) {
  return length(a - b);
}
/// Returns in each lane whether any component differs.
STRANDCAST_LANES Bool operator!=(vec3 a, vec3 b) {
  return a.x != b.x || a.y != b.y || a.z != b.z;
}
STRANDCAST_LANES vec2& operator*=(vec2& a, Float b) {
  return a = {a.x * b, a.y * b};
}
STRANDCAST_LANES vec2 select(Bool which, vec2 yes, vec2 no) {
  return {select(which, yes.x, no.x), select(which, yes.y, no.y)};
}

struct uvec3 {
  Uint x, y, z;
};
STRANDCAST_LANES uvec3 floatBitsToUint(vec3 a) {
  return {floatBitsToUint(a.x), floatBitsToUint(a.y), floatBitsToUint(a.z)};
}
STRANDCAST_LANES uvec3 operator&(uvec3 a, uint32_t bits) {
  return {a.x & Uint(bits), a.y & Uint(bits), a.z & Uint(bits)};
}

// ---- matrices, by columns
struct mat3 {
  vec3 column[3];
  mat3() = default;
  STRANDCAST_LANES explicit mat3(Float s)
      : column{vec3(s, 0.0f, 0.0f), vec3(0.0f, s, 0.0f), vec3(0.0f, 0.0f, s)} {}
  STRANDCAST_LANES mat3(vec3 a, vec3 b, vec3 c) : column{a, b, c} {}
  STRANDCAST_LANES mat3(Float a, Float b, Float c, Float d, Float e, Float f, Float g, Float h, Float i)
      : column{vec3(a, b, c), vec3(d, e, f), vec3(g, h, i)} {}
  STRANDCAST_LANES vec3& operator[](uint32_t i) { return column[i]; }
  STRANDCAST_LANES const vec3& operator[](uint32_t i) const { return column[i]; }
};
struct mat4 {
  vec4 column[4];
  mat4() = default;
  STRANDCAST_LANES explicit mat4(Float s)
      : column{vec4(s, 0.0f, 0.0f, 0.0f), vec4(0.0f, s, 0.0f, 0.0f), vec4(0.0f, 0.0f, s, 0.0f),
               vec4(0.0f, 0.0f, 0.0f, s)} {}
  STRANDCAST_LANES mat4(vec4 a, vec4 b, vec4 c, vec4 d) : column{a, b, c, d} {}
  STRANDCAST_LANES vec4& operator[](uint32_t i) { return column[i]; }
  STRANDCAST_LANES const vec4& operator[](uint32_t i) const { return column[i]; }
};
STRANDCAST_LANES mat3 operator+(const mat3& a, const mat3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
STRANDCAST_LANES mat3 operator-(const mat3& a, const mat3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
STRANDCAST_LANES mat4 operator+(const mat4& a, const mat4& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]};
}
STRANDCAST_LANES mat4 operator-(const mat4& a, const mat4& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]};
}
STRANDCAST_LANES mat3 operator-(const mat3& a) {
  return {-a[0], -a[1], -a[2]};
}
STRANDCAST_LANES mat3 operator*(Float s, const mat3& m) {
  return {s * m[0], s * m[1], s * m[2]};
}
STRANDCAST_LANES mat3 operator*(const mat3& m, Float s) {
  return {m[0] * s, m[1] * s, m[2] * s};
}
STRANDCAST_LANES mat4 operator*(Float s, const mat4& m) {
  return {s * m[0], s * m[1], s * m[2], s * m[3]};
}
template <class Matrix>
STRANDCAST_LANES Matrix& operator+=(Matrix& a, const Matrix& b) requires requires {
  a.column;
}
{ return a = a + b; }
template <class Matrix>
STRANDCAST_LANES Matrix& operator-=(Matrix& a, const Matrix& b) requires requires {
  a.column;
}
{ return a = a - b; }
STRANDCAST_LANES vec3 operator*(const mat3& m, vec3 v) {
  return m[0] * v.x + m[1] * v.y + m[2] * v.z;
}
STRANDCAST_LANES vec4 operator*(const mat4& m, vec4 v) {
  return m[0] * v.x + m[1] * v.y + m[2] * v.z + m[3] * v.w;
}
STRANDCAST_LANES vec3 operator*(vec3 v, const mat3& m) {
  return {dot(v, m[0]), dot(v, m[1]), dot(v, m[2])};
}
STRANDCAST_LANES vec4 operator*(vec4 v, const mat4& m) {
  return {dot(v, m[0]), dot(v, m[1]), dot(v, m[2]), dot(v, m[3])};
}
STRANDCAST_LANES mat3 operator*(const mat3& a, const mat3& b) {
  return {a * b[0], a * b[1], a * b[2]};
}
STRANDCAST_LANES mat4 operator*(const mat4& a, const mat4& b) {
  return {a * b[0], a * b[1], a * b[2], a * b[3]};
}
STRANDCAST_LANES mat3 outerProduct(vec3 a, vec3 b) {
  return {a * b.x, a * b.y, a * b.z};
}
STRANDCAST_LANES mat3 transpose(const mat3& m) {
  return {vec3(m[0].x, m[1].x, m[2].x), vec3(m[0].y, m[1].y, m[2].y), vec3(m[0].z, m[1].z, m[2].z)};
}
STRANDCAST_LANES mat4 transpose(const mat4& m) {
  return {vec4(m[0].x, m[1].x, m[2].x, m[3].x), vec4(m[0].y, m[1].y, m[2].y, m[3].y),
          vec4(m[0].z, m[1].z, m[2].z, m[3].z), vec4(m[0].w, m[1].w, m[2].w, m[3].w)};
}
