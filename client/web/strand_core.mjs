// Loads strand_core.wasm (client/web/strand_core.h) in a browser or in Node: the module or its bytes ->
// its functions. All that it asks of its surroundings is answered here: it has no files and no arguments, and what
// it prints is a broken invariant before it stops.
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
  const stop = (code) => {
    throw new Error(`strand core stopped with ${code}`);
  };
  const made = await WebAssembly.instantiate(module, {
    env: { emscripten_notify_memory_growth: () => {} },
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
