// From linear light to what a screen shows.

// Keeps dark and middle tones as they are and bends values above the knee towards 1, colour by colour.
const float kToneKnee = 0.7;

vec3 tone_map(vec3 linear) {
  vec3 over = max(linear - kToneKnee, 0.0);
  float room = 1.0 - kToneKnee;
  return min(linear, kToneKnee) + room * over / (over + room);
}

// sRGB transfer function, IEC 61966-2-1.
vec3 srgb_from_linear(vec3 linear) {
  vec3 low = 12.92 * linear;
  vec3 high = 1.055 * pow(max(linear, 0.0), vec3(1.0 / 2.4)) - 0.055;
  return mix(high, low, lessThanEqual(linear, vec3(0.0031308)));
}

vec3 linear_from_srgb(vec3 shown) {
  vec3 low = shown / 12.92;
  vec3 high = pow((shown + 0.055) / 1.055, vec3(2.4));
  return mix(high, low, lessThanEqual(shown, vec3(0.04045)));
}

// Of the background, linear: lighter at the top of the picture and darker at its bottom. `height`: 0 bottom .. 1 top.
vec3 background_light(vec3 middle, float height) {
  const float kGradient = 0.35;
  return middle * (1.0 + kGradient * (2.0 * height - 1.0));
}
