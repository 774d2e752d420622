// SPDX-License-Identifier: Apache-2.0
// What the page takes for a running loop: the page and the socket under a token, the scene first, commands kept.
import {createServer} from 'node:http';
import {require} from './browser.mjs';
import {container, framesOf, sphereScene} from './container.mjs';

export class FakeServer {
  /** @param {string} page @param {any} changes of the scene */
  constructor(page, changes) {
    this.commands = [];
    this.scene = sphereScene('live', changes);
    this.http = createServer((request, answer) => {
      const isPage = request.url === '/token/';
      answer.writeHead(isPage ? 200 : request.url === '/favicon.ico' ? 204 : 404, {'Content-Type': 'text/html; charset=utf-8'});
      answer.end(isPage ? page : '');
    });
    const {WebSocketServer} = require('ws');
    this.sockets = new WebSocketServer({server: this.http, path: '/token/socket'});
    this.sockets.on('connection', socket => {
      this.socket = socket;
      this.connections = (this.connections ?? 0) + 1;
      socket.on('message', data => this.commands.push(JSON.parse(data)));
      socket.send(this.scene);
    });
  }

  async listen() {
    await new Promise(done => this.http.listen(0, '127.0.0.1', done));
    return `http://127.0.0.1:${this.http.address().port}/token/`;
  }

  send(data) {
    this.socket.send(data);
  }

  sendFrames(first, count, lost) {
    const {frames, arrays} = framesOf(first, count, lost);
    this.send(container({kind: 'frames', frames}, arrays));
  }

  /** Commands of a kind so far, and forgets all. */
  take(kind) {
    const found = this.commands.filter(command => command.do === kind);
    this.commands = [];
    return found;
  }

  /** Waits for a command of a kind, and forgets it and those before it. */
  async next(kind) {
    for (let tries = 0; tries < 6000; ++tries) {
      const at = this.commands.findIndex(command => command.do === kind);
      if (at >= 0) return this.commands.splice(0, at + 1).at(-1);
      await new Promise(done => setTimeout(done, 20));
    }
    throw new Error(`no command "${kind}" within 120 s, only ${JSON.stringify(this.commands)}`);
  }

  close() {
    this.sockets.clients.forEach(socket => socket.terminate());
    this.sockets.close();
    this.http.close();
  }
}
