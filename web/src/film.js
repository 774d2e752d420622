// SPDX-License-Identifier: Apache-2.0
/**
 * Pictures of frames, for a program that drives the page: PAGE.html#picture shows the view alone, draws nothing by itself, and
 * window.palpate.picture(i) shows frame i as fine as there is. Nothing in it depends on the clock of this machine.
 */
import {kViews} from './keys.js';
import {feltOf, listed} from './words.js';

const nextPicture = () => new Promise(done => requestAnimationFrame(done));

/** What the address asks for; undefined: a page as usual. */
export function wantedPicture() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  if (!wanted.has('picture')) return undefined;
  document.body.dataset.picture = ''; // before anything is measured
  return {from: kViews.find(view => view.letter === wanted.get('from'))?.from};
}

/** Lets a page that draws nothing by itself draw what is asked for. */
export function pose(app, {from}) {
  const caption = document.createElement('div'), words = document.createElement('p');
  caption.className = 'caption corner';
  caption.append(words, document.getElementById('legend'));
  app.view.host.append(caption);
  if (from) app.view.lookFrom(from);
  app.picture = async index => {
    app.seek(index);
    const {columns} = app.frames, i = app.player.index;
    const touched = listed(feltOf(app.scene, columns.felt[i]).map(structure => structure.name)) || 'nothing';
    words.textContent = `${columns.time_s[i].toFixed(3)} s, frame ${columns.index[i]}, touching ${touched}`;
    app.showFrame();
    app.view.drawFinest();
    app.overlay.place();
    await nextPicture(); // drawn with the words
    await nextPicture(); // and on the screen
    return i;
  };
}
