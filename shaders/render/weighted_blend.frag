// Weighted blending, second part: the mean colour takes the opacity of all.

uniform sampler2D u_sum;
uniform sampler2D u_passing;

layout(location = 0) out vec4 out_layer;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(u_sum, pixel, 0);
  float opacity = 1.0 - texelFetch(u_passing, pixel, 0).r;
  out_layer = sum.a > 0.0 ? vec4(opacity * sum.rgb / sum.a, opacity) : vec4(0.0);
}
