// The page's parts that need no browser, as esbuild bundled them (tests/web/page.sh): messages field by field against
// the .proto files and byte by byte against the kept ones, ranges and colours against the sources they are copies of.
//   node page.test.mjs BUNDLE.mjs
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const root = path.join(path.dirname(fileURLToPath(import.meta.url)), '../..');
const read = (name) => fs.readFileSync(path.join(root, name), 'utf8');
const page = await import(pathToFileURL(path.resolve(process.argv[2])));
let checks = 0;
const check = (what, test) => {
  try {
    test();
    ++checks;
  } catch (error) {
    console.error(`${what}: ${error.message}`);
    process.exitCode = 1;
  }
};

// ---- messages, as the .proto files declare them

const messages = new Map(); // name -> Map of field -> [number, type, repeated]
const enumerators = new Map(); // name -> number
for (const name of ['scene', 'session', 'input']) {
  const text = read(`proto/strandcast/v1/${name}.proto`).replace(/\/\/.*$/gm, '').replace(/"(\\.|[^"\\])*"/g, '')
    .replace(/\[[^\]]*\]/g, '').replace(/\boption \([^;]*;/g, '');
  const stack = [];
  for (const [statement] of text.matchAll(/(message|enum|oneof)\s+\w+\s*\{|\}|[^;{}]+;/g)) {
    const words = statement.trim().replace(/[;{]/g, '').split(/\s*=\s*|\s+/);
    if (/^(message|enum|oneof)\s/.test(statement.trim())) {
      stack.push(words);
      if (words[0] === 'message') messages.set(words[1], new Map());
    } else if (statement === '}') stack.pop();
    else if (stack.length && stack[stack.length - 1][0] === 'enum') enumerators.set(words[0], Number(words[1]));
    else if (stack.length) {
      const isRepeated = words[0] === 'repeated';
      if (isRepeated || words[0] === 'optional') words.shift();
      const message = stack.filter(([kind]) => kind === 'message').pop()[1];
      messages.get(message).set(words[1], [Number(words[2]), words[0], isRepeated]);
    }
  }
}
const NOT_SENT = new Set(['ClientMessage.motion', 'ClientMessage.wind']);
for (const [name, schema] of Object.entries(page.schemas)) {
  check(name, () => {
    const declared = messages.get(name);
    assert.ok(declared, 'no .proto file has it');
    for (const field of Object.keys(schema)) assert.ok(declared.has(field), `.proto has no ${field}`);
    for (const [field, [number, type, isRepeated]] of declared) {
      if (NOT_SENT.has(`${name}.${field}`)) continue;
      assert.ok(schema[field], `${field} is missing`);
      const [ours, kind, repeated] = schema[field];
      assert.equal(ours, number, field);
      assert.equal(repeated === 'repeated', isRepeated, field);
      if (typeof kind === 'string') assert.equal(kind, messages.has(type) ? 'message' : /^[A-Z]/.test(type) ? 'enum' : type, field);
      else assert.equal(kind, page.schemas[type], field);
    }
  });
}

// ---- messages as C++ wrote them down, in bytes and in words

function readText(text) {
  const words = [...text.matchAll(/"(?:[^"\\]|\\.)*"|[{}]|[\w.+-]+|:/g)].map(([word]) => word);
  let at = 0;
  const message = () => {
    const fields = [];
    while (at < words.length && words[at] !== '}') {
      const name = words[at++];
      if (words[at] === ':') ++at;
      if (words[at] === '{') {
        ++at;
        fields.push([name, message()]);
        ++at;
      } else fields.push([name, words[at++]]);
    }
    return fields;
  };
  return message();
}
function valueOf(word, kind) {
  if (kind === 'string') return word.slice(1, -1).replace(/\\(.)/g, '$1');
  if (kind === 'bool') return word === 'true';
  const value = kind === 'enum' && enumerators.has(word) ? enumerators.get(word) : Number(word.replace(/^nan$/, 'NaN'));
  return kind === 'float' ? Math.fround(value) : value;
}
function messageOf(fields, schema) {
  const message = {};
  for (const [name, value] of fields) {
    const [, kind, repeated] = schema[name];
    const one = typeof kind === 'string' ? valueOf(value, kind) : messageOf(value, kind);
    if (repeated) (message[name] ??= []).push(one);
    else message[name] = one;
  }
  return message;
}
/** What is told, with all that is not at its default. */
const whole = (message, schema) => page.decodeMessage(schema, page.encodeMessage(schema, message));
const kept = fs.readdirSync(path.join(root, 'tests/conformance/vectors')).filter((name) => name.startsWith('control_'));
let [sent, received] = [0, 0];
for (const file of kept) {
  for (const line of read(`tests/conformance/vectors/${file}`).split('\n').filter(Boolean)) {
    const [, side, hex, text] = /^(\w+) ([0-9a-f]+) (.*)$/.exec(line);
    const bytes = Uint8Array.from(Buffer.from(hex, 'hex'));
    const kind = readText(text)[0][0];
    if (side === 'client' && NOT_SENT.has(`ClientMessage.${kind}`)) continue;
    const schema = side === 'client' ? page.schemas.ClientMessage : page.schemas.ServerMessage;
    check(`${file}: ${text.slice(0, 60)}`, () => {
      const message = messageOf(readText(text), schema);
      const decoded = page.decodeMessage(schema, bytes.subarray(1));
      if (side === 'client') {
        ++sent;
        assert.equal(Buffer.from(page.encodeClientMessage(message)).toString('hex'), hex);
      } else {
        ++received;
        assert.deepEqual(decoded, whole(message, schema));
        // Cut off anywhere it is refused, or it ends between two fields: never more.
        for (let size = 0; size < bytes.length; ++size)
          try {
            page.decodeServerMessage(bytes.subarray(0, size));
          } catch (error) {
            assert.match(error.message, /message|field|number|encoded|UTF-8/i);
          }
      }
    });
  }
}
check('kept messages', () => assert.ok(sent >= 10 && received >= 8, `${sent} sent, ${received} received`));

// proto/WIRE.md, section 4.
check('media header', () => {
  const bytes = Uint8Array.from(Buffer.from('21000102030405060708090a030000001011121314151617feffffffffffffff010203', 'hex'));
  const header = page.readFrameHeader(bytes);
  assert.equal(header.opcode, 0x21);
  assert.equal(header.streamId, 0x0201);
  assert.equal(header.sequence, 0x06050403);
  assert.equal(header.baseSequence, 0x0a090807);
  assert.equal(header.simTimeNs, 0x1716151413121110);
  assert.equal(header.sendTimeNs, -2);
  assert.throws(() => page.readFrameHeader(bytes.subarray(0, 34)));
});
check('state hash of every kept frame, exact ones too', () => {
  let exact = 0;
  const folder = 'tests/conformance/vectors';
  for (const file of fs.readdirSync(path.join(root, folder)).filter((name) => name.startsWith('strands_step_12_')))
    for (const [, hash, hex] of read(`${folder}/${file}`).matchAll(/^step \w+ (\w+) (\w+)/gm)) {
      if (hex.startsWith('8', 2 * page.kFrameHeaderBytes)) ++exact;
      assert.equal(page.readStateHash(Uint8Array.from(Buffer.from(hex, 'hex'))).toString(16).padStart(16, '0'), hash, file);
    }
  assert.ok(exact >= 3, `${exact} exact frames`);
});

// ---- copies of what C++ has

const ranges = new Map();
for (const [, name, low, high, unit] of read('common/scene/scene_fields.h').matchAll(/Range (k\w+)\{([^,]+), ([^,]+), "([^"]*)"\}/g))
  ranges.set(name, [Number(low), Number(high), unit]);
const fields = [...page.lookSections, ...page.simulationSections].flatMap((section) => section.fields);
for (const field of fields.filter(({ range }) => range))
  check(field.path, () => {
    assert.deepEqual([field.minimum, field.maximum, field.unit], ranges.get(field.range));
    const name = field.path.split('.').pop();
    // What the visitor of scene fields calls by this range, alone or as a vector.
    const calls = [...read('common/scene/scene_fields.h').matchAll(/v\.\w+\("(\w+)", [^;]*?(k\w+)\)/g)];
    const own = calls.filter(([, called]) => called === name || field.path.split('.').includes(called));
    assert.ok(own.some(([, , range]) => range === field.range), `no field has ${field.range}`);
  });

// Made of scene.proto: as the slider of a viewer's field list has it.
check('ranges of the look', () => {
  const visited = read('common/scene/scene_fields.h');
  const own = fields.filter(({ range }) => !range);
  assert.ok(own.length >= 30 && own.every(({ path }) => path.startsWith('look.')), `${own.length} fields`);
  for (const { path, minimum, maximum, unit } of own) {
    const [, low, high, said] = new RegExp(`v\\.number\\("${path.split('.').pop()}", [\\w.]+, Range\\{([^,]+), ([^,]+), "([^"]*)"\\}\\)`).exec(visited) ?? [];
    assert.deepEqual([minimum, maximum, unit], [Number(low), Number(high), said], path);
  }
});

check('hair colours', () => {
  const srgb = (linear) => Math.round(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055));
  const hex = (numbers) => `#${numbers.split(',').map((n) => srgb(parseFloat(n)).toString(16).padStart(2, '0')).join('')}`;
  const presets = [...read('common/scene/hair_color.cpp').matchAll(/\{"(\w+)", \{\{([^}]*)\}, \{([^}]*)\}\}\}/g)];
  assert.deepEqual(page.hairColors, presets.map(([, name, rootColor, tip]) => [name, hex(rootColor), hex(tip)]));
});

check('numbers of a look', () => {
  const header = read('client/web/strand_picture.h');
  const inside = header.slice(header.indexOf('struct StrandPictureLook'), header.indexOf('static_assert')).replace(/\/\/.*$/gm, '');
  const places = [...inside.matchAll(/(\w+)(\[3\])?(?=[,;])/g)].flatMap(([, name, isVector]) => (isVector ? [name, name, name] : [name]));
  // Each number another one: what comes out says where it came from.
  let next = 0;
  const values = new Map();
  const fill = (schema) => Object.fromEntries(Object.entries(schema).filter(([, [, kind]]) => kind !== 'string').map(([name, [, kind]]) => {
    if (typeof kind !== 'string') {
      const inner = fill(kind);
      const parts = kind.x || kind.r ? Object.values(inner) : undefined;
      if (parts) values.set(name, parts);
      else for (const [part, value] of Object.entries(inner)) values.set(`${name}_${part}`, [value]);
      return [name, inner];
    }
    if (!/^[xyzrgb]$/.test(name)) values.set(name, [next + 1]);
    return [name, ++next];
  }));
  const look = { ...fill(page.schemas.Look), hair_color: 'red' };
  const expected = [...new Set(places)].flatMap((name) => values.get(name) ?? assert.fail(`no look has ${name}`));
  assert.deepEqual([...page.lookNumbers(look)], expected);
});

// ---- behaviour

check('a token leaves the address', () => {
  const wishes = page.readFragment('#token=s%2Be%20cret&mode=strands&view=0.2,0.1,0.6,0,-0.05,0,0.6');
  assert.equal(wishes.token, 's+e cret');
  assert.equal(wishes.mode, 0);
  assert.deepEqual(wishes.camera.offset, [0.2, 0.1, 0.6]);
  assert.equal(wishes.keepsToken, false);
  assert.equal(page.readFragment('#token=a&keep-token').keepsToken, true);
  const rest = page.withoutToken('#token=secret&mode=strands&view-only');
  assert.equal(rest, '#mode=strands&view-only');
  const link = page.linkTo('http://h:1/', wishes.camera, 0);
  assert.equal(page.readFragment(new URL(page.linkTo('http://h:1/', wishes.camera, 2, 'b & c')).hash).head, 'b & c');
  assert.deepEqual(page.readFragment(new URL(link).hash).camera, wishes.camera);
  assert.ok(!link.includes('token'));
  assert.equal(page.readFragment('#view=0,0,0,0,0,0,1').camera, undefined);
  assert.equal(page.readFragment('#head=Zo%C3%AB&mode=strands').head, 'Zoë');
  assert.equal(page.readFragment('#mode=strands').head, '');
  assert.deepEqual(page.readFragment('#size=9x99999').size, { width: 16, height: 2160 });
});

check('the camera turns about its target', () => {
  const camera = { offset: [0.22, 0.07, 0.62], target: [0, -0.05, 0], fov: 0.61 };
  const distance = Math.hypot(...camera.offset);
  let turned = camera;
  for (let i = 0; i < 20; ++i) turned = page.orbit(turned, 0.11, 0.2);
  assert.ok(Math.abs(Math.hypot(...turned.offset) - distance) < 1e-9);
  assert.ok(Math.asin(turned.offset[1] / distance) <= 1.5 + 1e-9);
  assert.deepEqual(turned.target, camera.target);
  const back = page.orbit(page.orbit(camera, 0.1, 0.05), -0.1, -0.05);
  back.offset.forEach((at, i) => assert.ok(Math.abs(at - camera.offset[i]) < 1e-9));
  // Half a circle over the window's height.
  const half = page.orbit(camera, 1, 0).offset;
  assert.ok(Math.abs(half[0] + camera.offset[0]) < 1e-4 && Math.abs(half[2] + camera.offset[2]) < 1e-4);
  const near = page.zoom(camera, 1000);
  assert.ok(Math.abs(Math.hypot(...near.offset) - 0.12) < 1e-9);
  const moved = page.pan(camera, 0.1, 0);
  const step = moved.target.map((at, i) => at - camera.target[i]);
  assert.ok(Math.abs(step[0] * camera.offset[0] + step[1] * camera.offset[1] + step[2] * camera.offset[2]) < 1e-9);
});

check('reconnections wait longer and longer', () => {
  const policy = new page.ReconnectPolicy(() => 0.5);
  const waits = Array.from({ length: 62 }, () => policy.nextDelayMs(0));
  assert.deepEqual(waits, [250, ...Array(59).fill(500), 5000, 5000]);
  assert.equal(policy.nextDelayMs(20_000), 250);
  // proto/WIRE.md, section 9.
  for (const code of [1001, 1002, 1006, 1007, 1008, 1009, 1011, 1013, 4000, 4003]) assert.ok(page.mayComeBack(code, false), String(code));
  for (const code of [4001, 4002, 4004]) assert.ok(!page.mayComeBack(code, true), String(code));
  // What has never been there is a typing error.
  assert.ok(page.mayComeBack(4005, true) && !page.mayComeBack(4005, false));
});

check('a Hello that every server refuses is never sent', () => {
  const asked = { token: 'a'.repeat(256), head: 'h'.repeat(64), codec: '', name: 'n' };
  assert.equal(page.faultOf(asked), '');
  assert.equal(page.faultOf({ ...asked, token: 'a'.repeat(257) }), 'the token is longer than 256 bytes');
  assert.equal(page.faultOf({ ...asked, token: '\u00e4'.repeat(129) }), 'the token is longer than 256 bytes');
  assert.equal(page.faultOf({ ...asked, head: 'h'.repeat(65) }), 'the head is longer than 64 bytes');
});

check('a dead link is left at once, without the closing handshake', () => {
  const asked = [];
  const port = { postMessage: (wish) => asked.push(wish) };
  const socket = new page.DistantSocket(port, 'ws://hair', 'strandcast.v1');
  const ends = [];
  socket.onclose = (code, reason) => ends.push([code, reason]);
  const tell = (message) => port.onmessage({ data: { number: asked[0].number, ...message } });
  tell({ kind: 'open' });
  socket.drop(4000, 'nothing came');
  assert.deepEqual(ends, [[4000, 'nothing came']]);
  assert.equal(asked.at(-1).kind, 'close');
  // A minute later, when another connection is there.
  tell({ kind: 'message', data: new ArrayBuffer(1), receivedNs: 0 });
  tell({ kind: 'closed', code: 1006, reason: '' });
  assert.equal(ends.length, 1);
  assert.ok(!socket.isOpen);
});

check('two sockets beside each other hear each their own', () => {
  const made = [];
  globalThis.WebSocket = class {
    static OPEN = 1;
    readyState = 1;
    sent = [];
    constructor() { made.push(this); }
    send(bytes) { this.sent.push(bytes.length); }
    close() { this.readyState = 2; }
  };
  globalThis.self = {};
  page.runSocket();
  const [near, far] = [{}, {}]; // what each end posts the other one hears
  near.postMessage = (data) => far.onmessage({ data });
  far.postMessage = (data) => near.onmessage({ data });
  self.onmessage({ data: { port: far } });
  const heard = [];
  const sockets = ['silent', 'new'].map((name) => {
    const socket = new page.DistantSocket(near, 'ws://hair', 'strandcast.v1');
    Object.assign(socket, { onmessage: (data) => heard.push([name, data]), onclose: (code) => heard.push([name, code]) });
    return socket;
  });
  for (const socket of made) socket.onopen();
  sockets[1].send(new Uint8Array(3));
  sockets[0].drop(1000, '');
  made[0].onmessage({ data: 'late' });
  made[1].onmessage({ data: 'a' });
  made[0].onclose({ code: 1006, reason: '' });
  sockets[1].send(new Uint8Array(2));
  made[1].onclose({ code: 1001, reason: '' });
  assert.deepEqual(heard, [['silent', 1000], ['new', 'a'], ['new', 1001]]);
  assert.deepEqual(made.map(({ sent }) => sent), [[], [3, 2]]);
});

check('a silent connection that is soon left again is given longer', () => {
  const policy = new page.ReconnectPolicy();
  const waits = [5_000, 5_000, 20_000].map((livedMs) => (policy.replace(livedMs), policy.doubtMs));
  assert.deepEqual(waits, [2, 4, 1].map((times) => times * page.DOUBTED_MS));
});

check('timecode is counted as the server counts it', () => {
  const text = (numerator, denominator, is_drop, frame) => page.timecodeText({ rate_numerator: numerator, rate_denominator: denominator, is_drop, frame });
  assert.equal(text(24000, 1001, false, 89356), '01:02:03:04');
  assert.equal(text(30000, 1001, true, 1799), '00:00:59;29');
  assert.equal(text(30000, 1001, true, 1800), '00:01:00;02');
  assert.equal(text(30000, 1001, true, 17982), '00:10:00;00');
  assert.equal(text(60000, 1001, true, 3600), '00:01:00;04');
  assert.equal(text(25, 1, false, 2159999), '23:59:59:24');
});

check('the clock believes the shortest round trip', () => {
  const clock = new page.ClockOffset();
  clock.add(1000, 501_500, 501_500, 2000);
  clock.add(5000, 505_900, 505_900, 6000 + 1_000_000);
  assert.equal(clock.toServerNs(0), 500_000);
  clock.add(9000, 1, 0, 10_000); // ran backwards
  assert.equal(clock.toServerNs(0), 500_000);
  assert.equal(clock.roundTripMs, 1000e-6);
});

check('scenes in words', () => {
  const text = 'name: "a { b: 3" wind { mean_mps { x: 1.5 y: -2e-1 z: 0 } } solver { name: "dftl" parameters { key: "gain" value: 0.25 } parameters { key: "rounds" value: 4 } } gravity_mps2 { y: -9.81 }';
  const numbers = page.readScene(text);
  assert.equal(numbers.get('wind.mean_mps.y'), -0.2);
  assert.equal(numbers.get('gravity_mps2.y'), -9.81);
  assert.equal(numbers.get('b'), undefined);
  assert.deepEqual([...page.solverParameters(text)], [['gain', 0.25], ['rounds', 4]]);
});

check('tiles', () => {
  const [, hex] = /^tiles(?: \d+)+ ([0-9a-f]+)/m.exec(read('tests/conformance/vectors/tiles.txt'));
  const bytes = Uint8Array.from(Buffer.from(hex, 'hex'));
  const { width, height, tiles } = page.parseTiles(bytes);
  assert.deepEqual([width, height], [70, 130]);
  assert.equal(tiles.length, 6);
  for (let size = 0; size < bytes.length; size += 7) assert.throws(() => page.parseTiles(bytes.subarray(0, size)));
  const alike = tiles.filter((tile) => tile.chroma === tiles[0].chroma && tile.quality === tiles[0].quality);
  const jpeg = page.jpegOfScans(alike);
  // Each scan as it was, with a restart marker behind it, the last one with the picture's end.
  let at = jpeg.length;
  for (let i = alike.length - 1; i >= 0; --i) {
    assert.deepEqual([...jpeg.subarray(at - 2, at)], [0xff, i + 1 === alike.length ? 0xd9 : 0xd0 + (i % 8)]);
    at -= 2 + alike[i].scan.length;
    assert.deepEqual(jpeg.subarray(at, at + alike[i].scan.length), alike[i].scan);
  }
  // Tables of Huffman codes hold as many values as they say, K.3 to K.6: 12, 162, 12, 162.
  const huffman = Buffer.from(jpeg).indexOf(Buffer.from([0xff, 0xc4]));
  assert.equal(jpeg[huffman + 2] * 256 + jpeg[huffman + 3], 2 + 4 * 17 + 2 * (12 + 162));
  let table = huffman + 4;
  for (const values of [12, 162, 12, 162]) {
    const sum = jpeg.subarray(table + 1, table + 17).reduce((a, b) => a + b, 0);
    assert.equal(sum, values);
    assert.equal(new Set(jpeg.subarray(table + 17, table + 17 + sum)).size, values);
    table += 17 + sum;
  }
});

check('colours of tiles', () => {
  // ITU-T T.871, 7; rounding twice may be one level away.
  const [luma, blue, red] = [(x, y) => (7 * x + 3 * y) & 255, (x, y) => (40 + 11 * x + 5 * y) & 255, (x, y) => (200 + 3 * x + 13 * y) & 255];
  for (const isHalved of [false, true]) {
    const side = isHalved ? 32 : 64;
    const chroma = side * 2 * side; // two tiles
    const data = new Uint8Array(2 * 64 * 64 + 2 * chroma);
    for (let y = 0; y < 128; ++y) for (let x = 0; x < 64; ++x) data[64 * y + x] = luma(x, y);
    for (let y = 0; y < 2 * side; ++y) for (let x = 0; x < side; ++x) {
      data[8192 + side * y + x] = blue(x, y);
      data[8192 + chroma + side * y + x] = red(x, y);
    }
    const places = [{ offset: 0, stride: 64 }, { offset: 8192, stride: side }, { offset: 8192 + chroma, stride: side }];
    const out = new Uint32Array(64 * 64);
    page.rgbaOfTile({ data, places, isHalved }, 1, out);
    const bytes = new Uint8Array(out.buffer);
    for (let y = 0; y < 64; ++y) for (let x = 0; x < 64; ++x) {
      const at = isHalved ? [x >> 1, (64 + y) >> 1] : [x, 64 + y];
      const [light, cb, cr] = [luma(x, 64 + y), blue(...at) - 128, red(...at) - 128];
      const expected = [light + 1.402 * cr, light - 0.344136 * cb - 0.714136 * cr, light + 1.772 * cb, 255];
      expected.forEach((value, c) => assert.ok(Math.abs(Math.min(Math.max(value, 0), 255) - bytes[4 * (64 * y + x) + c]) <= 1, `${x} ${y} ${c}`));
    }
  }
});

check('shaders', () => {
  const text = page.shaderText('#include "render/tile_frame.glsl"\n#include "lib/hash.glsl"\nvoid main() {}\n');
  assert.ok(text.startsWith('#version 300 es\n'));
  assert.equal(text.split('uint mix_u32(').length, 2, 'a file enters once');
  assert.ok(!/^\s*#(include "|pragma)|binding =/m.test(text));
  assert.throws(() => page.shaderText('#include "lib/none.glsl"'));
});

/** 100 frames, 10 ms apart, a keyframe at every tenth; looks before frames 0 and 55. */
function tapeBytes() {
  const [KEYFRAME, DELTA] = [0x20, 0x21];
  const parts = [Buffer.from(Uint32Array.of(1).buffer)];
  const add = (timeMs, ...bytes) => parts.push(Buffer.from(Uint32Array.of(timeMs, bytes.length).buffer), Buffer.from(bytes));
  add(0, 1, 99);
  for (let i = 0; i < 100; ++i) {
    if (i === 0 || i === 55) add(10 * i, 1, 200 + i);
    add(10 * i, i % 10 ? DELTA : KEYFRAME, i);
  }
  return Uint8Array.from(Buffer.concat(parts)).buffer;
}
/** That tape, paused, and all is decoded at once. */
function playedTape() {
  const tape = new page.Tape(tapeBytes());
  const seen = { frames: [], looks: [], place: undefined, marks: 0, tape };
  tape.hearAndDecode = (wish) => {
    Object.assign(seen, { frames: [], looks: [] });
    tape.hear(wish);
    while (seen.marks > 0) {
      --seen.marks;
      tape.passed();
    }
  };
  tape.begin({
    give: (message) => {
      const [kind, number] = new Uint8Array(message);
      if (kind !== 1) seen.frames.push(number);
      else if (number >= 200) seen.looks.push(number - 200);
    },
    mark: () => ++seen.marks, tell: (place) => (seen.place = place),
  });
  tape.hearAndDecode({ kind: 'command', command: page.Command.pause });
  return seen;
}
const seek = (timeMs) => ({ kind: 'seek', timeMs });
const range = (from, to) => Array.from({ length: to - from + 1 }, (_, i) => from + i);

check('a tape goes anywhere by the keyframe before, and on from where it is', () => {
  const seen = playedTape();
  const goes = (timeMs, frames, looks) => {
    seen.tape.hearAndDecode(seek(timeMs));
    assert.deepEqual([seen.frames, seen.looks, seen.place.timeMs], [frames, looks, 10 * frames[frames.length - 1]], `to ${timeMs}`);
  };
  goes(575, range(50, 57), [55]);
  goes(590, [58, 59], []);
  goes(542, range(50, 54), [0]);
  goes(0, [0], []);
  goes(5000, range(90, 99), [55]);
  seen.tape.hearAndDecode({ kind: 'command', command: page.Command.stepOnce });
  assert.deepEqual(seen.frames, [0], 'behind the end is the begin');
  seen.tape.end();
});
check('a tape hears no more frames than are decoded, and the newest wish counts', () => {
  const seen = playedTape();
  seen.tape.hear(seek(990));
  assert.equal(seen.marks, 1);
  const first = seen.frames.length;
  seen.tape.hear(seek(330));
  seen.tape.hear(seek(115));
  assert.equal(seen.frames.length, first, 'what was given is not decoded yet');
  --seen.marks;
  seen.tape.passed();
  assert.deepEqual(seen.frames.slice(first), [10, 11]);
  seen.tape.end();
});
/** What a tape says of its pace to who decodes a frame in so many ms, on a clock of the test's own. */
function paceSaid(decodeMs) {
  const { setTimeout: later, setInterval: often } = globalThis;
  const now = performance.now;
  let [ms, due, status, said, given, freeAt] = [0, Infinity, undefined, '', 0, Infinity];
  let work;
  try {
    globalThis.setTimeout = (run, wait) => ((work = run), (due = ms + wait), 1);
    globalThis.setInterval = (run) => ((status = run), 1);
    performance.now = () => ms;
    const tape = new page.Tape(tapeBytes());
    tape.begin({
      give: (message) => {
        if (new Uint8Array(message)[0] !== 1) ++given;
        else if (message.byteLength > 2) said = page.decodeServerMessage(new Uint8Array(message)).status?.slow_motion ?? said;
      },
      mark: () => ([freeAt, given] = [ms + given * decodeMs, 0]), tell: () => {},
    });
    for (let next = 500; ms < 10_000; ) {
      ms = Math.min(due, freeAt, next);
      if (ms === next) (next += 500), status();
      if (ms === freeAt) (freeAt = Infinity), tape.passed();
      if (ms === due) (due = Infinity), work();
    }
    return said;
  } finally {
    Object.assign(globalThis, { setTimeout: later, setInterval: often });
    performance.now = now;
  }
}
check('a tape is slow motion for who decodes more slowly than it plays, and says so', () => {
  assert.equal(paceSaid(5), '');
  const pace = Number(/simulates (0\.\d+) of real time/.exec(paceSaid(20))?.[1]);
  assert.ok(Math.abs(pace - 0.5) < 0.05, `frames 10 ms apart, decoded in 20 ms: ${pace}`);
});

// ---- a session, over sockets of the test's own

const asked = { url: 'ws://nowhere', token: '', mode: page.Mode.strands, role: page.Role.viewer, codec: '', head: '', pictures: '', width: 64, height: 64, drawsStrands: true };
const sockets = [];
const states = [];
const net = new page.Net({
  post: (message) => message.kind === 'state' && states.push(message.state), states: { onmessage: null, postMessage: () => {} }, loadCore: () => Promise.reject(new Error('none')),
  openSocket() {
    const socket = { isOpen: false, sent: 0, send: () => ++socket.sent, drop: () => (socket.isOpen = false) };
    sockets.push(socket);
    return socket;
  },
});
const open = async (socket) => {
  socket.isOpen = true;
  socket.onopen();
  await new Promise((done) => setTimeout(done));
};
net.start({ asked, stepCore: '', wholeCore: '' });
check('a socket opens while the module still comes', () => assert.equal(sockets.length, 1));
await open(sockets[0]);
check('a Hello waits for the module', () => assert.equal(sockets[0].sent, 0));
sockets[0].isOpen = false;
sockets[0].onclose(1008, 'No Hello within 5000 ms.');
check('a server that did not wait so long is asked again with the module', () => assert.deepEqual([sockets.length, states], [1, ['connecting']]));
net.withoutCore('this is a test');
await new Promise((done) => setTimeout(done));
await open(sockets.at(-1));
check('and then says what it wants', () => assert.deepEqual([sockets.length, sockets.at(-1).sent], [2, 1]));
net.end();

console.log(`${checks} checks of the page passed`);
