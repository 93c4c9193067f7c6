// Opacities multiplied in any order with the same bits: 1 - a becomes an integer logarithm, which is summed.

const float kOpacitySteps = 65536.0;       // per halving of the light
const float kLeastPassing = 1.0 / 65536.0; // nothing is quite opaque: 16 halvings at most

uint opacity_log(float opacity) {
  return uint(-log2(max(1.0 - opacity, kLeastPassing)) * kOpacitySteps + 0.5);
}

float transmitted(uint log_sum) { return exp2(float(log_sum) * (-1.0 / kOpacitySteps)); }
