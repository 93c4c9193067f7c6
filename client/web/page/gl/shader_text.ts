// The project's shader files as WebGL2 takes them: includes joined, each once, behind a prologue of GLSL ES 3.00;
// without binding numbers, which it does not have.
import strandPoint from 'client/web/page/gl/strand_point.glsl';
import coverage from 'shaders/lib/coverage.glsl';
import hairLight from 'shaders/lib/hair_light.glsl';
import hash from 'shaders/lib/hash.glsl';
import hermite from 'shaders/lib/hermite.glsl';
import select from 'shaders/lib/select.glsl';
import skin from 'shaders/lib/skin.glsl';
import tone from 'shaders/lib/tone.glsl';
import tileFrame from 'shaders/render/tile_frame.glsl';
import tileLight from 'shaders/render/tile_light.glsl';
import bindings from 'shaders/shared/bindings.h';
import limits from 'shaders/shared/limits.h';
import tiles from 'shaders/shared/tiles.h';

const files: { readonly [path: string]: string } = {
  'gl/strand_point.glsl': strandPoint, 'lib/coverage.glsl': coverage, 'lib/hair_light.glsl': hairLight, 'lib/hash.glsl': hash, 'lib/hermite.glsl': hermite,
  'lib/select.glsl': select, 'lib/skin.glsl': skin, 'lib/tone.glsl': tone, 'render/tile_frame.glsl': tileFrame,
  'render/tile_light.glsl': tileLight, 'shared/bindings.h': bindings, 'shared/limits.h': limits, 'shared/tiles.h': tiles,
};

const PROLOGUE = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
precision highp usampler2D;
`;

function joined(text: string, seen: Set<string>): string {
  return text
    .split('\n')
    .map((line) => {
      const path = /^\s*#include "(.*)"/.exec(line)?.[1];
      if (path === undefined) return /^\s*#pragma /.test(line) ? '' : line;
      if (seen.has(path)) return '';
      seen.add(path);
      const file = files[path];
      if (file === undefined) throw new Error(`no shader file is called ${path}`);
      return joined(file, seen);
    })
    .join('\n');
}

export function shaderText(text: string): string {
  return PROLOGUE + joined(text, new Set())
    .replace(/layout\(binding ?= ?\w+\) ?/g, '')
    .replace(/layout\(std140, ?binding ?= ?\w+\)/g, 'layout(std140)');
}
