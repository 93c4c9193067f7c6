// Analytic coverage of a line by a box filter one pixel wide: summed across the line it gives the line's width
// exactly, for every width and offset.

// width_px: of the line; distance_px: from its centre line to the middle of the pixel.
float line_coverage(float width_px, float distance_px) {
  return clamp(0.5 * (width_px + 1.0) - abs(distance_px), 0.0, min(width_px, 1.0));
}

// Threshold in [0, 1) that spreads evenly over neighbouring pixels (additive recurrence with the plastic number,
// Roberts 2018): drawing a sample where coverage exceeds it keeps the mean coverage without sorting or blending.
const vec2 kPlasticStep = vec2(0.7548776662, 0.5698402910);

float coverage_threshold(vec2 pixel, float strand_offset) { return fract(dot(pixel, kPlasticStep) + strand_offset); }
