// Fields of a scene that the page's panel shows, with their ranges (common/scene/scene_fields.h; a test compares) and
// the part of a range that is handy.
export interface Field {
  path: string;
  title: string;
  range: string; // its name there
  minimum: number;
  maximum: number;
  unit: string;
  handy?: number; // most that the slider reaches
  isWhole?: boolean;
}
export interface Section {
  title: string;
  fields: readonly Field[];
}

const f = (path: string, title: string, range: [string, number, number, string], handy?: number, isWhole?: boolean): Field => ({
  path, title, range: range[0], minimum: range[1], maximum: range[2], unit: range[3], handy, isWhole,
});
const FRACTION: [string, number, number, string] = ['kFraction', 0, 1, ''];
const WEIGHT: [string, number, number, string] = ['kShadingWeight', 0, 10, ''];
const AMPLITUDE: [string, number, number, string] = ['kStyleAmplitude', 0, 0.1, 'm'];
const COUNT: [string, number, number, string] = ['kStyleCount', 0, 64, 'waves'];
const MELANIN: [string, number, number, string] = ['kMelanin', 0, 10, ''];
const WIND: [string, number, number, string] = ['kWindSpeed', -100, 100, 'm/s'];

export const lookSections: readonly Section[] = [
  { title: 'Colour', fields: [
    f('look.eumelanin', 'brown melanin', MELANIN, 8), f('look.pheomelanin', 'red melanin', MELANIN, 4),
    f('look.shading.wetness', 'wetness', FRACTION), f('look.exposure', 'exposure', ['kExposure', 0, 100, ''], 4),
    f('look.ambient', 'light from around', FRACTION),
  ] },
  { title: 'Style', fields: [
    f('look.style.clump', 'clump', FRACTION), f('look.style.locks', 'locks', ['kLocks', 1, 16, ''], 16, true),
    f('look.style.spread', 'spread', FRACTION, 0.1), f('look.style.wave_m', 'waves', AMPLITUDE, 0.02),
    f('look.style.wave_count', 'waves along it', COUNT, 16), f('look.style.frizz_m', 'frizz', AMPLITUDE, 0.005),
    f('look.style.frizz_count', 'frizz along it', COUNT, 32), f('look.style.stray_share', 'strays', FRACTION, 0.3),
    f('look.style.stray_spread', 'strays go further', ['kStraySpread', 0, 20, ''], 10),
    f('look.style.length_spread', 'uneven lengths', FRACTION), f('look.style.short_share', 'short ones', FRACTION, 0.5),
    f('look.style.tip_fade', 'tips fade over', FRACTION),
  ] },
  { title: 'Shading', fields: [
    f('look.shading.diffuse', 'diffuse', WEIGHT, 2), f('look.shading.scatter', 'scatter', WEIGHT, 2),
    f('look.shading.highlight', 'highlight', WEIGHT, 4), f('look.shading.transmission', 'transmission', WEIGHT, 4),
    f('look.shading.second_highlight', 'second highlight', WEIGHT, 4),
    f('look.shading.highlight_width_deg', 'highlight width', ['kHighlightWidth', 1, 45, 'degrees']),
    f('look.shading.cuticle_deg', 'cuticle', ['kCuticle', -15, 15, 'degrees']),
    f('look.shading.root_darkening', 'root darkening', FRACTION),
    f('look.shading.strand_variation', 'strand variation', FRACTION),
  ] },
  { title: 'Detail', fields: [
    f('look.followers', 'drawn strands between', ['kFollowers', 0, 64, ''], 16, true),
    f('look.segments', 'segments', ['kSegments', 1, 8, ''], 8, true),
    f('look.strand_radius_m', 'radius', ['kDrawnRadius', 1e-6, 0.01, 'm'], 0.0005),
    f('look.tip_scale', 'radius at the tip', FRACTION),
  ] },
];

export const simulationSections: readonly Section[] = [
  { title: 'Wind and gravity', fields: [
    f('wind.mean_mps.x', 'wind to the right', WIND, 10), f('wind.mean_mps.y', 'wind upwards', WIND, 10),
    f('wind.mean_mps.z', 'wind to the front', WIND, 10),
    f('wind.gust_intensity', 'gusts', ['kGustIntensity', 0, 3, '']),
    f('gravity_mps2.y', 'gravity', ['kGravity', -1000, 1000, 'm/s^2'], 20),
  ] },
  { title: 'Hair on hair', fields: [
    f('volume.friction_per_s', 'friction', ['kHairFriction', 0, 1e4, '1/s'], 60),
    f('volume.repulsion_per_s2', 'repulsion', ['kHairRepulsion', 0, 1e6, '1/s^2'], 40_000),
    f('volume.wind_width_m', 'keeps wind off', ['kWindWidth', 0, 1, 'm'], 0.01),
    f('follicle_limit_deg', 'roots lean at most', ['kFollicleLimit', 1, 180, 'degrees']),
  ] },
  { title: 'Stream', fields: [
    f('stream.strand_rate_hz', 'states, at most (0: every step)', ['kStrandRate', 0, 1000, 'Hz'], 120),
    f('stream.bound_m', 'error, at most', ['kStreamBound', 2e-5, 5e-4, 'm']),
  ] },
];

/** Hair colours by name, with roots and tips as a screen shows them (common/scene/hair_color.cpp). */
export const hairColors: readonly [string, string, string][] = [
  ['black', '#191614', '#26211e'], ['brown', '#4b3322', '#795638'], ['blond', '#a28259', '#d1b486'],
  ['red', '#844424', '#af6537'], ['grey', '#959597', '#bcbcbd'], ['dyed', '#45277c', '#8945bf'],
];
