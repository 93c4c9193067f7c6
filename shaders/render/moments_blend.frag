// Moments, last part: the sum of colours is brought to the opacity of all, which is known exactly.

uniform sampler2D u_sum;
uniform sampler2D u_absorbance;

layout(location = 0) out vec4 out_layer;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(u_sum, pixel, 0);
  float opacity = 1.0 - exp(-texelFetch(u_absorbance, pixel, 0).r);
  out_layer = sum.a > 0.0 ? vec4(opacity * sum.rgb / sum.a, opacity) : vec4(0.0);
}
