// A sample on its way into the layers of a texture (Woodhouse 2017, 4.2.4).
#include "study/samples.glsl"

layout(location = 0) out vec4 v_place;
layout(location = 1) out vec4 v_value;  // momentum and length

void main() {
  v_place = sample_place(uint(gl_VertexID));
  v_value = v_place.w * vec4(sample_motion(uint(gl_VertexID)).xyz, 1.0);
}
