// Analytic coverage of a line by a box filter one pixel wide: summed across the line it gives the line's width
// exactly, for every width and offset.

#pragma once
#include "lib/select.glsl"

// How much of a pixel a line covers, by the distance of the pixel's middle from the line's: a trapezoid, the convolution
// of two boxes, whose area is the line's width. Of the square of a pixel and the line's own width, seen across the line,
// the three boxes max(|x|, |y|), min(|x|, |y|) and w (x, y: the line's direction), the larger two are kept apart and the
// smallest widens one. Summed over the pixels across a line it gives the width for every offset where offsets repeat:
// along rows, columns and diagonals. The wider of both is a pixel at least: a thin upright line would jump from one column
// to the next, and hair in motion flicker.
struct LineFilter {
  float base;   // cover = min(base - slope * distance, peak), where that is positive
  float slope;  // per pixel
  float peak;
  float reach;  // px: nothing is covered further out
};

LAW LineFilter line_filter(float width_px, vec2 direction) {
  float across = max(abs(direction.x), abs(direction.y));
  float aslant = min(abs(direction.x), abs(direction.y));
  float wide = max(across, width_px);
  const float kLeastRampPx = 1.0;
  float ramp = max(aslant + min(across, width_px), kLeastRampPx);
  LineFilter f;
  f.reach = 0.5 * (wide + ramp);
  f.slope = width_px / (wide * ramp);
  f.base = f.slope * f.reach;
  f.peak = width_px / max(wide, ramp);
  return f;
}

// width_px: of the line; distance_px: from its centre line to the middle of the pixel.
LAW float line_coverage(float width_px, float distance_px) {
  return clamp(0.5 * (width_px + 1.0) - abs(distance_px), 0.0, min(width_px, 1.0));
}

#ifndef __cplusplus
// Threshold in [0, 1) that spreads evenly over neighbouring pixels (additive recurrence with the plastic number,
// Roberts 2018): drawing a sample where coverage exceeds it keeps the mean coverage without sorting or blending.
const vec2 kPlasticStep = vec2(0.7548776662, 0.5698402910);

float coverage_threshold(vec2 pixel, float strand_offset) { return fract(dot(pixel, kPlasticStep) + strand_offset); }

// Whether this pixel is one of the share of all that shows strands, where the others show what stands for them.
bool shows_strands(vec2 pixel, float share) { return coverage_threshold(floor(pixel), 0.0) < share; }
#endif
