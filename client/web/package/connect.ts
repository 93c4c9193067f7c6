// connect() in a browser: the session in a worker of its own, or here where this is one.
import { compileCore } from '../page/core';
import type { FromNet, State } from '../page/messages';
import { UserConnection } from './connection';
import { headIn, openNear, type Session, type SessionPlan } from './near';
import type { connect as Connect, headOf as HeadOf, Options } from './strandcast';

/** Beside this script, where nobody says another place. */
export function filesOf(files: string | URL | undefined): URL {
  if (files === undefined) return new URL('.', import.meta.url);
  const folder = new URL(files, typeof document === 'undefined' ? import.meta.url : document.baseURI);
  if (!folder.pathname.endsWith('/')) folder.pathname += '/';
  return folder;
}

/** One of the package's workers. Another origin's script is not let in as one, but may be imported by one. */
export function startWorker(files: URL, file: string, name: string): Worker {
  const script = new URL(file, files).href;
  if (new URL(script).origin === location.origin) return new Worker(script, { type: 'module', name });
  const url = URL.createObjectURL(new Blob([`import ${JSON.stringify(script)};`], { type: 'text/javascript' }));
  const worker = new Worker(url, { type: 'module', name });
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
  return worker;
}

function openFar(plan: SessionPlan, files: URL): Session {
  const net = startWorker(files, 'worker.js', 'net');
  const socket = startWorker(files, 'worker.js', 'socket');
  const states = new MessageChannel();
  const port = plan.states ?? states.port1;
  const sockets = new MessageChannel();
  const fail = (reason: string): void => plan.tell({ kind: 'state', state: 'ended', reason, retryMs: 0 });
  net.onmessage = ({ data }: MessageEvent<FromNet>) => plan.tell(data);
  net.onerror = socket.onerror = () => fail('the package’s worker does not start: option `files` says where it lies');
  states.port2.onmessage = ({ data }: MessageEvent<State>) => plan.give(data);
  socket.postMessage({ port: sockets.port2 }, [sockets.port2]);
  net.postMessage({
    kind: 'start', stepCore: '', wholeCore: plan.whole, asked: plan.asked, states: port, sockets: sockets.port1,
  }, [port, sockets.port1]);
  compileCore(plan.step).then((core) => net.postMessage({ kind: 'core', core }), (error: Error) => fail(error.message));
  return {
    send: (message) => net.postMessage(message),
    ask: () => states.port2.postMessage('next'),
    end: () => {
      net.terminate();
      socket.terminate();
      states.port2.close();
    },
  };
}

/** States go to what draws them, and not through the page. */
export function connectDrawer(url: string, options: Options, states: MessagePort): UserConnection {
  const files = filesOf(options.files);
  return new UserConnection(url, options, files, (plan) => openFar(plan, files), states);
}

export const connect: typeof Connect = (url, options = {}) => {
  const files = filesOf(options.files);
  const isFar = options.worker ?? typeof document !== 'undefined';
  const Socket = (options.WebSocket ?? globalThis.WebSocket) as typeof WebSocket;
  return new UserConnection(url, options, files, (plan) => (isFar ? openFar(plan, files) : openNear(plan, Socket)));
};

export const headOf: typeof HeadOf = async (asset, { files } = {}) => headIn(asset, await compileCore(new URL('strand_page.wasm', filesOf(files)).href));
