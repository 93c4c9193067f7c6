// Reads FOLDER/hair.usda, .usdc and .usdz with tinyusdz and compares each with FOLDER/hair.csv:
// node usd_parser.mjs PACKAGE FOLDER
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [packageFolder, folder] = process.argv.slice(2);
const kTolerance = 0.0002; // cm: files say positions in steps of 0.0001

/** Makes a parser: of a file's name it gives what it understood of the file, as it writes it down itself. */
async function startedParser() {
  const wasm = readFileSync(`${packageFolder}/tinyusdz.wasm`);
  // The package is made for browsers: it is to find one, and gets its module without a network.
  process.type = "renderer";
  globalThis.self ??= globalThis;
  globalThis.window ??= globalThis;
  globalThis.document ??= { currentScript: null };
  globalThis.location ??= { href: "file:///" };
  globalThis.fetch = async () => new Response(wasm, { headers: { "Content-Type": "application/wasm" } });
  const { default: start } = await import(pathToFileURL(`${packageFolder}/tinyusdz.mjs`));
  const module = await start({ wasmBinary: wasm });
  return (name) => {
    const loader = new module.TinyUSDZLoaderNative();
    const isLoaded = loader.loadAsLayerFromBinary(new Uint8Array(readFileSync(`${folder}/${name}`)), name);
    assert.ok(isLoaded, `${name}: ${loader.error()}`);
    return loader.layerToString();
  };
}

const numbers = (text) => text.match(/-?\d[\d.]*(?:e[-+]?\d+)?/g).map(Number);
function valueOf(text, name) {
  const begin = text.indexOf(`${name} = `);
  assert.notEqual(begin, -1, `${name} is not there`);
  return text.slice(begin + name.length + 3, text.indexOf("\n", begin));
}
function samplesOf(text, name) {
  const begin = text.indexOf(`${name}.timeSamples = {`);
  assert.notEqual(begin, -1, `${name} has no samples`);
  const lines = text.slice(begin, text.indexOf("}", begin)).split("\n").slice(1);
  const samples = new Map();
  for (const line of lines) {
    const colon = line.indexOf(":");
    if (colon > 0) samples.set(Number(line.slice(0, colon)), numbers(line.slice(colon + 1)));
  }
  return samples;
}

/** Points and widths of each frame, strand after strand. */
function expected() {
  const rows = readFileSync(`${folder}/hair.csv`, "utf8").trim().split("\n").slice(1);
  const frames = new Map();
  for (const row of rows) {
    const [frame, , strand, vertex, x, y, z, width] = row.split(",").map(Number);
    if (!frames.has(frame)) frames.set(frame, { points: [], widths: [], counts: [] });
    const one = frames.get(frame);
    one.points.push(x, y, z);
    one.widths.push(width);
    one.counts[strand] = vertex + 1;
  }
  return frames;
}

function assertNear(found, wanted, what) {
  assert.equal(found.length, wanted.length, what);
  for (let i = 0; i < wanted.length; ++i)
    assert.ok(Math.abs(found[i] - wanted[i]) < kTolerance, `${what}: value ${i} is ${found[i]}, not ${wanted[i]}`);
}

const parsed = await startedParser();
const frames = expected();
for (const name of ["hair.usda", "hair.usdc", "hair.usdz"]) {
  const text = parsed(name);
  assert.equal(Number(valueOf(text, "metersPerUnit")), 0.01);
  assert.equal(Number(valueOf(text, "timeCodesPerSecond")), 24);
  assert.equal(Number(valueOf(text, "startTimeCode")), 1);
  assert.equal(Number(valueOf(text, "endTimeCode")), frames.size - 1);
  assert.match(valueOf(text, "upAxis"), /"Z"/);
  assert.match(text, /BasisCurves "Strands"/);
  assert.match(valueOf(text, "type"), /"linear"/);
  assert.deepEqual(numbers(valueOf(text, "curveVertexCounts")), frames.get(0).counts);
  assertNear(numbers(valueOf(text, "widths")), frames.get(0).widths, "widths");
  assertNear(numbers(valueOf(text, "points")), frames.get(0).points, "points at rest");
  const samples = samplesOf(text, "points");
  assert.deepEqual([...samples.keys()], [...frames.keys()]);
  for (const [time, points] of samples) assertNear(points, frames.get(time).points, `points at ${time}`);
  for (const [name, value] of [["groom_version_major", 1], ["groom_version_minor", 5]])
    assert.equal(Number(valueOf(text, `userProperties:${name}`)), value);
  for (const [name, ofStrand] of [["groom_guide", () => 0], ["groom_group_id", (i) => i % 3], ["groom_id", (i) => 1000 - i]])
    assert.deepEqual(numbers(valueOf(text, `primvars:${name}`)), frames.get(0).counts.map((_, i) => ofStrand(i)));
  assert.deepEqual(
    valueOf(text, "primvars:groom_group_name").match(/\w+(?=")/g),
    frames.get(0).counts.map((_, i) => ["fringe", "back"][i % 2]),
  );
  assert.equal(numbers(valueOf(text, "primvars:groom_root_uv")).length, 2 * frames.get(0).counts.length);
  for (const [time, box] of samplesOf(text, "extent")) {
    const points = frames.get(time).points;
    for (let axis = 0; axis < 3; ++axis) {
      const values = points.filter((_, i) => i % 3 === axis);
      assert.ok(box[axis] <= Math.min(...values) && box[axis] > Math.min(...values) - 0.05, `extent at ${time}`);
      assert.ok(box[3 + axis] >= Math.max(...values) && box[3 + axis] < Math.max(...values) + 0.05, `extent at ${time}`);
    }
  }
  console.log(`${name}: ${samples.size} time samples of ${frames.get(0).counts.length} curves are the same as the CSV's`);
}
