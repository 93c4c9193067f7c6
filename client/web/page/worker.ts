// The worker: has the connection.
onmessage = (event: MessageEvent<{ url: string }>) => {
  const socket = new WebSocket(event.data.url, 'strandcast.v1');
  const tell = (mode: string, text: string) => postMessage({ mode, text });
  socket.onopen = () => tell('open', 'The server answers.');
  socket.onclose = (closed) => tell('closed', `The connection ended: ${closed.reason || closed.code}.`);
};
