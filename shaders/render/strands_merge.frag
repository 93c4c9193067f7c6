// Samples by density, last part: what was drawn with one sample per pixel goes into all samples of its pixel that it is
// in front of.

uniform sampler2D u_color;
uniform sampler2D u_depth;
uniform int u_samples;   // of the target, per pixel side

layout(location = 0) out vec4 out_color;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy) / u_samples;
  vec4 color = texelFetch(u_color, pixel, 0);
  if (color.a == 0.0) discard;
  out_color = color;
  gl_FragDepth = texelFetch(u_depth, pixel, 0).r;
}
