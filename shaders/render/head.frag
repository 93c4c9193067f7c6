// Head pass: skin with light that wraps around the terminator, a soft highlight, and the hair's shadow.
#include "render/light.glsl"

in vec3 v_position_m;
in vec3 v_normal;
in float v_cover;

uniform vec3 u_eye_m;
uniform vec3 u_skin_color;
uniform vec3 u_root_color;
uniform float u_shadow_lift_m;   // looks up the hair's shadow this far above the skin

layout(location = 0) out vec4 out_color;

// Light scattered inside skin reaches past the terminator, red furthest (Green 2004, wrap lighting).
const vec3 kWrap = vec3(0.42, 0.24, 0.18);
// Short hair and roots that are not drawn tint the skin between those that are.
const float kScalpTint = 0.85;
const float kShine = 0.10;
const float kShinePower = 18.0;
const float kGroundLight = 0.45;

void main() {
  vec3 normal = normalize(v_normal);
  vec3 to_eye = normalize(u_eye_m - v_position_m);
  // Faces turned away are seen only where the mesh is open; lit as if turned here.
  if (dot(normal, to_eye) < -0.2) normal = -normal;
  vec2 light = light_at(v_position_m + u_shadow_lift_m * normal);
  float facing = dot(normal, u_to_light);
  vec3 diffuse = max((vec3(facing) + kWrap) / (1.0 + kWrap), 0.0);
  vec3 halfway = normalize(u_to_light + to_eye);
  float shine = kShine * pow(max(dot(normal, halfway), 0.0), kShinePower) * step(0.0, facing);
  float sky = mix(kGroundLight, 1.0, 0.5 + 0.5 * dot(normal, u_up));
  float tint = kScalpTint * clamp(v_cover, 0.0, 1.0);
  vec3 skin = mix(u_skin_color, u_root_color, tint);
  vec3 color = u_light_color * light.x * (skin * diffuse + (1.0 - tint) * shine) + u_ambient * sky * light.y * skin;
  out_color = vec4(color, 1.0);
}
