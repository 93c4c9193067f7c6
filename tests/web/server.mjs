// A server for tests: its port, its log, and its end.
//   const server = await Server.start('build/ci/bin/strandcast-server', ['--set', '...']); server.url; await server.end();
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import net from 'node:net';
import os from 'node:os';
import path from 'node:path';

const sleep = (ms) => new Promise((done) => setTimeout(done, ms));
/** Few short strands: a server that simulates and draws them takes little beside a browser. */
export const HAIR = { strands: 150, vertices: 12 };
export const SMALL = ['--set', `groom.procedural.strand_count=${HAIR.strands}`, '--set', `groom.procedural.vertex_count=${HAIR.vertices}`];

export class Server {
  static async start(program, options = [], port = 0) {
    const server = new Server();
    server.log = '';
    const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-server-'));
    const portFile = path.join(work, 'port');
    server.child = spawn(program, ['--port', String(port), '--port-file', portFile, ...options], { stdio: ['ignore', 'ignore', 'pipe'] });
    server.child.stderr.setEncoding('utf8').on('data', (text) => (server.log += text));
    const isThere = () => fs.existsSync(portFile) && fs.readFileSync(portFile, 'utf8').trim();
    for (let i = 0; i < 600 && !isThere(); ++i) {
      if (server.child.exitCode !== null) throw new Error(server.log);
      await sleep(50);
    }
    if (!isThere()) {
      server.child.kill('SIGKILL');
      throw new Error(`the server did not start in time: ${server.log}`);
    }
    server.port = Number(fs.readFileSync(portFile, 'utf8'));
    fs.rmSync(work, { recursive: true, force: true });
    server.url = `http://127.0.0.1:${server.port}/`;
    return server;
  }
  async end() {
    if (this.child.exitCode !== null || this.child.signalCode !== null) return;
    this.child.kill('SIGTERM');
    await new Promise((done) => this.child.once('exit', done));
  }
}

/** A relay before a server, whose connections fall silent and speak again. */
export class Link {
  static async start(server) {
    const link = new Link();
    link.connections = [];
    link.listener = net.createServer((near) => {
      const ends = [near, net.connect(server.port, '127.0.0.1')];
      for (const [i, end] of ends.entries()) end.on('error', () => {}).on('close', () => ends[1 - i].destroy()).pipe(ends[1 - i]);
      link.connections.push(ends);
      if (link.holdsNew) link.fallSilent(link.connections.length - 1);
    });
    await new Promise((done) => link.listener.listen(0, '127.0.0.1', done));
    link.url = `http://127.0.0.1:${link.listener.address().port}/`;
    return link;
  }
  /** From this one on: nothing passes any more. */
  fallSilent(first = 0) {
    for (const ends of this.connections.slice(first)) for (const end of ends) end.unpipe().pause();
  }
  speak(last) {
    for (const ends of this.connections.slice(0, last)) for (const [i, end] of ends.entries()) end.pipe(ends[1 - i]);
  }
  end() {
    for (const end of this.connections.flat()) end.destroy();
    this.listener.close();
  }
}
