// connect() in Node: on this thread, modules from files, and a WebSocket that is Node's own or handed in.
import { readFile } from 'node:fs/promises';
import { compileCore } from '../page/core';
import { UserConnection } from './connection';
import { openNear } from './near';
import type { connect as Connect } from './strandcast';

async function load(url: string): Promise<WebAssembly.Module> {
  return url.startsWith('file:') ? WebAssembly.compile(await readFile(new URL(url))) : compileCore(url);
}

export const connect: typeof Connect = (url, options = {}) => {
  const Socket = (options.WebSocket ?? globalThis.WebSocket) as typeof WebSocket | undefined;
  if (!Socket) throw new Error('this Node has no WebSocket: hand one in, as connect(url, { WebSocket })');
  const files = options.files === undefined ? new URL('.', import.meta.url) : new URL(options.files, import.meta.url);
  return new UserConnection(url, options, files, (plan) => openNear(plan, Socket, load));
};
