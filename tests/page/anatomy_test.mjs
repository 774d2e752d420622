// SPDX-License-Identifier: Apache-2.0
// Real data, live: a hand on the bone of a skull, and the labels of a brain. PALPATE is the command; PALPATE_REAL_DATA has what
// scripts/fetch_data.sh gets (skull, labels, brain): what is not there is skipped.
import assert from 'node:assert/strict';
import {existsSync, readdirSync} from 'node:fs';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {close, closeBrowser, openPage, work} from './browser.mjs';
import {Loop, column} from './loop.mjs';

after(closeBrowser);
const data = process.env.PALPATE_REAL_DATA ?? '', file = name => join(data, name);
const without = (...names) => {
  const missing = names.filter(name => !existsSync(file(name)));
  return missing.length ? `no ${missing.join(', ')} in ${data || 'PALPATE_REAL_DATA'}: scripts/fetch_data.sh gets it` : false;
};

/** Moves the hand straight towards a place until something is felt, and then lets it press so deep, m. */
async function press(page, target_m, depth_m) {
  await page.evaluate(at_m => window.palpate.send({do: 'probe', at_m}), target_m);
  await isFelt(page);
  // The proxy is still on its way along the surface, so that a depth is measured from where it comes to rest: again, until it does.
  await page.waitForFunction(async depth => {
    const {frames, send} = window.palpate, i = frames.count - 1;
    if (!frames.columns.felt[i]) return false;
    if (frames.depth(i) > depth / 2 && frames.depth(i) < 2 * depth) return true;
    const [probe, proxy] = ['probe_m', 'proxy_m'].map(name => frames.triple(name, i));
    send({do: 'probe', at_m: proxy.map((v, axis) => v + depth * (probe[axis] - v) / frames.depth(i))});
    await new Promise(resolve => setTimeout(resolve, 100));
    return false;
  }, depth_m);
}

const at = page => page.evaluate(() => {
  const {frames} = window.palpate, i = frames.count - 1;
  return {felt: frames.columns.felt[i], depth: frames.depth(i), force: frames.force(i), proxy: frames.triple('proxy_m', i)};
});
const isFelt = page => page.waitForFunction(() => window.palpate.frames.columns.felt[window.palpate.frames.count - 1]);

test('skull, live: the probe is dragged, the proxy slides on the bone, and the recording has the same frames',
  {skip: without('skull.nhdr', 'skull.raw')}, async t => {
    const loop = new Loop('skull', t, `[volume.head]\nfile = "${file('skull.nhdr')}"\n[surface.bone]\nvolume = "head"\niso_value = 226.0\n` +
      'smooth_voxels = 0.7\nkeep = "largest"\ncontact = "volume"\n[[effect]]\ntype = "surface"\nsurface = "bone"\n');
    const page = await openPage(await loop.start('--device', 'page'), {width: 1400, height: 900});
    await page.waitForFunction(() => window.palpate?.frames.count > 0);
    await page.waitForSelector('#hand:visible');
    // From above onto the vault, which has no holes. What was in the way there does not count: a new trial begins in the air.
    const [low, high] = await page.evaluate(() => window.palpate.view.surfaces.byId(0).structure.box_m);
    const center = low.map((v, i) => (v + high[i]) / 2);
    await page.evaluate(at_m => window.palpate.send({do: 'probe', at_m}), [center[0], center[1], high[2] + 0.01]);
    await page.waitForFunction(z => window.palpate.probe()[2] > z, high[2] + 0.009);
    await page.click('#restart');
    await page.waitForFunction(() => {
      const {frames} = window.palpate, i = frames.count - 1;
      return frames.depth(i) < 1e-4 && !frames.columns.felt[i];
    });
    await press(page, center, 0.003);
    await page.click('#center');
    const whole = await at(page);
    assert.ok(whole.force > 0.5, JSON.stringify(whole));

    await page.click('#record');
    await page.waitForSelector('#record[aria-pressed=true]');
    await isFelt(page);
    await page.click('#hand');
    const box = await page.locator('#view').boundingBox(), [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    const before = await at(page);
    await page.mouse.move(x, y);
    await page.mouse.down();
    for (let i = 1; i <= 20; ++i) {
      await page.mouse.move(x + i, y);
      await page.waitForTimeout(20);
    }
    await page.mouse.up();
    await page.waitForFunction(from => { // it follows on the surface, which holds it back
      const {frames} = window.palpate, i = frames.count - 1;
      return Math.hypot(...frames.triple('proxy_m', i).map((v, axis) => v - from[axis])) > 0.002;
    }, before.proxy);
    await page.keyboard.press('p'); // the device's button drops a point
    await page.waitForFunction(() => window.palpate.marks.some(mark => mark.name === 'button 1'));
    await page.waitForTimeout(1500); // as fine as may be, for the picture
    await page.screenshot({path: join(work, 'live-skull.png')});
    const shown = {}; // before the next run, of which the page begins anew
    for (const name of ['time_s', 'probe_m', 'proxy_m', 'force_n', 'felt']) shown[name] = await column(page, name);
    const run = await page.evaluate(() => window.palpate.frames.generation);
    await page.click('#record');
    await page.waitForFunction(() => /^written: /.test(document.getElementById('link').textContent));

    // The slider changes the force of the next run, which begins in front of the bone and presses again.
    await page.waitForFunction(before => {
      const {frames} = window.palpate, i = frames.count - 1;
      return frames.generation > before && i >= 0 && frames.columns.felt[i] && frames.force(i) > 0.1;
    }, run);
    const held = await at(page);
    await page.locator('input[aria-label^="gain of"]').fill('0');
    await page.waitForFunction(() => window.palpate.frames.force(window.palpate.frames.count - 1) < 0.01);
    assert.ok(held.force > 0.1);
    await close(page);

    const recording = readdirSync(join(loop.folder, 'live')).find(name => name.endsWith('.h5'));
    loop.palpate('replay', join('live', recording), '--out', 'again');
    const [head, ...rows] = loop.read('again/frames.csv').trim().split('\n').map(line => line.split(','));
    const number = (row, name) => Number(row[head.indexOf(name)]) + 0;
    const kept = new Map(rows.map(row => [number(row, 'time_s'), row]));
    let same = 0, slid = 0;
    for (const [i, time] of shown.time_s.entries()) {
      const row = kept.get(time);
      if (!row) continue;
      for (const [mine, theirs] of [['probe_m', 'probe_?_m'], ['proxy_m', 'proxy_?_m'], ['force_n', 'force_?_n']])
        assert.deepEqual(shown[mine][i].map(v => v + 0), ['x', 'y', 'z'].map(axis => number(row, theirs.replace('?', axis))), `${mine} at ${time} s`);
      ++same;
      if (shown.felt[i] && i > 0 && shown.felt[i - 1]) slid += Math.hypot(...shown.proxy_m[i].map((v, axis) => v - shown.proxy_m[i - 1][axis]));
    }
    assert.ok(same > 500, `only ${same} frames of both`);
    assert.ok(slid > 0.002, `only ${1000 * slid} mm on the bone`);
  });

const kLabels = ['Precentral_L', 'Precentral_R', 'Frontal_Sup_L', 'Frontal_Sup_R', 'Hippocampus_L', 'Hippocampus_R', 'Putamen_L',
                 'Putamen_R', 'Thalamus_L', 'Thalamus_R', 'Caudate_L', 'Caudate_R'];

test('brain, live: twelve labels are listed, toggled, cut in slices, felt by name',
  {skip: without('aal.nii.gz', 'aal.nii.txt')}, async t => {
    const image = existsSync(file('brain.nii.gz')) ? `[volume.t1]\nfile = "${file('brain.nii.gz')}"\n` : '';
    const loop = new Loop('brain', t, `${image}[volume.atlas]\nfile = "${file('aal.nii.gz')}"\nlabels = "${file('aal.nii.txt')}"\n` +
      kLabels.map(name => `[surface.${name}]\nvolume = "atlas"\nlabel = "${name}"\ncontact = "volume"\n`).join('') +
      `[[effect]]\ntype = "surface"\nsurface = [${kLabels.map(name => `"${name}"`).join(', ')}]\n`);
    const link = await loop.start('--device', 'page');
    const page = await openPage(link, {width: 1400, height: 900});
    await page.waitForFunction(() => window.palpate?.frames.count > 0);
    const names = await page.$$eval('.structure .name', all => all.map(one => one.textContent));
    assert.deepEqual([...names].sort(), [...kLabels].sort());
    const found = await page.evaluate(() => ({labels: window.palpate.slices.labels.labels.length, volumes: window.palpate.slices.volumes.length,
      colors: window.palpate.slices.labels.labels.filter(one => one.structure >= 0)
        .every(one => one.color === window.palpate.view.surfaces.byId(one.structure).structure.color)}));
    assert.deepEqual(found, {labels: 116, volumes: image ? 1 : 0, colors: true});

    // The finest level of each comes, and what is drawn at rest is all of it.
    await page.waitForFunction(() => {
      const {view, isAsking} = window.palpate, {surfaces} = view;
      const isAll = surfaces.all.every(s => s.levels.at(-1).isHere) && surfaces.facets === surfaces.mostFacets;
      if (!isAll && view.isStill && !isAsking) view.touch(); // a picture that took long is forgotten after 20 s, where others follow
      return isAll;
    }, undefined, {timeout: 300000});

    await page.fill('#filter', 'thal');
    await page.click('#hide-all');
    const seen = () => page.evaluate(() => window.palpate.view.surfaces.all.filter(s => s.mesh.visible).map(s => s.structure.name).sort());
    assert.deepEqual(await seen(), kLabels.filter(name => !name.startsWith('Thalamus')).sort());
    await page.click('#show-all');
    await page.fill('#filter', '');
    await page.click('#hide-all');
    for (const name of ['Putamen_L', 'Thalamus_L']) await page.check(`input[aria-label="show ${name}"]`);
    assert.deepEqual(await seen(), ['Putamen_L', 'Thalamus_L']);

    // What is felt is named, in words and in the slice beside it.
    const middle = await page.evaluate(() => {
      const {box_m} = window.palpate.view.surfaces.all.find(s => s.structure.name === 'Precentral_L').structure;
      return box_m[0].map((v, i) => (v + box_m[1][i]) / 2);
    });
    await press(page, middle, 0.002);
    await page.waitForFunction(() => document.getElementById('touching').textContent !== 'nothing');
    const touched = (await page.textContent('#touching')).split(/, | and /);
    assert.ok(touched.every(name => kLabels.includes(name)), String(touched));
    const inside = await page.evaluate(() => { // 2 mm behind the surface, where the probe presses: the volume's own name
      const {slices, frames} = window.palpate, i = frames.count - 1, [probe, proxy] = ['probe_m', 'proxy_m'].map(n => frames.triple(n, i));
      const depth = Math.hypot(...probe.map((v, axis) => v - proxy[axis]));
      return slices.wordsAt(proxy.map((v, axis) => v + 0.002 * (probe[axis] - v) / depth)).split(',')[0];
    });
    assert.ok(touched.includes(inside), `${inside} is felt as ${touched}`);

    await page.click('#show-all');
    await page.check('#planes');
    await page.locator('input[aria-label="opacity of Precentral_L"]').fill('0.4');
    await page.waitForTimeout(2000); // at rest, for the picture
    await page.screenshot({path: join(work, 'live-brain-1400-light.png')});
    const small = await openPage(link, {width: 390, height: 844, scheme: 'dark'});
    await small.waitForFunction(() => window.palpate?.frames.count > 0 && window.palpate.shown);
    await small.waitForTimeout(2000);
    await small.screenshot({path: join(work, 'live-brain-390-dark.png'), fullPage: true});
    await close(small);
    await close(page);
  });
