#!/usr/bin/env node
// Writes the head of a server's scene as glTF: node head.mjs ws://HOST:PORT head.glb
import { writeFile } from 'node:fs/promises';
import { pathToFileURL } from 'node:url';
import { connect, headOf } from 'strandcast';

export function glbOf({ positions, normals, triangles }) {
  const least = [0, 1, 2].map((axis) => positions.reduce((low, x, i) => (i % 3 === axis && x < low ? x : low), Infinity));
  const most = [0, 1, 2].map((axis) => positions.reduce((high, x, i) => (i % 3 === axis && x > high ? x : high), -Infinity));
  const arrays = [positions, normals, triangles];
  const bytes = Buffer.concat(arrays.map((array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength)));
  let byteOffset = 0;
  const views = arrays.map(({ byteLength }, i) => ({ buffer: 0, byteOffset: (byteOffset += byteLength) - byteLength, byteLength, target: i < 2 ? 34962 : 34963 }));
  const vectors = { componentType: 5126, count: positions.length / 3, type: 'VEC3' };
  const json = JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0, name: 'head' }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, indices: 2, material: 0 }] }],
    materials: [{ pbrMetallicRoughness: { baseColorFactor: [0.85, 0.66, 0.56, 1], metallicFactor: 0, roughnessFactor: 0.7 } }],
    accessors: [{ ...vectors, bufferView: 0, min: least, max: most }, { ...vectors, bufferView: 1 },
      { componentType: 5125, count: triangles.length, type: 'SCALAR', bufferView: 2 }],
    bufferViews: views, buffers: [{ byteLength: bytes.length }],
  });
  const text = Buffer.from(json.padEnd(Math.ceil(json.length / 4) * 4));
  const header = (...numbers) => Buffer.from(Uint32Array.from(numbers).buffer);
  return Buffer.concat([header(0x46546c67, 2, 28 + text.length + bytes.length), header(text.length, 0x4e4f534a), text, header(bytes.length, 0x4e4942), bytes]);
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) {
  const [url, file] = process.argv.slice(2);
  const connection = connect(url);
  connection.on('link', ({ state, reason }) => state === 'ended' && console.error(reason));
  connection.on('asset', async (asset) => {
    connection.close();
    await writeFile(file, glbOf(await headOf(asset)));
  });
}
