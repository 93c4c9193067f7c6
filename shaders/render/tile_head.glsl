// What the head leaves per sample for tile_draw.comp: its normal in three bytes, octahedral (Meyer et al. 2010), and how much
// of its skin lies under hair in the fourth.

// Both parts of an octahedral direction in steps of 1 / kOctSteps.
const float kOctSteps = 4095.0;

vec2 sign_or_one(vec2 v) { return vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0); }

vec4 packed_skin(vec3 normal, float cover) {
  vec3 n = normal / max(abs(normal.x) + abs(normal.y) + abs(normal.z), 1e-6);
  vec2 oct = n.z >= 0.0 ? n.xy : (1.0 - abs(n.yx)) * sign_or_one(n.xy);
  uvec2 steps = uvec2(round((0.5 + 0.5 * clamp(oct, -1.0, 1.0)) * kOctSteps));
  return vec4(float(steps.x & 255u), float((steps.x >> 8) | ((steps.y & 15u) << 4)), float(steps.y >> 4), 255.0 * clamp(cover, 0.0, 1.0)) / 255.0;
}

vec3 skin_normal(vec4 packed_values) {
  uvec3 bytes = uvec3(round(packed_values.rgb * 255.0));
  vec2 steps = vec2(float(bytes.x | ((bytes.y & 15u) << 8)), float((bytes.y >> 4) | (bytes.z << 4)));
  vec2 oct = 2.0 * steps / kOctSteps - 1.0;
  vec3 n = vec3(oct, 1.0 - abs(oct.x) - abs(oct.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * sign_or_one(n.xy);
  return normalize(n);
}
