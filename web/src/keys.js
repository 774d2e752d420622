// SPDX-License-Identifier: Apache-2.0
/** The keyboard: what each key does, and the list of them. */

const kTurns = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};

/** Views by digit: from which direction (scene axes of LPS). */
export const kViews = [
  {letter: 'A', from: [0, -1, 0], axis: 1, sign: -1}, {letter: 'P', from: [0, 1, 0], axis: 1, sign: 1},
  {letter: 'R', from: [-1, 0, 0], axis: 0, sign: -1}, {letter: 'L', from: [1, 0, 0], axis: 0, sign: 1},
  {letter: 'S', from: [0, 0, 1], axis: 2, sign: 1}, {letter: 'I', from: [0, 0, -1], axis: 2, sign: -1},
];

function actions(app) {
  const press = id => { // what is not there cannot be pressed
    const button = document.getElementById(id);
    if (!button.closest('[hidden]')) button.click();
  };
  const digits = Object.fromEntries(kViews.map((view, i) => [String(i + 1), () => app.view.lookFrom(view.from)]));
  return {
    ...digits, '0': () => press('center'), ' ': () => app.player.toggle(),
    ',': () => app.seekBy(-1), '.': () => app.seekBy(1), '<': () => app.seekBy(-100), '>': () => app.seekBy(100),
    'Home': () => app.seek(0), 'End': () => (app.isLive ? (app.player.playing = true) : app.seek(app.player.last)),
    '[': () => app.panels.slower(1), ']': () => app.panels.slower(-1),
    'n': () => press('step-forth'), 'b': () => press('step-back'), 'j': () => press('next-detail'), 'z': () => press('step-zoom'),
    '+': () => app.view.zoom(1 / 1.15), '=': () => app.view.zoom(1 / 1.15), '-': () => app.view.zoom(1.15),
    'h': () => press('hand'), 'f': () => press('freeze'),
    's': () => press('planes'),
    'm': () => document.getElementById('mark-name').focus(),
  };
}

/** The list that the page shows. */
export function keyList(app) {
  const live = [['H', 'hand: drag and wheel, or arrow keys and Page Up, Page Down, move the probe (Alt: finer)'],
                ['F', 'freeze'], ['P', "the device's button, for as long as the key is down"]];
  const view = [
    ['Drag, wheel', 'turn and zoom the view; right button: shift it'],
    ['Arrows, + −', 'turn and zoom, with the view focused'],
    ['1 to 6', `seen from ${kViews.map(one => one.letter).join(', ')}`],
  ];
  if (app.scene.choice) return view;
  return [
    ...view, ['0', 'centre on the proxy'],
    ['Space', app.isLive ? 'follow the newest frame, or hold' : 'play, stop'],
    [', and .', 'one frame back, on (with Shift: 100)'], ['[ and ]', 'slower, faster'],
    ['Home, End', app.isLive ? 'oldest, newest frame' : 'first, last frame'],
    ['B and N', 'one sub-step back, on, where the frame has them'], ['J', 'the next frame that has them'],
    ['Z', 'fill the view with them'], ['M', 'name a point'],
    ['S', 'slices as planes among the surfaces'],
    ...(app.send ? live : []),
  ];
}

export function bindKeys(app) {
  const table = actions(app);
  const isPress = event => event.key.toLowerCase() === 'p' && !event.ctrlKey && !event.metaKey && !isText(event.target);
  const isText = target => target.closest?.('input:not([type=range]):not([type=checkbox]), select, textarea');
  // Whatever has the focus by now, and whichever keys are down: it is up.
  document.addEventListener('keyup', event => event.key.toLowerCase() === 'p' && app.button?.release());
  document.addEventListener('keydown', event => {
    if (isPress(event) && app.button) return event.repeat ? undefined : app.button.press();
    if (event.ctrlKey || event.metaKey || isText(event.target)) return;
    const isView = event.target === app.view.canvas || event.target === document.body;
    if (isView && app.hand?.key(event)) return event.preventDefault();
    if (isView && kTurns[event.key]) {
      app.view.turn(...kTurns[event.key]);
      return event.preventDefault();
    }
    // A focused control keeps the keys that work it.
    const isOwn = event.target.closest?.('button, summary, input, a') && [' ', 'Home', 'End'].includes(event.key);
    const action = table[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || isOwn) return undefined;
    action();
    return event.preventDefault();
  });
}
