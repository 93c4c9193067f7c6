// Expand pass, vertex stage: a patch has one vertex and carries nothing; everything comes from its number.

void main() { gl_Position = vec4(0.0); }
