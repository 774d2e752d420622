// SPDX-License-Identifier: Apache-2.0
/** Begins: with the data inside the page, or with the socket beside it. */
import {App} from './app.js';
import {DamagedData, readContainer} from './container.js';
import {Connection, embeddedData, socketAddress} from './source.js';

const element = id => document.getElementById(id);

/** What keeps the page from showing anything, in words. */
function complain(error) {
  const words = error instanceof DamagedData
    ? `This page cannot show its data. ${error.message} Ask for the file again, or write it anew.`
    : `This page cannot go on. ${error.message}`;
  element('problem').textContent = words;
  element('problem').hidden = false;
  if (!(error instanceof DamagedData)) console.warn(error);
}

/** Runs something, and says what went wrong where it did. */
function guarded(work) {
  try {
    return work();
  } catch (error) {
    complain(error);
    return undefined;
  }
}

function startLive() {
  let app;
  const connection = new Connection(socketAddress(), {
    data: buffer => guarded(() => {
      const {json, blob} = readContainer(buffer);
      if (json.kind === 'scene') {
        if (app?.isSameScene(json)) return app.beginAnew(json, blob);
        if (app) return location.reload();
        app = new App(json, blob, command => connection.send(command));
        window.palpate = app;
        return undefined;
      }
      if (json.kind === 'frames') return app?.addFrames(json.frames, blob);
      if (json.kind === 'mesh') return app?.addMeshes(json.structures, blob);
      throw new DamagedData(`A message has the kind "${json.kind}".`);
    }),
    text: message => app ? app.hear(message) : (element('link').textContent = String(message.say ?? '')),
    state: (words, isOpen) => {
      element('link').textContent = words;
      app?.setConnected(isOpen);
    },
  });
}

async function start() {
  try {
    const data = await embeddedData();
    if (!data && location.protocol !== 'file:') return startLive();
    if (!data) throw new DamagedData('There is no data inside this page.');
    const {json, blob} = readContainer(data);
    if (json.kind !== 'scene') throw new DamagedData(`It has the kind "${json.kind}", not "scene".`);
    window.palpate = new App(json, blob, undefined);
  } catch (error) {
    complain(error);
  }
  return undefined;
}

start();
