// Bezier curves through the vertices of a strand, as Nalu smooths hair (Nguyen and Donnelly 2005; Woodhouse 2017, 2.1.1).
// Vertices are anchors; the handles of a gap lie a third of its length from them along tangents found at run time. That
// is the Hermite curve whose derivatives at the anchors are these tangents, as long as the gap: it is told as one.
#pragma once
#include "lib/hermite.glsl"

// Of the gap p0 .. p1 between its neighbours; at the end of a strand these are p0 or p1 itself.
LAW HermiteGap bezier_gap(vec3 before, vec3 p0, vec3 p1, vec3 after) {
  vec3 chord = p1 - p0;
  float gap = length(chord);
  HermiteGap g;
  g.p0 = p0;
  g.p1 = p1;
  g.m0 = gap * unit_or(p1 - before, unit_or(chord, vec3(0.0)));
  g.m1 = gap * unit_or(after - p0, unit_or(chord, vec3(0.0)));
  return g;
}
