// Types of strand_core.mjs for the page.
export function loadStrandCore(module: BufferSource | WebAssembly.Module, print?: (text: string) => void): Promise<unknown>;
