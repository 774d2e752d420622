// SPDX-License-Identifier: Apache-2.0
/** Begins: with the data inside the page, or with the socket beside it. */
import {App} from './app.js';
import {DamagedData, readContainer} from './container.js';
import {pose, wantedPicture} from './film.js';
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

const kShown_ms = 8000; // of what one damaged message brought
let shownUntil; // a timer

/** Takes a message of the loop; a damaged one is said, and left out. */
function guarded(work) {
  try {
    work();
  } catch (error) {
    element('problem').textContent = `A message of the loop was left out. ${error.message}`;
    element('problem').hidden = false;
    clearTimeout(shownUntil); // the last one is shown as long as the first
    shownUntil = setTimeout(() => (element('problem').hidden = true), kShown_ms);
    if (!(error instanceof DamagedData)) console.warn(error);
  }
}

function startLive() {
  let app;
  const connection = new Connection(socketAddress(), {
    data: buffer => guarded(() => {
      const {json, blob} = readContainer(buffer);
      if (json.kind === 'scene') {
        if (app?.isSameScene(json)) return void app.beginAnew(json, blob);
        if (app) return void location.reload();
        try {
          app = new App(json, blob, command => connection.send(command));
        } catch (error) {
          return void complain(error); // without it nothing else is shown
        }
        window.palpate = app;
      } else if (json.kind === 'frames') app?.addFrames(json.frames, blob);
      else if (json.kind === 'mesh' && json.chosen) app?.explore?.take(json, blob);
      else if (json.kind === 'mesh') app?.addMeshes(json.structures, blob);
      else throw new DamagedData(`A message has the kind "${json.kind}".`);
    }),
    text: message => app ? app.hear(message) : (element('link').textContent = String(message.say ?? '')),
    goesOn: () => (app?.scene.choice ? '' : 'A force goes on without this page. '),
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
    const picture = wantedPicture();
    const app = new App(json, blob, undefined, {isPosed: picture !== undefined});
    if (picture) pose(app, picture);
    window.palpate = app;
  } catch (error) {
    complain(error);
  }
  return undefined;
}

start();
