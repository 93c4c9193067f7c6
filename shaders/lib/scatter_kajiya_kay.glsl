// Kajiya and Kay 1989: a thin cylinder that is diffuse and reflects into a cone; with two highlights as in
// TressFX 4.1, the white one turned to the root, the one in the hair's colour to the tip.
#pragma once
#include "lib/fibre.glsl"

// TressFX turns by 2 and 3 times a cone angle; their powers are 14.4 and 11.8.
const float kTurnWhite = -2.0;
const float kTurnTinted = 3.0;
const float kTintedSharpness = 11.8 / 14.4;
// Artist's weights, chosen by eye on the built-in scene.
const float kWhiteHighlight = 0.10;
const float kTintedHighlight = 0.90;

// cos^power of the angle between the eye and the cone that the light is reflected into, turned by an angle.
float turned_highlight(vec3 tangent, vec3 to_light, vec3 to_eye, float turn, float power) {
  float light_along = dot(tangent, to_light);
  float eye_along = dot(tangent, to_eye);
  float light_across = sqrt(max(0.0, 1.0 - light_along * light_along));
  float eye_across = sqrt(max(0.0, 1.0 - eye_along * eye_along));
  float reflected = light_across * sin(turn) - light_along * cos(turn);
  float cosine = reflected * eye_along + sqrt(max(0.0, 1.0 - reflected * reflected)) * eye_across;
  return pow(max(0.0, cosine), power);
}

// The one highlight of the original.
float kajiya_kay_specular(vec3 tangent, vec3 to_light, vec3 to_eye, float power) {
  return turned_highlight(tangent, to_light, to_eye, 0.0, power);
}

vec3 scatter_kajiya_kay(vec3 tangent, vec3 to_light, vec3 to_eye, Fibre fibre) {
  // cos^p x falls like a Gaussian of width 1 / sqrt(p), and x is twice the half angle.
  float power = 0.25 / (fibre.width * fibre.width);
  float cone = -fibre.shift;
  float white = turned_highlight(tangent, to_light, to_eye, kTurnWhite * cone - 2.0 * fibre.tilt, power);
  float tinted = turned_highlight(tangent, to_light, to_eye, kTurnTinted * cone - 2.0 * fibre.tilt,
                                  kTintedSharpness * power);
  return fibre.diffuse * kajiya_kay_diffuse(tangent, to_light) * fibre.color +
         kWhiteHighlight * fibre.lobes.x * white + kTintedHighlight * fibre.lobes.z * tinted * fibre.color;
}
