// Plays tapes (tests/web/tape.h) to the strand core in WebAssembly: what every message decodes to has the hash, or the
// error the words, that the native decoders had. Never may it trap.
//   node tests/web/play.mjs strand_core.wasm [--only NAME] [--rounds N] TAPE...     only what has this name on the tapes
// Prints a line per name on a tape, with medians of both sides where the tape has times (of each message the least of so
// many rounds: what else the machine does makes none of them shorter); the exit status is 1 when anything differs.
import fs from 'node:fs';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const here = path.dirname(fileURLToPath(import.meta.url));
const { loadStrandCore } = await import(pathToFileURL(path.join(here, '../../client/web/strand_core.mjs')));
const WARM_UP = 9; // first frames, of which no time counts

class Core {
  constructor(functions) {
    this.of = functions;
    this.decoder = 0;
  }
  /** Calls use(pointer, size) with the bytes in the module's memory. */
  lend(bytes, use) {
    const at = this.of.strand_core_allocate(bytes.length || 1);
    new Uint8Array(this.of.memory.buffer).set(bytes, at);
    try {
      return use(at, bytes.length);
    } finally {
      this.of.strand_core_free(at);
    }
  }
  make(codec, strands, vertices) {
    if (this.decoder) this.of.strand_core_delete(this.decoder);
    this.decoder = this.lend(new TextEncoder().encode(codec), (at, size) =>
      this.of.strand_core_make(at, size, strands, vertices));
    if (!this.decoder) throw new Error(this.error());
  }
  error() {
    const memory = new Uint8Array(this.of.memory.buffer);
    const begin = this.of.strand_core_error();
    return new TextDecoder().decode(memory.subarray(begin, memory.indexOf(0, begin)));
  }
  hash() {
    return BigInt.asUintN(64, this.of.strand_core_hash(this.decoder));
  }
}

/** The records of a tape, one after the other. */
function* records(file) {
  const bytes = fs.readFileSync(file);
  let at = 0;
  const take = (size) => bytes.subarray(at, (at += size));
  const u32 = () => take(4).readUInt32LE();
  while (at < bytes.length) {
    const kind = String.fromCharCode(take(1)[0]);
    const record = { kind, bytes: take(u32()) };
    if (kind === 'A' || kind === 'M') {
      record.ok = take(1)[0] === 1;
      if (record.ok) {
        record.hash = take(8).readBigUInt64LE();
        record.nativeMs = take(8).readDoubleLE();
      } else {
        record.error = take(u32()).toString();
      }
    }
    yield record;
  }
}

/** Processor time of this process: worth something on a busy machine too. */
function cpuMs() {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000;
}

function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? 0;
}

class Result {
  constructor(name) {
    Object.assign(this, { name, messages: 0, refused: 0, wrong: [], nativeMs: [], ownMs: [] });
  }
  /** Times of a message that is the same one in every round. */
  time(at, record, ms) {
    this.nativeMs[at] = record.nativeMs;
    this.ownMs[at] = Math.min(this.ownMs[at] ?? Infinity, ms);
  }
  compare(record, ok, core) {
    ++this.messages;
    if (!record.ok) ++this.refused;
    const own = ok ? (record.kind === 'M' ? core.hash() : 0n) : core.error();
    const expected = record.ok ? record.hash : record.error;
    if (own !== expected) this.wrong.push(`message ${this.messages}: ${show(own)} instead of ${show(expected)}`);
  }
  print() {
    let line = `${this.name}: ${this.messages - this.wrong.length} of ${this.messages} as native`;
    if (this.refused) line += `, ${this.refused} of them errors`;
    if (median(this.nativeMs) > 0) {
      const [native, own] = [median(this.nativeMs), median(this.ownMs)];
      line += `; decode ms native ${native.toFixed(2)} wasm ${own.toFixed(2)} ratio ${(own / native).toFixed(2)}`;
    }
    console.log(line);
    for (const what of this.wrong.slice(0, 5)) console.log(`  ${what}`);
  }
}
const show = (value) => (typeof value === 'bigint' ? value.toString(16).padStart(16, '0') : `"${value}"`);

const [wasm, ...tapes] = process.argv.slice(2);
const option = (name) => (tapes[0] === name ? tapes.splice(0, 2)[1] : undefined);
const only = option('--only');
const rounds = Number(option('--rounds') ?? 1);
if (!tapes.length || !(rounds >= 1)) {
  console.error('usage: node play.mjs strand_core.wasm [--only NAME] [--rounds N] TAPE...');
  process.exit(2);
}
const core = new Core(await loadStrandCore(fs.readFileSync(wasm)));
const results = new Map();

/** A round after the first compares again what has times, and nothing else. */
function play(tape, round) {
  let result;
  let sinceMade = 0;
  let timed = 0;
  for (const record of records(tape)) {
    if (record.kind === 'N') {
      const name = record.bytes.toString();
      if (only !== undefined && only !== name) {
        result = undefined;
        continue;
      }
      const key = `${tape} ${name}`;
      if (!results.has(key)) results.set(key, new Result(name));
      result = results.get(key);
      timed = 0;
      if (round > 0 && !(median(result.nativeMs) > 0)) result = undefined;
    } else if (!result) {
      continue;
    } else if (record.kind === 'D') {
      core.make(record.bytes.subarray(8).toString(), record.bytes.readUInt32LE(0), record.bytes.readUInt32LE(4));
      sinceMade = 0;
    } else {
      const call = record.kind === 'A' ? core.of.strand_core_set_asset : core.of.strand_core_decode;
      const ok = core.lend(record.bytes, (at, size) => {
        const begin = cpuMs();
        const status = call(core.decoder, at, size);
        if (record.kind === 'M' && ++sinceMade > WARM_UP && record.ok) result.time(timed++, record, cpuMs() - begin);
        return status === 1;
      });
      result.compare(record, ok, core);
    }
  }
}
for (const tape of tapes) for (let round = 0; round < rounds; ++round) play(tape, round);
let different = 0;
let played = 0;
for (const result of results.values()) {
  result.print();
  different += result.wrong.length;
  played += result.messages;
}
console.log(`${played} messages and assets, ${different} otherwise than native`);
process.exit(different || !played ? 1 : 0);
