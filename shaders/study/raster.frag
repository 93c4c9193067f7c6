// What a sample adds to a node (Woodhouse 2017, equation 2.2); blending sums.
layout(location = 0) flat in vec2 g_at;
layout(location = 1) flat in vec4 g_value;
layout(location = 0) out vec4 o_sum;

void main() {
  const vec2 share = max(1.0 - abs(gl_FragCoord.xy - 0.5 - g_at), 0.0);
  o_sum = share.x * share.y * g_value;
}
