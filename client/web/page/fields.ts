// Fields of a scene that the page's panel shows, with their ranges and the part of a range that is handy: of the look from
// scene.proto (proto/schema.py), others as common/scene/scene_fields.h has them (a test compares).
export interface Field {
  path: string;
  title: string;
  range?: string; // its name there; none: of the look
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
const WIND: [string, number, number, string] = ['kWindSpeed', -100, 100, 'm/s'];

// schema begin: page ranges
const lookNumbers: { readonly [path: string]: readonly [number, number, string, number, string, boolean] } = {
  'look.eumelanin': [0, 10, '', 8, 'brown melanin', false],
  'look.pheomelanin': [0, 10, '', 4, 'red melanin', false],
  'look.strand_radius_m': [1e-6, 0.01, 'm', 0.0005, 'radius', false],
  'look.tip_scale': [0, 1, '', 1, 'radius at the tip', false],
  'look.followers': [0, 64, '', 64, 'followers', true],
  'look.segments': [1, 8, '', 8, 'segments', true],
  'look.ambient': [0, 1, '', 1, 'ambient', false],
  'look.exposure': [0, 100, '', 4, 'exposure', false],
  'look.style.clump': [0, 1, '', 1, 'clump', false],
  'look.style.locks': [1, 16, '', 16, 'locks', true],
  'look.style.spread': [0, 1, '', 0.1, 'spread', false],
  'look.style.wave_m': [0, 0.1, 'm', 0.02, 'waves', false],
  'look.style.wave_count': [0, 64, 'waves', 16, 'waves along it', false],
  'look.style.frizz_m': [0, 0.1, 'm', 0.005, 'frizz', false],
  'look.style.frizz_count': [0, 64, 'waves', 32, 'frizz along it', false],
  'look.style.stray_share': [0, 1, '', 0.3, 'strays', false],
  'look.style.stray_spread': [0, 20, '', 10, 'strays go further', false],
  'look.style.length_spread': [0, 1, '', 1, 'uneven lengths', false],
  'look.style.short_share': [0, 1, '', 0.5, 'short ones', false],
  'look.style.tip_fade': [0, 1, '', 1, 'tips fade over', false],
  'look.shading.diffuse': [0, 10, '', 2, 'diffuse', false],
  'look.shading.scatter': [0, 10, '', 2, 'scatter', false],
  'look.shading.highlight': [0, 10, '', 4, 'highlight', false],
  'look.shading.transmission': [0, 10, '', 4, 'transmission', false],
  'look.shading.second_highlight': [0, 10, '', 4, 'second highlight', false],
  'look.shading.highlight_width_deg': [1, 45, 'degrees', 45, 'highlight width', false],
  'look.shading.cuticle_deg': [-15, 15, 'degrees', 15, 'cuticle', false],
  'look.shading.cuticle_spread_deg': [0, 30, 'degrees', 30, 'cuticle spread', false],
  'look.shading.root_darkening': [0, 1, '', 1, 'root darkening', false],
  'look.shading.strand_variation': [0, 1, '', 1, 'strand variation', false],
  'look.shading.lock_variation': [0, 1, '', 1, 'lock variation', false],
  'look.shading.warmth_variation': [0, 1, '', 1, 'warmth variation', false],
  'look.shading.wetness': [0, 1, '', 1, 'wetness', false],
};
// schema end
/** Of the look: as scene.proto has it, but for what is said here. */
function look(name: string, title?: string, handy?: number): Field {
  const [minimum, maximum, unit, usual, label, isWhole] = lookNumbers[`look.${name}`]!;
  return { path: `look.${name}`, title: title ?? label, minimum, maximum, unit, handy: handy ?? usual, isWhole };
}

export const lookSections: readonly Section[] = [
  { title: 'Colour', fields: [
    look('eumelanin'), look('pheomelanin'), look('shading.wetness'), look('exposure'), look('ambient', 'light from around'),
  ] },
  { title: 'Style', fields: [
    look('style.clump'), look('style.locks'), look('style.spread'), look('style.wave_m'), look('style.wave_count'),
    look('style.frizz_m'), look('style.frizz_count'), look('style.stray_share'), look('style.stray_spread'),
    look('style.length_spread'), look('style.short_share'), look('style.tip_fade'),
  ] },
  { title: 'Shading', fields: [
    look('shading.diffuse'), look('shading.scatter'), look('shading.highlight'), look('shading.transmission'),
    look('shading.second_highlight'), look('shading.highlight_width_deg'), look('shading.cuticle_deg'),
    look('shading.root_darkening'), look('shading.strand_variation'),
  ] },
  { title: 'Detail', fields: [
    look('followers', 'drawn strands between', 16), look('segments'), look('strand_radius_m'), look('tip_scale'),
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
    f('stream.bound_m', 'error, at most', ['kStreamBound', 1e-6, 5e-4, 'm']),
  ] },
];

/** Hair colours by name, with roots and tips as a screen shows them (common/scene/hair_color.cpp). */
export const hairColors: readonly [string, string, string][] = [
  ['black', '#120e0c', '#1d1815'], ['brown', '#3a2416', '#5f3f27'], ['blond', '#9b7950', '#cead7d'],
  ['red', '#6c3319', '#97512b'], ['grey', '#959597', '#bcbcbd'], ['dyed', '#371d69', '#7337aa'],
];
