// SPDX-License-Identifier: Apache-2.0
// A page beside a loop: frames as they come, and each control's command.
import assert from 'node:assert/strict';
import {after, test} from 'node:test';
import {close, closeBrowser, openPage, output, pageText, shown} from './browser.mjs';
import {container, frame, framesOf, kCenter, kRadius, softFramesOf, sphere} from './container.mjs';
import {FakeServer} from './fake_server.mjs';

const fine = sphere(kCenter, kRadius, 22); // less than four times the facets, so that there is no level between
const coarse = sphere(kCenter, kRadius, 12);
const server = new FakeServer(pageText, {device: 'mouse', marks: [], details: undefined, structures: [
  {id: 0, name: 'bone', color: '#e3d4b0', material: 'hard', bit: 0, box_m: coarse.box_m,
   facets_most: fine.facets, levels: [{facets: coarse.facets, positions: 'coarse_p', indices: 'coarse_i'}]}]});
const address = await server.listen();
const page = await openPage(address);
await page.waitForFunction(() => window.palpate?.isConnected !== false && document.getElementById('link').textContent === 'connected');
after(async () => {
  await close(page);
  await closeBrowser();
  server.close();
});

server.send(JSON.stringify({say: '', kind: 'info', state: {recording: false, frozen: false, mouse: true, marks: []}}));
await page.waitForSelector('#hand:visible');

test('frames are shown as they come, bit for bit', async () => {
  server.sendFrames(1000, 17, 0);
  await shown(page, 1016);
  server.sendFrames(1020, 16, 3);
  await shown(page, 1035);
  const f = frame(1035);
  assert.equal(Number((await output(page, 'force')).value), Math.hypot(...f.force_n));
  assert.deepEqual(await page.evaluate(() => window.palpate.frames.triple('proxy_m', 32)), f.proxy_m);
  assert.match((await output(page, 'device')).text, /^mouse, 3 frames lost/);
});

test('a page that has just come is connected', async () => { // else it never said that the loop is silent
  assert.equal(await page.evaluate(() => window.palpate.isConnected), true);
});

test('the newest frame is followed, held and followed again', async () => {
  await page.click('#play');
  server.sendFrames(1036, 10, 0);
  await page.waitForFunction(() => window.palpate.frames.count === 43);
  await page.waitForTimeout(100);
  assert.match(await page.textContent('#clock'), /frame 1035$/);
  await page.click('#play');
  await shown(page, 1045);
});

test('a finer surface is asked for once and shown', async () => {
  assert.deepEqual(await server.next('level'), {do: 'level', structure: 0, facets: fine.facets});
  server.send(JSON.stringify({say: 'no such gain', kind: 'error', state: {}})); // of another command
  await page.waitForFunction(() => document.getElementById('link').textContent === 'no such gain');
  assert.ok(await page.evaluate(() => window.palpate.isAsking));
  server.send(container({kind: 'mesh', structures: [{id: 0, levels: [{facets: fine.facets, positions: 'p', indices: 'i'}]}]},
                        {p: fine.positions, i: fine.indices}));
  await page.waitForFunction(facets => window.palpate.view.surfaces.facets === facets, fine.facets);
  assert.deepEqual(server.take('level'), []);
  await page.evaluate(() => { window.palpate.isAsking = true; });
  server.send(JSON.stringify({say: 'structure 0 has no mesh', kind: 'error', about: 'mesh', state: {}}));
  await page.waitForFunction(() => !window.palpate.isAsking);
});

test('a view in which nothing moves is at rest though frames go on, and moves again with the probe', async () => {
  /** Frames a second apart, so that the path of the last 5 s is soon that of a probe that rests. */
  const send = (first, count, place) => {
    const {frames, arrays} = framesOf(1046, count);
    for (let i = 0; i < count; ++i) {
      arrays.time_s[i] = 2 + first + i;
      for (const name of ['probe_m', 'proxy_m', 'force_n']) arrays[name].set(place[name], 3 * i);
    }
    server.send(container({kind: 'frames', frames: {...frames, first: 1046 + first}}, arrays));
  };
  const sent = [];
  const timer = setInterval(() => send(sent.push(0), 1, frame(1045)), 50);
  await page.waitForFunction(() => { // the path that a test before left has gone
    const {view, player} = window.palpate;
    return view.trail.segments === 0 && view.isStill && player.playing;
  });
  const before = await page.evaluate(() => [window.palpate.frames.count, window.palpate.view.renderer.info.render.frame]);
  await page.waitForFunction(count => window.palpate.frames.count > count + 30, before[0]); // tables were looked at meanwhile
  assert.equal(await page.evaluate(() => window.palpate.view.renderer.info.render.frame), before[1], 'pictures of nothing new');
  clearInterval(timer);
  send(sent.push(0), 1, frame(1300));
  await page.waitForFunction(count => window.palpate.view.renderer.info.render.frame > count, before[1]);
  send(sent.push(0), 1, frame(1045));
  server.sendFrames(1000, 46, 0); // a run from 1 s on, as it was
  await shown(page, 1045);
});

test('sliders, freeze, restart, record and points send their commands', async () => {
  await page.locator('input[aria-label="gain of water"]').fill('0.25');
  assert.deepEqual(await server.next('gain'), {do: 'gain', effect: 1, part: 'strength', value: 0.25});
  await page.click('#freeze');
  assert.deepEqual(await server.next('freeze'), {do: 'freeze', on: true});
  server.send(JSON.stringify({say: 'frozen', kind: 'info', state: {frozen: true}}));
  await page.waitForSelector('#freeze[aria-pressed=true]');
  assert.equal(await page.textContent('#link'), 'frozen');
  await page.locator('#view canvas').focus();
  await page.keyboard.press('f');
  assert.deepEqual(await server.next('freeze'), {do: 'freeze', on: false});
  await page.click('#restart');
  assert.deepEqual(await server.next('restart'), {do: 'restart'});
  await page.click('#record');
  assert.deepEqual(await server.next('record'), {do: 'record', on: true});
  await page.fill('#mark-name', 'a spot');
  await page.keyboard.press('Enter');
  assert.deepEqual(await server.next('mark'), {do: 'mark', name: 'a spot'});
  assert.equal(await page.locator('#marks li').count(), 0); // until the loop has it
  server.send(JSON.stringify({state: {marks: [{name: 'a spot', at_m: kCenter, time_s: 1.5, felt: 'bone'}], gains: {0: 0.5}}}));
  await page.waitForFunction(() => document.querySelectorAll('#marks li').length === 1);
  assert.equal(await page.textContent('#marks li'), 'a spot1.50 s, bone');
  assert.equal(await page.inputValue('input[aria-label="gain of bone"]'), '0.5');
});

test('a gain that is refused goes back on its slider', async () => {
  const slider = page.locator('input[aria-label="gain of water"]');
  const shownGain = () => slider.evaluate(one => [one.value, one.nextSibling.textContent].map(Number));
  await slider.fill('0.25');
  assert.equal((await server.next('gain')).value, 0.25);
  assert.ok(await slider.evaluate(one => one === document.activeElement)); // as a hand leaves it
  assert.deepEqual(await shownGain(), [0.25, 0.25]);
  server.send(JSON.stringify({say: 'effect 1 has no gain that may be 0.25', kind: 'error', state: {gains: {0: 0.5}}}));
  await page.waitForFunction(() => document.getElementById('link').textContent.startsWith('effect 1 has no gain'));
  assert.deepEqual(await shownGain(), [1, 1]); // as the scene has it
  assert.equal(await page.inputValue('input[aria-label="gain of bone"]'), '0.5');
});

test('the mouse moves the hand in the plane of the view, the wheel along it', async () => {
  await page.keyboard.press('Escape');
  await page.locator('#view canvas').focus();
  await page.keyboard.press('1'); // from the front: right is L (+x), up is S (+z), away is P (+y)
  await page.waitForFunction(() => document.getElementById('seen-from').textContent.endsWith('(A)'));
  assert.deepEqual(server.take('probe'), []);
  await page.click('#hand');
  const box = await page.locator('#view').boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const start = frame(1045).probe_m;
  const scale = await page.evaluate(() => window.palpate.view.mmPerPixel(window.palpate.view.glyphs.probe.position) / 1000);
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 50, y - 20);
  await page.mouse.up();
  const near = (a, b) => assert.ok(a.every((v, i) => Math.abs(v - b[i]) < 1e-9), `${a} is not ${b}`); // camera angles round
  near((await server.next('probe')).at_m, [start[0] + 50 * scale, start[1], start[2] + 20 * scale]);
  await page.mouse.wheel(0, -200);
  near((await server.next('probe')).at_m, [start[0] + 50 * scale, start[1] + 0.001, start[2] + 20 * scale]);
});

test('the keyboard moves the hand, finer with Alt', async () => {
  const before = await page.evaluate(() => window.palpate.hand.place);
  const near = (a, b) => assert.ok(a.every((v, i) => Math.abs(v - b[i]) < 1e-9), `${a} is not ${b}`);
  await page.locator('#view canvas').focus();
  await page.keyboard.press('ArrowRight');
  near((await server.next('probe')).at_m, [before[0] + 0.0005, before[1], before[2]]);
  await page.keyboard.press('Alt+PageUp');
  near((await server.next('probe')).at_m, [before[0] + 0.0005, before[1] + 0.0001, before[2]]);
  await page.click('#hand');
  await page.locator('#view canvas').focus();
  await page.keyboard.press('ArrowRight'); // turns the view again
  await page.waitForTimeout(100);
  assert.deepEqual(server.take('probe'), []);
});

test('a flood of commands is one a picture', async () => {
  await page.click('#hand');
  const pictures = await page.evaluate(async () => {
    const {hand} = window.palpate;
    let count = 0;
    for (let i = 0; i < 500; ++i) {
      hand.by(1e-6, 0, 0);
      if (i % 100 === 0) await new Promise(done => requestAnimationFrame(() => done(++count)));
    }
    return count;
  });
  await page.waitForTimeout(200);
  assert.ok(server.take('probe').length <= pictures + 2);
  await page.click('#hand');
});

test('a damaged message is said and the page goes on', async () => {
  server.send(Buffer.from('garbage'));
  await page.waitForFunction(() => document.getElementById('problem').textContent.includes('ends after 7 bytes'));
  server.send('no JSON');
  await page.waitForFunction(() => document.getElementById('link').textContent === 'no JSON');
  server.sendFrames(1046, 5, 0);
  await page.waitForFunction(() => window.palpate.frames.count === 51);
  await page.locator('#problem').waitFor({state: 'hidden'}); // it moved all that is below it
});

test('a new run, whose clock begins anew, has its own charts; the table goes on', async () => {
  const time = () => page.$eval('#felt td[data-of=time]', cell => Number(cell.dataset.value));
  server.sendFrames(1051, 4, 0);
  await page.waitForFunction(() => window.palpate.frames.count === 55 && window.palpate.felt.done === 55);
  const before = await time();
  server.sendFrames(1000, 10, 0); // felt, and earlier than the last
  await page.waitForFunction(() => window.palpate.frames.count === 10 && window.palpate.felt.done === 10);
  await shown(page, 1009);
  assert.ok(Math.abs(await time() - before - 0.009) < 1e-9); // the first of a run has no frame before it
  assert.equal(await page.evaluate(() => window.palpate.charts.cells[0].chart.data[0][0]), 1);
});

test('what was touched before a recording began is painted though its frames are forgotten', async () => {
  server.sendFrames(1400, 50, 0);
  await page.waitForFunction(() => window.palpate.frames.count === 60);
  server.sendFrames(1010, 10, 0); // a recording has a clock of its own
  await page.waitForFunction(() => window.palpate.frames.count === 10);
  await page.selectOption('#paint', 'touched');
  // Nearest to the proxy, on each level that is painted; which of them is drawn depends on how fast this machine is.
  const touched = place => page.evaluate(at => window.palpate.view.surfaces.byId(0).levels.filter(one => one.coverage).some(({coverage}) => {
    const away = v => Math.hypot(...at.map((mm, axis) => mm - coverage.places[3 * v + axis]));
    let nearest = 0;
    for (let v = 1; v < coverage.count; ++v) if (away(v) < away(nearest)) nearest = v;
    return coverage.isTouched[nearest] === 1;
  }), place.map((v, axis) => 1000 * (v - kCenter[axis])));
  assert.ok(await touched(frame(1015).proxy_m), 'now');
  assert.ok(await touched(frame(1425).proxy_m), 'before');
  assert.ok(!await touched(frame(1900).proxy_m), 'never');
  await page.selectOption('#paint', 'none');
});

test('the page connects again, begins anew, and sends nothing meanwhile', async () => {
  await page.evaluate(() => { // what is said for half a second is not missed on a slow machine
    const [link, freeze] = ['link', 'freeze'].map(id => document.getElementById(id));
    window.said = [];
    new MutationObserver(() => {
      window.said.push([link.textContent, freeze.disabled]);
      if (link.textContent.startsWith('no connection')) window.palpate.hand.by(0.05, 0, 0); // a drag that nobody hears
    }).observe(link, {childList: true});
  });
  server.socket.terminate();
  await page.waitForFunction(() => window.said.some(([words]) => words === 'connected'));
  const said = await page.evaluate(() => window.said);
  assert.ok(said.some(([words, isDisabled]) => words.startsWith('no connection') && isDisabled), JSON.stringify(said));
  assert.equal(server.connections, 2);
  server.sendFrames(0, 5, 0);
  await shown(page, 4);
  assert.equal(await page.evaluate(() => window.palpate.frames.count), 5);
  assert.ok(await page.evaluate(() => window.palpate.hand.place === undefined && !window.palpate.hand.isMoved));
});

test('a page that has shown a soft surface goes on after it connects again, and its zoom stays', async () => {
  const {frames, arrays} = softFramesOf(5, 20);
  server.send(container({kind: 'frames', frames}, arrays));
  await page.waitForSelector('.chart:nth-of-type(3):visible');
  const connections = server.connections;
  server.socket.terminate();
  while (server.connections === connections) await new Promise(done => setTimeout(done, 20));
  server.sendFrames(0, 500, 0);
  await page.waitForFunction(() => window.palpate.frames.count === 500);
  await page.waitForFunction(() => window.palpate.charts.cells[0].chart.data[0].length === 500);
  assert.equal(await page.evaluate(() => window.palpate.charts.cells.filter(one => one.isSoft && !one.cell.hidden).length), 0);
  const scale = () => page.evaluate(() => { const {min, max} = window.palpate.charts.cells[0].chart.scales.x; return [min, max]; });
  const {x, y, width, height} = await page.locator('.chart .u-over').first().boundingBox();
  await page.mouse.move(x + 0.3 * width, y + 0.5 * height);
  await page.mouse.down();
  await page.mouse.move(x + 0.6 * width, y + 0.5 * height, {steps: 4});
  await page.mouse.up();
  const zoomed = await scale();
  assert.ok(zoomed[0] > 0.1 && zoomed[1] < 0.4, `${zoomed}`);
  server.sendFrames(500, 20, 0);
  await page.waitForFunction(() => window.palpate.charts.cells[0].chart.data[0].length === 520);
  assert.deepEqual(await scale(), zoomed);
  for (let i = 520; i < 12520; i += 500) server.sendFrames(i, 500, 0); // what is zoomed on is there still
  await page.waitForFunction(() => window.palpate.frames.count === 12520);
  await page.waitForFunction(() => window.palpate.takenCount === 12520);
  assert.deepEqual(await scale(), zoomed);
  assert.ok(await page.evaluate(from => window.palpate.charts.cells[0].chart.data[0][0] <= from, zoomed[0]));
  await page.mouse.dblclick(x + 0.5 * width, y + 0.5 * height);
  await page.waitForFunction(() => window.palpate.charts.cells[0].chart.scales.x.max === 12.519);
  assert.equal(await page.evaluate(() => window.palpate.player.playing), true, 'a double click goes nowhere');
});

test('a loop that is silent is said to be', async () => {
  const silence = page.locator('#silence');
  await page.waitForFunction(() => /^no frame for \d+ s$/.test(document.getElementById('silence').textContent));
  assert.ok(await silence.isVisible());
  server.send(JSON.stringify({say: 'no such gain', kind: 'error'})); // what is said stays while seconds are counted
  await page.waitForFunction(() => document.getElementById('link').textContent === 'no such gain');
  const before = await silence.textContent();
  await page.waitForFunction(words => document.getElementById('silence').textContent !== words, before);
  assert.equal(await page.textContent('#link'), 'no such gain');
  let next = 12520;
  const timer = setInterval(() => server.sendFrames((next += 20) - 20, 20, 0), 200); // else it is hidden for a second only
  await silence.waitFor({state: 'hidden'}).finally(() => clearInterval(timer));
  assert.equal(await page.textContent('#link'), 'no such gain');
});

test('what was touched is kept by a page that was never drawn', async () => {
  const other = new FakeServer(pageText, {marks: [], details: undefined});
  const hidden = await openPage(await other.listen(), {script: 'window.requestAnimationFrame = () => 0;'}); // as in the background
  const has = count => hidden.waitForFunction(n => window.palpate?.frames.count === n, count, {polling: 50});
  await has(0);
  other.sendFrames(1400, 50, 0);
  await has(50);
  other.sendFrames(1010, 10, 0); // a recording has a clock of its own
  await has(10);
  assert.ok(await hidden.evaluate(() => window.palpate.view.surfaces.byId(0).area?.touched_mm2 > 0));
  await close(hidden);
  other.close();
});
