// The page: starts the worker that has the connection, and shows what it says.
const assets: { worker: string } = JSON.parse(
  document.querySelector<HTMLMetaElement>('meta[name="strandcast-assets"]')!.content);

const worker = new Worker(assets.worker, { type: 'module' });
worker.onmessage = (event: MessageEvent<{ mode: string; text: string }>) => {
  document.getElementById('state')!.textContent = event.data.text;
  document.documentElement.dataset.strandcast = JSON.stringify({ mode: event.data.mode });
};
worker.postMessage({ url: location.origin.replace(/^http/, 'ws') + '/v1' });
