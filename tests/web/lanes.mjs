// Prints what lanes in WebAssembly make of numbers at the edges: node tests/web/lanes.mjs lane_check.wasm
import fs from 'node:fs';
import { loadStrandCore } from '../../client/web/strand_core.mjs';

const functions = await loadStrandCore(fs.readFileSync(process.argv[2]));
const begin = functions.lane_check();
const memory = new Uint8Array(functions.memory.buffer);
process.stdout.write(new TextDecoder().decode(memory.subarray(begin, memory.indexOf(0, begin))));
