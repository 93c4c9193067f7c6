// What hair does to hair, before a substep of whatever model: friction brings a vertex's velocity to the mean
// of the hair around it, and where hair is denser than it may be, it is pushed down the slope of the density
// (Petrovic, Henne, Anderson 2005; Woodhouse 2017, equations 2.2 to 2.4 and 4.2.4, with the push's own
// stiffness taken implicitly, as drag against the mean velocity). With extras hair is also pushed towards a
// target's density (Woodhouse 2017, 6.2), and feels less of the wind behind other hair. With air each
// hair is dragged, as a thin cylinder, by the air at its place. Hair around it carries that air along, the
// more the denser it is (common/kernels/volume/hair_in_air.h); models have no drag of their own then. A model
// that keeps its ways is also told how much more inert a vertex is for all other forces while air drags it. One
// invocation per strand.
#pragma variant HAS_WAY 0 1
#pragma variant HAS_EXTRAS 0 1
#pragma variant HAS_AIR 0 1
#include "sim/gust.glsl"
#include "sim/volume.glsl"

layout(local_size_x = kStrandLocalSize) in;

// Density from which on hair is pushed away, m/m^3: four vertices of a strand to an element.
layout(binding = kUnitRestDensity) uniform samplerBuffer u_rest_density;
#if HAS_WAY
// Way of every vertex in the last substep, world, m: velocities of such models answer to more than motion.
layout(binding = kUnitDisplacement) uniform samplerBuffer u_displacement;
#if HAS_AIR
// w: inertia against all other forces in this substep, less 1.
layout(std430, binding = kBindingDisplacement) writeonly restrict buffer DisplacementBlock {
  vec4 value[];
} b_displacement;
#endif
#endif

uniform float u_friction;      // 1/s
uniform float u_repulsion;     // m^2/s^2
uniform float u_ahead;         // 1: forces are those at the end of the substep; 0: at its beginning
uniform float u_give;          // of the push's own stiffness, what is taken implicitly
uniform float u_target;        // m^2/s^2, of the push to the target's density
uniform float u_mean_density;  // of the groom, m/m^3
uniform float u_shadow;        // share of its shadow that hair casts on the wind

#if HAS_AIR
uniform float u_reynolds;  // per m/s
uniform float u_air_rate;  // 1/s per drag number
uniform float u_lock;      // m^2: real hairs of a strand x width of a lock x radius of a hair
uniform float u_along;     // of the drag across a hair, what there is along it
uniform float u_around;    // of the wind, what goes around hair that carries all of its air along

// Air that stands still against hair is carried along, as far as there is hair.
const float kLeastReynolds = 1e-6;

// Drag coefficient times Reynolds number of a hair across the flow.
float drag_number(float reynolds) {
  const float root = sqrt(reynolds);
  return 7.0 * sqrt(sqrt(root)) + 1.96 * root + 1.18 * reynolds;
}

// How long a pull as at the beginning of a substep would have to last for what it does fading at this rate.
float time_at_rate(float h, float rate) {
  const float faded = h * rate;
  return select(faded > 1e-3, (1.0 - exp(-faded)) / max(rate, 1e-6), h * (1.0 - 0.5 * faded));
}

struct Pull {
  vec3 gained;    // velocity, m/s
  float inertia;  // of the hair against all other forces, 1 where no air drags it
};

struct AirHere {
  vec3 outside;   // velocity of the air that comes in, relative to the head joint, m/s
  vec3 hair;      // mean velocity of the hair here, likewise
  float density;  // of strands, m/m^3
  vec3 along;     // the hair's own direction, of any length
};

// What hair around a vertex, which brakes it by `friction`, 1/s, and then the air do to it in a substep. Both
// are exact, were they as they are for the whole substep: so it goes by seconds, and not by steps. Other forces
// do less in a substep while air drags: by (1 - exp(-h rate)) / (h rate), the inverse of the inertia. Hair that
// rests in a wind then leans as far as drag and weight say, at any step rate. The wind that comes in has lost
// what hair before it took, so hair at rest does not carry it along once more.
Pull taken_on(AirHere air, vec3 moving, float h, float friction) {
  const vec3 rubbed = (friction * time_at_rate(h, friction)) * (air.hair - moving);
  const vec3 against = air.outside - air.hair;
  const float lock_reynolds = max(u_reynolds * sqrt(dot(against, against)), kLeastReynolds);
  const float pulled = u_lock * air.density * drag_number(lock_reynolds);
  const float carried = pulled / (pulled + lock_reynolds);
  const float with_wind =
      dot(air.hair, air.outside) / max(dot(air.outside, air.outside), kTinySquared);
  const vec3 own = air.hair - clamp(with_wind, 0.0, 1.0) * air.outside;
  const vec3 flow = (1.0 - u_around * carried) * air.outside + carried * own - moving - rubbed;
  const float rate = u_air_rate * drag_number(u_reynolds * sqrt(dot(flow, flow)));
  const float time = time_at_rate(h, rate);
  const float length_squared = max(dot(air.along, air.along), kTinySquared);
  const float slip = (1.0 - u_along) * (dot(flow, air.along) / length_squared);
  return Pull(rubbed + (time * rate) * (flow - slip * air.along), h / time);
}
#endif

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
#if HAS_AIR
  vec3 before = texelFetch(u_position, int((u_step.shape.z - 1u) * stride + strand)).xyz;
#endif
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
    const vec3 way = texelFetch(u_displacement, int(at)).xyz;
    const vec3 moving = way * u_step.push.w - u_step.head_velocity.xyz;
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
    if (u_target > 0.0) {
      push -= (u_target / u_mean_density) * turned_with_head(volume_excess_slope(grid, place));
      const vec3 groom_slope = here.slope / u_mean_density;
      stiffness += u_target * dot(groom_slope, groom_slope);
    }
    const float let_in = 1.0 - u_shadow * (1.0 - volume_wind(grid, place));
#endif
#if HAS_AIR || HAS_EXTRAS
    const vec3 wind = u_step.wind.xyz + gust_velocity(position);
#endif
#if HAS_EXTRAS && !HAS_AIR
    // What the model's own drag will take of a wind that is not there: the air moves with the hair.
    push -= ((1.0 - let_in) * u_step.contact.y) * (wind - here.velocity);
#endif
    const float drag = u_friction + u_give * h * stiffness;
    const float share = h / (1.0 + h * drag);
#if HAS_AIR
    // Only the push is held back: a pull towards a velocity leads no farther than there.
    const vec3 pushed = share * push;
    const float squared = dot(pushed, pushed);
    const vec3 held = select(squared > fastest * fastest, pushed * (fastest * inversesqrt(squared)), pushed);
#if HAS_EXTRAS
    const vec3 outside = let_in * wind;
#else
    const vec3 outside = wind;
#endif
    const vec3 after = i + 1u < u_step.shape.y ? texelFetch(u_position, int(at + stride)).xyz : position;
    const AirHere air = AirHere(outside, here.velocity, here.density, after - before);
    const Pull pull = taken_on(air, moving, h, drag);
#if HAS_WAY
    const vec3 limited = held / pull.inertia + pull.gained;
#else
    const vec3 limited = held + pull.gained;
#endif
    before = position;
#else
    const vec3 gained = share * (push + drag * (here.velocity - moving));
    const float squared = dot(gained, gained);
    const vec3 limited =
        select(squared > fastest * fastest, gained * (fastest * inversesqrt(squared)), gained);
#endif
    const lane_bool is_lost = is_broken(stored.xyz) || is_broken(position) || is_broken(limited);
#if HAS_AIR && HAS_WAY
    b_displacement.value[at] = vec4(way, select(is_lost, 0.0, pull.inertia - 1.0));
#endif
    b_velocity.velocity[at] = vec4(select(is_lost, stored.xyz, stored.xyz + limited), stored.w);
  }
}
