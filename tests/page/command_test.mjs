// SPDX-License-Identifier: Apache-2.0
// palpate view itself: a recording's page has the trace's numbers, and a page moves the probe of a running loop. PALPATE is the
// command, PALPATE_SOURCE the checkout.
import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {copyFileSync, mkdirSync, readdirSync, readFileSync, rmSync} from 'node:fs';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {pathToFileURL} from 'node:url';
import {close, closeBrowser, openPage, output, ready, work} from './browser.mjs';

const folder = join(work, 'command'), scene = join(folder, 'examples', 'phantom.toml');
const palpate = (...options) => execFileSync(process.env.PALPATE, options, {cwd: folder, stdio: 'pipe',
  env: {...process.env, PALPATE_CACHE: join(folder, 'cache')}});
rmSync(folder, {recursive: true, force: true});
for (const name of ['examples', 'demo-output/data']) mkdirSync(join(folder, name), {recursive: true});
copyFileSync(join(process.env.PALPATE_SOURCE, 'examples', 'phantom.toml'), scene);
palpate('phantom', 'demo-output/data/phantom.nrrd');
after(closeBrowser);

/** Columns of a table of numbers, by name. */
function columns(file) {
  const [head, ...rows] = readFileSync(file, 'utf8').trim().split('\n').map(line => line.split(','));
  return Object.fromEntries(head.map((name, i) => [name, rows.map(row => row[i])]));
}

/** All frames of a page, columns as lists. */
const framesOf = page => page.evaluate(() => {
  const {frames} = window.palpate;
  return Object.fromEntries(Object.entries(frames.columns).map(([name, values]) =>
    [name, [...values.subarray(0, frames.count * (name.match(/_(m|n)$/) ? 3 : 1))].map(v => v + 0)]));
});

test('the page of a recording has the numbers of the trace, bit for bit', async () => {
  palpate('trace', scene, '--frames', '2000', '--out', 'trace');
  palpate('view', 'trace/recording.h5', '-o', 'trace.html');
  const table = columns(join(folder, 'trace', 'frames.csv'));
  const page = await openPage(pathToFileURL(join(folder, 'trace.html')).href);
  await ready(page);
  const shown = await framesOf(page);
  assert.equal(shown.time_s.length, table.frame.length);
  const numbers = name => table[name].map(text => Number(text) + 0);
  assert.deepEqual(shown.time_s, numbers('time_s'));
  assert.deepEqual(shown.sub_steps, numbers('sub_steps'));
  assert.deepEqual(shown.flags, numbers('flags'));
  assert.deepEqual(shown.felt.map(Boolean), numbers('contacts').map(Boolean));
  for (const name of ['probe_m', 'proxy_m', 'force_n'])
    for (const [axis, letter] of ['x', 'y', 'z'].entries()) {
      const wanted = numbers(name.replace('_', `_${letter}_`));
      assert.deepEqual(shown[name].filter((_, i) => i % 3 === axis), wanted, `${name} ${letter}`);
    }
  assert.ok(shown.felt.some(Boolean));
  await close(page);
});

/** Starts the loop; its link and what ends it. */
async function startLoop() {
  const child = spawn(process.env.PALPATE, ['view', scene, '--device', 'page', '--seconds', '600', '--out', 'live'], {cwd: folder,
    env: {...process.env, PALPATE_CACHE: join(folder, 'cache')}});
  let said = '';
  const link = await new Promise((done, fail) => {
    for (const stream of [child.stdout, child.stderr])
      stream.on('data', data => {
        said += data;
        const found = /http:\/\/127\.0\.0\.1:\S+/.exec(said);
        if (found) done(found[0]);
      });
    child.on('exit', code => fail(new Error(`palpate view ended with ${code}: ${said}`)));
  });
  return {link, stop: () => new Promise(done => child.on('exit', done).kill('SIGINT'))};
}

test('a page moves the probe of a loop, changes its gain, and its recording has the frames that the page saw', async () => {
  const loop = await startLoop();
  const page = await openPage(loop.link);
  await page.waitForFunction(() => window.palpate?.frames.count > 0);
  await page.waitForSelector('#hand:visible');
  const newest = () => page.evaluate(() => {
    const {frames} = window.palpate, i = frames.count - 1;
    return {felt: frames.columns.felt[i], depth: frames.depth(i), force: frames.force(i), proxy: frames.triple('proxy_m', i)};
  });
  await page.click('#hand');
  await page.locator('#view canvas').focus();
  // Towards the scene's centre along the view, until the surface holds the proxy 2 mm behind.
  await page.evaluate(() => {
    const {hand, view} = window.palpate, [right, up] = view.axes(), at = hand.probe();
    const off = axis => axis.reduce((sum, v, i) => sum + v * (view.center[i] - at[i]), 0);
    hand.by(off(right), off(up), 0);
  });
  await page.evaluate(() => new Promise(done => {
    const {hand, frames} = window.palpate;
    const approach = () => {
      const i = frames.count - 1;
      if (frames.columns.felt[i] && frames.depth(i) > 0.002) return done();
      hand.by(0, 0, -0.0005);
      return requestAnimationFrame(approach);
    };
    approach();
  }));
  const pressed = await newest();
  assert.ok(pressed.force > 0.1, JSON.stringify(pressed));

  for (let i = 0; i < 10; ++i) await page.keyboard.press('ArrowRight'); // 5 mm to the right
  await page.waitForFunction(from => { // the proxy follows on the surface, which holds it back
    const {frames} = window.palpate, i = frames.count - 1;
    return frames.columns.felt[i] && Math.hypot(...frames.triple('proxy_m', i).map((v, axis) => v - from[axis])) > 0.001;
  }, pressed.proxy);

  // A recording is a run of its own: its time begins anew, and the probe comes from in front of the surface again.
  const before = await page.evaluate(() => window.palpate.frames.columns.time_s[window.palpate.frames.count - 1]);
  await page.click('#record');
  await page.waitForSelector('#record[aria-pressed=true]');
  await page.waitForFunction(time => {
    const {frames} = window.palpate, i = frames.count - 1;
    return frames.columns.time_s[i] < time && frames.columns.felt[i] && frames.force(i) > 0.1;
  }, before);
  const held = await newest();
  await page.locator('input[aria-label^="gain of"]').fill('0');
  await page.waitForFunction(() => window.palpate.state.gains?.[0] === 0);
  await page.waitForFunction(force => window.palpate.frames.force(window.palpate.frames.count - 1) < 0.1 * force, held.force);
  await page.fill('#mark-name', 'here');
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => window.palpate.marks.length === 1);
  await page.waitForFunction(() => window.palpate.frames.count > 1000); // of this run alone
  const live = await framesOf(page), lost = (await output(page, 'device')).text; // the next run begins with other frames
  await page.click('#record');
  await page.waitForSelector('#record[aria-pressed=false]');
  await close(page);
  await loop.stop();

  const recording = readdirSync(join(folder, 'live')).find(name => name.endsWith('.h5'));
  palpate('view', join('live', recording), '-o', 'live.html');
  const played = await openPage(pathToFileURL(join(folder, 'live.html')).href);
  await ready(played);
  const kept = await framesOf(played);
  assert.deepEqual(await played.$$eval('#marks button', all => all.map(one => one.textContent)), ['here']);
  await close(played);
  const at = new Map(kept.time_s.map((time, i) => [time, i]));
  let same = 0;
  for (const [i, time] of live.time_s.entries()) {
    const k = at.get(time);
    if (k === undefined || k === 0) continue;
    for (const name of ['probe_m', 'proxy_m', 'force_n'])
      assert.deepEqual(live[name].slice(3 * i, 3 * i + 3), kept[name].slice(3 * k, 3 * k + 3), `${name} at ${time} s; ${lost}`);
    ++same;
  }
  assert.ok(same > 500, `only ${same} frames of both`);
});
