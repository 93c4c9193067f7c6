// What hair does to hair, before a substep of whatever model: friction brings a vertex's velocity to the mean
// of the hair around it, and where hair is denser than it may be, it is pushed down the slope of the density
// (Petrovic, Henne, Anderson 2005; document 003, equations 2.2 to 2.4 and section 4.2.4, with the push's own
// stiffness taken implicitly, as drag against the mean velocity). With extras hair is also pushed towards a
// target's density (document 003, section 6.2), and feels less of the wind behind other hair. One invocation
// per strand.
#pragma variant HAS_WAY 0 1
#pragma variant HAS_EXTRAS 0 1
#include "sim/gust.glsl"
#include "sim/volume.glsl"

layout(local_size_x = kStrandLocalSize) in;

// Density from which on hair is pushed away, m/m^3: four vertices of a strand to an element.
layout(binding = kUnitRestDensity) uniform samplerBuffer u_rest_density;
#if HAS_WAY
// Way of every vertex in the last substep, world, m: velocities of such models answer to more than motion.
layout(binding = kUnitDisplacement) uniform samplerBuffer u_displacement;
#endif

uniform float u_friction;      // 1/s
uniform float u_repulsion;     // m^2/s^2
uniform float u_ahead;         // 1: forces are those at the end of the substep; 0: at its beginning
uniform float u_give;          // of the push's own stiffness, what is taken implicitly
uniform float u_target;        // m^2/s^2, of the push to the target's density
uniform float u_mean_density;  // of the groom, m/m^3
uniform float u_shadow;        // share of its shadow that hair casts on the wind

// No push moves a vertex by more cells than this in a substep, against the volume.
const float kMostCells = 0.25;

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  const float h = u_step.head_velocity.w;
  const VolumeGrid grid = volume_grid();
  const float fastest = kMostCells / (grid.per_cell * h);
  vec4 thresholds = vec4(0.0);
  for (uint i = u_step.shape.z; i < u_step.shape.w; ++i) {
    const uint part = i % 4u;
    if (part == 0u || i == u_step.shape.z)
      thresholds = texelFetch(u_rest_density, int((i / 4u) * stride + strand));
    const float threshold = part == 0u   ? thresholds.x
                            : part == 1u ? thresholds.y
                            : part == 2u ? thresholds.z
                                         : thresholds.w;
    const uint at = i * stride + strand;
    const vec4 stored = texelFetch(u_velocity, int(at));
    const vec3 position = texelFetch(u_position, int(at)).xyz;
#if HAS_WAY
    const vec3 moving = texelFetch(u_displacement, int(at)).xyz * u_step.push.w - u_step.head_velocity.xyz;
#else
    const vec3 moving = stored.xyz - u_step.head_velocity.xyz;
#endif
    const VolumePlace place = volume_place(grid, position + (u_ahead * h) * moving);
    const VolumeHere here = volume_at(grid, place);
    const vec3 slope = turned_with_head(here.slope) / threshold;
    const float over = max(here.density / threshold - 1.0, 0.0);
    float stiffness = select(over > 0.0, u_repulsion * dot(slope, slope), 0.0);
    vec3 push = (-u_repulsion * over) * slope;
#if HAS_EXTRAS
    const VolumeExtra extra = volume_extra(grid, place);
    push -= (u_target / u_mean_density) * turned_with_head(extra.excess_slope);
    const vec3 groom_slope = here.slope / u_mean_density;
    stiffness += u_target * dot(groom_slope, groom_slope);
    // What the model's own drag will take of a wind that is not there: the air moves with the hair.
    const vec3 wind = u_step.wind.xyz + gust_velocity(position);
    push -= (u_shadow * (1.0 - extra.wind) * u_step.contact.y) * (wind - here.velocity);
#endif
    const float drag = u_friction + u_give * h * stiffness;
    const vec3 gained = (h / (1.0 + h * drag)) * (push + drag * (here.velocity - moving));
    const float squared = dot(gained, gained);
    const vec3 limited =
        select(squared > fastest * fastest, gained * (fastest * inversesqrt(squared)), gained);
    const lane_bool is_lost = is_broken(stored.xyz) || is_broken(position) || is_broken(limited);
    b_velocity.velocity[at] = vec4(select(is_lost, stored.xyz, stored.xyz + limited), stored.w);
  }
}
