// Followers: strands drawn between three key strands. Everything random comes from an integer hash of the follower's
// index, so that every machine draws the same hair and no root moves between frames.
#include "lib/hash.glsl"

// Salts that make independent numbers from one follower index.
const uint kSaltFirst = 0x9e3779b9u;
const uint kSaltSecond = 0x85ebca6bu;
const uint kSaltLength = 0xc2b2ae35u;
const uint kSaltX = 0x27d4eb2fu;
const uint kSaltY = 0x165667b1u;
const uint kSaltZ = 0xd3a2646cu;
const uint kSaltPhase = 0xfd7046c5u;

float follower_random(uint follower_index, uint salt) { return unit_float(mix_u32(follower_index ^ salt)); }

// Uniformly spread barycentric weights (sum 1, each >= 0).
vec3 follower_weights(uint follower_index) {
  float root = sqrt(follower_random(follower_index, kSaltFirst));
  float second = follower_random(follower_index, kSaltSecond);
  return vec3(1.0 - root, root * (1.0 - second), root * second);
}

// Pulls the weights towards the nearest key strand: clump 0 leaves them, 1 squares them. A single weight of 1 stays 1.
vec3 clumped_weights(vec3 weights, float clump) {
  vec3 pulled = weights * ((1.0 - clump) + clump * weights);
  return pulled / (pulled.x + pulled.y + pulled.z);
}

vec3 interpolate_keys(vec3 weights, vec3 a, vec3 b, vec3 c) { return weights.x * a + weights.y * b + weights.z * c; }
