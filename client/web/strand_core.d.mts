// Types of strand_core.mjs for the page.
export function loadStrandCore(bytes: BufferSource, print?: (text: string) => void): Promise<unknown>;
