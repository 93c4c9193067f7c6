// connect() in Node: on this thread, modules from files, and a WebSocket that is Node's own or handed in.
import { readFile } from 'node:fs/promises';
import { compileCore } from '../page/core';
import { UserConnection } from './connection';
import { headIn, openNear } from './near';
import type { connect as Connect, headOf as HeadOf } from './strandcast';

async function load(url: string): Promise<WebAssembly.Module> {
  return url.startsWith('file:') ? WebAssembly.compile(await readFile(new URL(url))) : compileCore(url);
}

const filesOf = (files?: string | URL): URL => (files === undefined ? new URL('.', import.meta.url) : new URL(files, import.meta.url));

export const connect: typeof Connect = (url, options = {}) => {
  const Socket = (options.WebSocket ?? globalThis.WebSocket) as typeof WebSocket | undefined;
  if (!Socket) throw new Error('this Node has no WebSocket: hand one in, as connect(url, { WebSocket })');
  const files = filesOf(options.files);
  return new UserConnection(url, options, files, (plan) => openNear(plan, Socket, load));
};

export const headOf: typeof HeadOf = async (asset, { files } = {}) => headIn(asset, await load(new URL('strand_page.wasm', filesOf(files)).href));
