// Loads strand_core.wasm (client/web/strand_core.h) in a browser or in Node: the module or its bytes ->
// its functions. All that it asks of its surroundings is answered here: it has no files and no arguments, and what
// it prints is a broken invariant before it stops.

/** As fmt prints it: {} of a float or a double, or so many digits as {:.3g} does. */
export function numberText(value, isFloat, digits) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? 'nan' : value < 0 ? '-inf' : 'inf';
  let wanted = digits || 1;
  const isTold = () => digits || (isFloat ? Math.fround(Number(value.toPrecision(wanted))) : Number(value.toPrecision(wanted))) === value;
  while (!isTold()) ++wanted;
  const [, sign, first, others, power] = /^(-?)(\d)\.?(\d*)e(.*)$/.exec(value.toExponential(wanted - 1));
  const minus = sign || (Object.is(value, -0) ? '-' : '');
  const rest = others.replace(/0+$/, '');
  const exponent = Number(power);
  if (exponent < -4 || exponent >= (digits || 16)) {
    const size = String(Math.abs(exponent)).padStart(2, '0');
    return `${minus}${first}${rest && `.${rest}`}e${exponent < 0 ? '-' : '+'}${size}`;
  }
  if (exponent < 0) return `${minus}0.${'0'.repeat(-exponent - 1)}${first}${rest}`;
  const whole = (first + rest).padEnd(exponent + 1, '0');
  return `${minus}${whole.slice(0, exponent + 1)}${whole.length > exponent + 1 ? `.${whole.slice(exponent + 1)}` : ''}`;
}

export async function loadStrandCore(module, print = console.error) {
  let memory;
  const view = () => new DataView(memory.buffer);
  const write = (file, parts, count, writtenAt) => {
    let written = 0;
    for (let i = 0; i < count; ++i) {
      const at = view().getUint32(parts + 8 * i, true);
      const size = view().getUint32(parts + 8 * i + 4, true);
      print(new TextDecoder().decode(new Uint8Array(memory.buffer, at, size)));
      written += size;
    }
    view().setUint32(writtenAt, written, true);
    return 0;
  };
  const nothing = (countAt, sizeAt) => {
    view().setUint32(countAt, 0, true);
    view().setUint32(sizeAt, 0, true);
    return 0;
  };
  // Its arguments before the last are a clock and a precision, of 64 bits in one part or two.
  const now = (...parts) => {
    view().setBigUint64(parts[parts.length - 1], BigInt(Math.round(performance.now() * 1e6)), true);
    return 0;
  };
  // For errors (client/web/fmt/format.h).
  const writeNumber = (value, isFloat, digits, at) =>
    new TextEncoder().encodeInto(numberText(value, isFloat, digits), new Uint8Array(memory.buffer, at, 32)).written;
  const stop = (code) => {
    throw new Error(`strand core stopped with ${code}`);
  };
  const made = await WebAssembly.instantiate(module, {
    env: { emscripten_notify_memory_growth: () => {}, write_number: writeNumber },
    wasi_snapshot_preview1: {
      fd_write: write, fd_seek: () => 8, fd_close: () => 8, proc_exit: stop,
      environ_sizes_get: nothing, environ_get: () => 0, clock_time_get: now,
    },
  });
  const instance = made.instance ?? made;
  memory = instance.exports.memory;
  instance.exports._initialize();
  return instance.exports;
}
