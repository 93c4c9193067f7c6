// Of Node and browsers what the package uses: the compiler's own declarations do not have it.
declare module 'node:fs/promises' {
  export function readFile(file: URL): Promise<Uint8Array>;
}
