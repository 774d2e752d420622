// SPDX-License-Identifier: Apache-2.0
// palpate view of data: another iso-value shows another surface, labels are chosen by name, and what is saved is a scene that is felt.
// PALPATE is the command.
import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {existsSync, mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {close, closeBrowser, openPage, work} from './browser.mjs';

const folder = join(work, 'explore'), env = {...process.env, PALPATE_CACHE: join(folder, 'cache')};
rmSync(folder, {recursive: true, force: true});
mkdirSync(folder, {recursive: true});
const palpate = (...options) => execFileSync(process.env.PALPATE, options, {cwd: folder, stdio: 'pipe', env});
palpate('phantom', 'phantom.nrrd');
after(closeBrowser);

/** Three blocks of 12 voxels of 1 mm in a row, with labels 1 to 3, and their names and colours. */
function writeLabels() {
  const [nx, ny, nz] = [54, 24, 24], voxels = new Int16Array(nx * ny * nz);
  for (let z = 6; z < 18; ++z)
    for (let y = 6; y < 18; ++y)
      for (let x = 0; x < nx; ++x) if (x % 16 >= 4 && x < 48) voxels[x + nx * (y + ny * z)] = 1 + Math.floor(x / 16);
  const head = `NRRD0004\ntype: int16\ndimension: 3\nspace: left-posterior-superior\nsizes: ${nx} ${ny} ${nz}\n` +
    'space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nendian: little\nencoding: raw\n\n';
  writeFileSync(join(folder, 'brain.nrrd'), Buffer.concat([Buffer.from(head), Buffer.from(voxels.buffer)]));
  writeFileSync(join(folder, 'brain.txt'), '1 Hippocampus_L\n2 Thalamus_L\n3 Thalamus_R\n');
}

/** Starts the command; its link and what ends it. */
async function explore(file) {
  const child = spawn(process.env.PALPATE, ['view', file, '--seconds', '300'], {cwd: folder, env});
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

/** Frames in contact of a second of a scene. */
function felt(scene) {
  palpate('trace', scene, '--contact', 'volume', '--seconds', '1', '--out', `${scene}-trace`);
  const [head, ...rows] = readFileSync(join(folder, `${scene}-trace`, 'frames.csv'), 'utf8').trim().split('\n').map(line => line.split(','));
  return rows.filter(row => Number(row[head.indexOf('contacts')]) > 0).length;
}

const fine = page => page.waitForFunction(() => window.palpate?.explore.shownIso?.fine);
const facets = page => page.evaluate(() => window.palpate.view.surfaces.all[0].levels.at(-1).facets);
const words = page => page.textContent('#choice-words');

test('an iso-value is chosen and seen, and the scene that is saved is felt there', async () => {
  const server = await explore('phantom.nrrd');
  const page = await openPage(server.link);
  await fine(page);
  const before = await facets(page), otsu = await page.evaluate(() => window.palpate.explore.iso);
  assert.match(await words(page), /Otsu's threshold/);
  assert.equal(await page.evaluate(() => window.palpate.slices.volumes.length), 1);
  // What a pointer is tried on is made when it first comes, and belongs to what is drawn.
  const isTargetDrawn = () => page.evaluate(() => {
    const [surface] = window.palpate.view.surfaces.all;
    return surface.target.geometry === surface.levels.find(level => level.isHere).geometry;
  });
  assert.ok(await isTargetDrawn());

  await page.fill('#iso-number', '226');
  await page.press('#iso-number', 'Enter');
  await page.waitForFunction(() => window.palpate.explore.shownIso.value === 226 && window.palpate.explore.shownIso.fine);
  assert.ok(await isTargetDrawn(), 'after another iso-value');
  assert.notEqual(otsu, 226);
  assert.notEqual(await facets(page), before);

  // The slider by the keyboard, as fast as keys come: what it shows at last is where it stands.
  await page.focus('#iso');
  for (let i = 0; i < 20; ++i) await page.keyboard.press('ArrowRight');
  await page.waitForFunction(() => window.palpate.explore.shownIso.fine &&
    window.palpate.explore.shownIso.value === document.getElementById('iso').valueAsNumber);

  await page.fill('#iso-number', '99999');
  await page.press('#iso-number', 'Enter');
  await page.waitForSelector('#choice-words.error');
  assert.match(await words(page), /no surface is there; choose one above/);

  await page.fill('#iso-number', '226');
  await page.press('#iso-number', 'Enter');
  // What is said of a surface that comes later would stand in the place of what is said of the file.
  await page.waitForFunction(() => window.palpate.explore.shownIso.value === 226 && window.palpate.explore.shownIso.fine);
  await page.click('#save');
  await page.waitForFunction(() => /^saved: phantom.toml/.test(document.getElementById('choice-words').textContent));
  assert.match(readFileSync(join(folder, 'phantom.toml'), 'utf8'), /^iso_value = 226\.0 /m);
  await page.screenshot({path: join(work, 'explore-volume.png')});
  await close(page);
  await server.stop();
  assert.ok(felt('phantom.toml') > 500, `${felt('phantom.toml')} of 1000 frames in contact`);
});

test('labels are filtered, shown and chosen by name, and those are felt', async () => {
  writeLabels();
  const server = await explore('brain.nrrd');
  const page = await openPage(server.link);
  await page.waitForFunction(() => window.palpate?.explore.here?.size === 3);
  const visible = () => page.evaluate(() => window.palpate.view.surfaces.all.filter(s => s.mesh.visible && s.facets > 0).map(s => s.structure.name));
  assert.deepEqual(await visible(), ['Hippocampus_L', 'Thalamus_L', 'Thalamus_R']);

  await page.fill('#label-filter', 'thalamus');
  assert.deepEqual(await page.$$eval('#label-list .label:not([hidden]) .name', all => all.map(one => one.textContent)), ['Thalamus_L', 'Thalamus_R']);
  await page.click('#show-none');
  assert.deepEqual(await visible(), ['Hippocampus_L']);
  await page.uncheck('input[aria-label="feel Thalamus_R"]');
  await page.check('input[aria-label="show Thalamus_R"]');
  assert.deepEqual(await visible(), ['Hippocampus_L', 'Thalamus_R']);
  await page.fill('#label-filter', '');
  await page.uncheck('input[aria-label="feel Hippocampus_L"]');
  await page.uncheck('input[aria-label="feel Thalamus_L"]');
  assert.ok(await page.isDisabled('#save'));
  await page.check('input[aria-label="feel Thalamus_L"]');
  await page.click('#save');
  await page.waitForFunction(() => /^saved: brain.toml/.test(document.getElementById('choice-words').textContent));
  await page.screenshot({path: join(work, 'explore-labels.png')});
  await close(page);
  await server.stop();
  const text = readFileSync(join(folder, 'brain.toml'), 'utf8');
  assert.deepEqual([...text.matchAll(/^label = "(.*)"$/gm)].map(found => found[1]), ['Thalamus_L']);
  assert.ok(felt('brain.toml') > 500, `${felt('brain.toml')} of 1000 frames in contact`);
});

test('at 390 px nothing is wider than the page', async () => {
  const server = await explore('brain.nrrd');
  for (const scheme of ['light', 'dark']) {
    const page = await openPage(server.link, {width: 390, height: 844, scheme});
    await page.waitForFunction(() => window.palpate?.explore.here?.size === 3);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= document.documentElement.clientWidth));
    await page.screenshot({path: join(work, `explore-390-${scheme}.png`), fullPage: true});
    await close(page);
  }
  await server.stop();
  assert.ok(!existsSync(join(folder, 'brain-2.toml')));
});

test('the number beside the slider is the iso-value, also where all values are far from 0', async () => {
  const server = await explore('phantom.nrrd');
  const page = await openPage(server.link);
  await fine(page);
  assert.equal(await page.evaluate(() => {
    const {explore} = window.palpate;
    explore.askIso = () => {};
    explore.choice.bounds = [101300, 101350];
    explore.setIso(101325.37);
    return document.getElementById('iso-number').value;
  }), '101325.37');
  await close(page);
  await server.stop();
});

test('a page of data whose command has ended speaks of no force', async () => {
  const server = await explore('phantom.nrrd');
  const page = await openPage(server.link);
  await fine(page);
  await server.stop();
  await page.waitForFunction(() => document.getElementById('link').textContent.startsWith('no connection'));
  assert.doesNotMatch(await page.textContent('#link'), /force/);
  await page.close(); // the browser itself reports the lost socket as an error
});
