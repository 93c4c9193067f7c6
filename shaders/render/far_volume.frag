// Hair as a volume: a ray per pixel sums what strands hide on its way and where they lie; the light of the mean of them
// that is seen stands for all.
#include "lib/coverage.glsl"
#include "render/strand_light.glsl"

uniform sampler3D u_way;            // mean way times depth, depth
uniform sampler3D u_along;          // times depth
uniform vec3 u_far_origin_m;        // corner of the cube, head space
uniform float u_far_side_m;
uniform float u_depth_per_m;        // of a texel's value
uniform float u_share;              // of the pixels that show this
uniform mat4 u_head_from_clip;
uniform sampler2D u_scene_depth;    // 2 x 2 samples per pixel
uniform vec2 u_pixel_step;          // 1 / pixels of the target

layout(location = 0) out vec4 out_color;

const int kSteps = 40;
const float kLeastPassing = 1.0 / 300.0;

vec3 in_head(vec2 clip_xy, float depth) {
  vec4 point = u_head_from_clip * vec4(clip_xy, 2.0 * depth - 1.0, 1.0);
  return point.xyz / point.w;
}

void main() {
  out_color = vec4(0.0);
  if (shows_strands(gl_FragCoord.xy, 1.0 - u_share)) return;
  vec2 at = gl_FragCoord.xy * u_pixel_step;
  vec2 clip_xy = 2.0 * at - 1.0;
  // The middle of a pixel is the corner between its four samples.
  vec4 depth = textureGather(u_scene_depth, at);
  vec3 way = normalize(in_head(clip_xy, 0.5) - u_eye_m);
  vec3 steep = mix(vec3(1e-6), way, greaterThan(abs(way), vec3(1e-6)));
  vec3 low = (u_far_origin_m - u_eye_m) / steep;
  vec3 high = (u_far_origin_m + u_far_side_m - u_eye_m) / steep;
  vec3 near3 = min(low, high);
  vec3 far3 = max(low, high);
  float begin_m = max(max(max(near3.x, near3.y), near3.z), 0.0);
  float end_m = min(min(far3.x, far3.y), far3.z);
  float opaque_m = dot(in_head(clip_xy, dot(depth, vec4(0.25))) - u_eye_m, way);
  end_m = min(end_m, opaque_m);
  if (!(end_m > begin_m)) return;

  float step_m = (end_m - begin_m) / float(kSteps);
  float passing = 1.0;
  float seen = 0.0;
  vec3 point_m = vec3(0.0);
  vec3 tangent = vec3(0.0);
  float along = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    vec3 here_m = u_eye_m + (begin_m + (float(i) + 0.5) * step_m) * way;
    vec3 cell = (here_m - u_far_origin_m) / u_far_side_m;
    vec4 sums = texture(u_way, cell);
    if (sums.w <= 0.0) continue;
    float kept = exp(-sums.w * u_depth_per_m * step_m);
    float weight = passing * (1.0 - kept);
    seen += weight;
    point_m += weight * here_m;
    tangent += weight / sums.w * sums.xyz;
    along += weight / sums.w * texture(u_along, cell).r;
    passing *= kept;
    if (passing < kLeastPassing) break;
  }
  if (!(seen > 1e-4)) return;
  float length_t = length(tangent);
  tangent = length_t > 1e-6 ? tangent / length_t : vec3(0.0, -1.0, 0.0);
  vec3 color = fibre_light(point_m / seen, tangent, mean_fibre(clamp(along / seen, 0.0, 1.0)));
  out_color = seen * vec4(color, 1.0);
}
