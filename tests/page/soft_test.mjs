// SPDX-License-Identifier: Apache-2.0
// A soft surface over a hard one: the page shows what frames.csv has of it. PALPATE is the command.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {pathToFileURL} from 'node:url';
import {areasFelt, close, closeBrowser, openPage, output, ready, seek, work} from './browser.mjs';
import {measure} from './measure.mjs';

const folder = join(work, 'soft');
const palpate = (...options) => execFileSync(process.env.PALPATE, options, {cwd: folder, stdio: 'pipe',
  env: {...process.env, PALPATE_CACHE: join(folder, 'cache')}});
const kScene = `[volume.ball]
analytic = "solid_sphere"
radius_mm = 60
[surface.skin]
volume = "ball"
stiffness_n_per_mm = 0.1
[surface.bone]
volume = "ball"
iso_value = 0.01
[[effect]]
type = "surface"
surface = ["skin", "bone"]
[device]
type = "orbit"
surface = "skin"
depth_max_mm = 15
duration_s = 3
`;

/** The rows of a frames.csv, each an object. */
function rowsOf(name) {
  const [head, ...rows] = readFileSync(join(folder, name, 'frames.csv'), 'utf8').trim().split('\n').map(line => line.split(','));
  return rows.map(row => Object.fromEntries(row.map((cell, i) => [head[i], cell])));
}

before(() => {
  rmSync(folder, {recursive: true, force: true});
  mkdirSync(folder, {recursive: true});
  writeFileSync(join(folder, 'soft.toml'), kScene);
  writeFileSync(join(folder, 'hard.toml'), kScene.replace('stiffness_n_per_mm = 0.1\n', ''));
  for (const name of ['soft', 'hard']) {
    palpate('trace', `${name}.toml`, '--out', name);
    palpate('view', join(name, 'recording.h5'), '-o', `${name}.html`);
  }
});
after(closeBrowser);

test('indentation, stiffness and depth behind the front are those of frames.csv', async () => {
  const rows = rowsOf('soft'), page = await openPage(pathToFileURL(join(folder, 'soft.html')).href);
  await ready(page);
  assert.deepEqual(await page.$$eval('.chart:not([hidden]) h3', all => all.map(one => one.firstChild.textContent)),
                   ['Force', 'Depth', 'Indentation', 'Stiffness', 'Sub-steps', 'Computing', 'Lateness']);
  const deepest = rows.reduce((best, row, i) => (Number(row.indentation_m) > Number(rows[best].indentation_m) ? i : best), 0);
  assert.equal(rows[deepest].pressed, 'skin');
  const middle = Math.floor(rows.length / 2);
  for (const i of [0, deepest, middle]) {
    await seek(page, i);
    const row = rows[i], numbers = name => ['x', 'y', 'z'].map(axis => Number(row[`${name}_${axis}_m`]));
    const probe = numbers('probe'), front = numbers('front');
    const charts = await page.$$eval('.chart output', all => all.map(one => Number(one.dataset.value)));
    assert.equal(charts[1], 1000 * Math.hypot(...probe.map((v, axis) => v - front[axis])));
    assert.equal(charts[2], 1000 * Math.fround(row.indentation_m));
    assert.equal(charts[3], Math.fround(row.stiffness_n_per_m) / 1000);
    const {text} = await output(page, 'pressed');
    assert.equal(text.startsWith(row.pressed || 'nothing'), true, text);
  }
  // The front is on the ball of 60 mm also where bone holds the tip at 50 mm: what is painted is there.
  await seek(page, deepest);
  const tip_mm = 1000 * Math.hypot(...['x', 'y', 'z'].map(axis => Number(rows[deepest][`proxy_${axis}_m`])));
  assert.ok(Math.abs(tip_mm - 50) < 0.1, `${tip_mm}`);
  await areasFelt(page);
  const shares = await page.$$eval('#felt tbody tr:not([hidden]) td:last-child', all => all.map(one => Number(one.dataset.value)));
  assert.ok(shares[0] > 1, `${shares} %: skin is felt at its own place`);
  await page.screenshot({path: join(folder, 'soft.png')});
  await close(page);
});

test('of hard surfaces nothing of it is shown', async () => {
  const page = await openPage(pathToFileURL(join(folder, 'hard.html')).href);
  await ready(page);
  assert.equal(await page.locator('.chart:not([hidden])').count(), 5);
  assert.equal(await page.locator('#pressed-row').isVisible(), false);
  await close(page);
});

test('on a phone all of it is legible', async () => {
  const page = await openPage(pathToFileURL(join(folder, 'soft.html')).href, {width: 390, height: 800, scheme: 'dark'});
  await ready(page);
  await seek(page, 1500);
  assert.deepEqual(await page.evaluate(measure), []);
  for (const cell of await page.locator('.chart').all()) {
    const box = await cell.boundingBox();
    assert.ok(box.width > 250 && box.height > 60, `${box.width} x ${box.height}`);
  }
  await page.screenshot({path: join(folder, 'soft_phone.png'), fullPage: true});
  await close(page);
});
