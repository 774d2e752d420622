// SPDX-License-Identifier: Apache-2.0
// Sub-steps: what the page draws and says of them is what the library told, and that fits the recording, the scene and geometry.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {existsSync, readFileSync, rmSync} from 'node:fs';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {pathToFileURL} from 'node:url';
import {close, closeBrowser, fileOf, openPage, pageText, ready, seek, work} from './browser.mjs';
import {kRadius, sphereScene, withData} from './container.mjs';
import {sceneOf} from './details.mjs';
import {writeHardCases} from './hard_cases.mjs';

const folder = join(work, 'steps');
const palpate = (...options) => execFileSync(process.env.PALPATE, options, {cwd: folder, stdio: 'pipe',
  env: {...process.env, PALPATE_CACHE: join(folder, 'cache')}});
const cases = {crease: {}, leash: {}};
before(() => {
  rmSync(folder, {recursive: true, force: true});
  writeHardCases(folder);
  for (const [name, one] of Object.entries(cases)) {
    palpate('trace', `${name}.toml`, '--out', name);
    palpate('view', join(name, 'recording.h5'), '-o', `${name}.html`, '--sub-steps', '0-1000');
    one.file = join(folder, `${name}.html`);
    one.scene = sceneOf(one.file);
    one.steps = Object.entries(one.scene.details).flatMap(([frame, steps]) => steps.map((step, at) => ({frame: Number(frame), at, step, steps})));
  }
});
after(closeBrowser);

const minus = (a, b) => a.map((v, i) => v - b[i]), dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
const length = v => Math.hypot(...v), distance = (a, b) => length(minus(a, b));
const near = (a, b, tolerance, words) => assert.ok(Math.abs(a - b) <= tolerance, `${words}: ${a} is not ${b} within ${tolerance}`);
const kRounding_m = 1e-12; // of places within 20 mm, after tens of operations

/** Places of a frames.csv. */
function proxies(name) {
  const [head, ...rows] = readFileSync(join(folder, name, 'frames.csv'), 'utf8').trim().split('\n').map(line => line.split(','));
  const columns = ['proxy_x_m', 'proxy_y_m', 'proxy_z_m'].map(column => head.indexOf(column));
  return rows.map(row => columns.map(i => Number(row[i])));
}

test('frames that the recording has not are refused, up to the greatest number', () => {
  assert.throws(() => palpate('view', join('crease', 'recording.h5'), '-o', 'far.html', '--sub-steps',
    '18446744073709551610-18446744073709551615'), error => error.status === 2 && /its frames are 0-9/.test(error.stderr));
  assert.ok(!existsSync(join(folder, 'far.html')));
});

test('the sub-steps of each frame lead from proxy to proxy of the recording, bit by bit', () => {
  for (const [name, {scene}] of Object.entries(cases)) {
    const wanted = proxies(name);
    assert.equal(Object.keys(scene.details).length, wanted.length);
    for (const [frame, steps] of Object.entries(scene.details)) {
      if (frame > 0) assert.deepEqual(steps[0].proxy_m, wanted[frame - 1]);
      steps.slice(1).forEach((step, i) => assert.deepEqual(step.proxy_m, steps[i].to_m));
      assert.deepEqual(steps.at(-1).to_m, wanted[frame]);
    }
  }
});

test('a move ends where it was led to, or at what is said to have stopped it', () => {
  const seen = new Set();
  for (const {steps} of Object.values(cases)) for (const {frame, at, step} of steps) {
    const moves = step.kind === 'goes straight' || step.kind === 'ends the frame';
    assert.equal(Boolean(step.stop), moves && distance(step.to_m, step.wanted_m) > 0, `frame ${frame}, ${at}`);
    if (!step.stop) continue;
    seen.add(step.stop.by);
    near(distance(step.proxy_m, step.stop.at_m) + distance(step.stop.at_m, step.wanted_m), distance(step.proxy_m, step.wanted_m),
         kRounding_m, 'the stop is on the way');
    assert.ok(distance(step.proxy_m, step.to_m) <= distance(step.proxy_m, step.stop.at_m) + kRounding_m);
    if (step.stop.by !== 'leash') continue;
    const {guard_m, length_m} = step.leashes.find(leash => leash.structure === step.stop.structure);
    if (distance(guard_m, step.proxy_m) > 0) // else the guard flies along
      near(distance(step.stop.at_m, guard_m), Math.max(length_m, distance(step.proxy_m, guard_m)), kRounding_m, 'the leash is taut');
  }
  assert.deepEqual([...seen].sort(), ['certificate', 'contact', 'leash']);
});

test('planes that hold have the candidate on them, the others have it in front', () => {
  let both = 0;
  for (const {steps} of Object.values(cases)) for (const {step} of steps) {
    for (const plane of step.planes) {
      const height = dot(plane.normal, minus(step.candidate_m, plane.at_m));
      if (plane.active) near(height, 0, kRounding_m, 'on its plane');
      else assert.ok(height > -kRounding_m);
    }
    both += new Set(step.planes.filter(plane => plane.active).map(plane => plane.structure)).size > 1;
  }
  assert.ok(both > 3, 'the crease holds the proxy with both lobes');
});

test('friction bears what the coefficients of the scene let it', () => {
  const coefficients = new Set();
  let count = 0;
  for (const {step} of cases.crease.steps) for (const friction of step.friction ?? []) {
    const plane = step.planes[friction.plane];
    near(dot(plane.normal, minus(friction.apex_m, plane.at_m)), 0, kRounding_m, 'its apex is on the plane');
    assert.deepEqual(friction.axis, plane.normal);
    coefficients.add(friction.coefficient);
    assert.equal(friction.normal_n > 0, plane.active);
    // In a crease all together bear no more than what draws the proxy: then it may be less than the law's.
    const law_n = friction.coefficient * friction.normal_n;
    if (step.friction.length === 1 && !friction.holds) near(friction.most_n, law_n, 1e-9 * law_n, 'Coulomb');
    if (!friction.holds) near(friction.force_n, friction.most_n, 1e-9, 'it slips');
    else assert.ok(friction.force_n <= law_n * (1 + 1e-5)); // the solver's own tolerance
    ++count;
  }
  assert.ok(count > 20);
  assert.deepEqual([...coefficients].sort(), [0.2, 0.3]);
});

/** What the page has drawn of each sub-step, read off its three.js objects. */
const drawn = (page, all) => page.evaluate(list => {
  const {palpate} = window, {glyphs} = palpate.view, {steps: drawing} = glyphs;
  const at = object => object.position.toArray();
  const along = (object, axis) => object.position.clone().fromArray(axis).applyQuaternion(object.quaternion).toArray();
  return list.map(([frame, step]) => {
    palpate.seek(frame);
    palpate.step = step;
    palpate.showFrame();
    return {
      center: palpate.view.center, proxyIsShown: glyphs.proxy.visible,
      marks: Object.fromEntries(Object.entries(drawing.marks).map(([name, mark]) => [name, mark.visible ? at(mark) : null])),
      planes: drawing.planes.children.map(disc => ({at: at(disc), normal: along(disc, [0, 0, 1]), opacity: disc.material.opacity,
                                                    color: `#${disc.material.color.getHexString()}`})),
      cones: drawing.cones.children.map(cone => ({at: at(cone), axis: along(cone, [0, 1, 0]), scale: cone.scale.toArray()})),
      guards: drawing.guards.children.map(at), reaches: drawing.reaches.children.map(ball => ball.scale.x),
      went: drawing.went.places, words: document.getElementById('step-words').textContent,
      items: [...document.querySelectorAll('#step-list li')].map(li => [li.textContent, li.getAttribute('aria-current')]),
      details: [...document.querySelectorAll('#step-details li')].map(li => li.textContent),
    };
  });
}, all.map(({frame, at}) => [frame, at]));

const kView_mm = 1e-9; // rounding of places and of a turned unit vector in mm

function expectDrawn(found, {at, step, steps}) {
  const mm = place => minus(place, found.center).map(v => 1000 * v);
  const same = (a, b, words) => assert.ok(distance(a, b) < kView_mm, `${words}: ${a} is not ${b}`);
  for (const [mark, place] of [['from', step.proxy_m], ['to', step.to_m], ['candidate', step.candidate_m], ['pull', step.pull_m]])
    same(found.marks[mark], mm(place), mark);
  if (step.stop) same(found.marks.stop, mm(step.stop.at_m), 'stop');
  else assert.equal(found.marks.stop, null);
  assert.equal(found.proxyIsShown, at === steps.length - 1, 'the frame has its proxy after the last sub-step');

  assert.equal(found.planes.length, step.planes.length);
  step.planes.forEach((plane, i) => {
    same(found.planes[i].normal, plane.normal, 'normal');
    near(dot(plane.normal, minus(found.planes[i].at, mm(plane.at_m))), 0, kView_mm, 'the disc is on its plane');
    assert.equal(found.planes[i].opacity > 0.3, plane.active);
    assert.equal(found.planes[i].color === '#00808c', (step.leashes ?? []).some(leash => leash.plane === i), 'colour of a leash');
  });

  const rubbing = (step.friction ?? []).filter(friction => friction.normal_n > 0 && friction.most_n > 0);
  assert.equal(found.cones.length, rubbing.length);
  rubbing.forEach((friction, i) => {
    const {at: middle, axis, scale: [radius, height]} = found.cones[i];
    same(axis, friction.axis, 'axis');
    same(middle.map((v, k) => v + axis[k] * height / 2), mm(friction.apex_m), 'apex');
    near(Math.atan2(radius, height), Math.atan2(friction.most_n, friction.normal_n), 1e-12, 'half-angle');
    near(height, 1000 * friction.normal_n / step.stiffness_n_per_m, kView_mm, 'height');
  });

  found.guards.forEach((guard, i) => {
    const leash = step.leashes.find(one => distance(mm(one.guard_m), guard) < kView_mm);
    assert.ok(leash);
    near(found.reaches[i], 1000 * leash.length_m, kView_mm, 'reach');
  });
  for (const leash of step.leashes ?? [])
    if (leash.plane >= 0 || step.stop?.by === 'leash') assert.ok(found.guards.some(g => distance(g, mm(leash.guard_m)) < kView_mm));
  same(found.went.slice(-3), mm(step.to_m), 'the way ends where the proxy came to');
  same(found.went.slice(0, 3), mm(steps[0].proxy_m), 'and begins where the frame did');

  assert.ok(found.words.startsWith(`sub-step ${at + 1} of ${steps.length}: `));
  assert.equal(found.items.length, steps.length);
  found.items.forEach(([, current], i) => assert.equal(current, i === at ? 'step' : null));
  assert.equal(found.words.slice(found.words.indexOf(': ') + 2), found.items[at][0]);
}

test('planes, stops, leashes and cones are drawn where the library has them', async () => {
  for (const one of Object.values(cases)) {
    const page = await openPage(pathToFileURL(one.file).href);
    await ready(page);
    const found = await drawn(page, one.steps);
    one.steps.forEach((wanted, i) => expectDrawn(found[i], wanted));
    one.words = found.map(({words, details}) => [words, ...details].join('; '));
    await close(page);
  }
});

test('words say how far a move came and what stopped it', () => {
  const numbers = words => [...words.matchAll(/([\d.]+) (mm|µm)/g)].map(([, value, unit]) => Number(value) * (unit === 'mm' ? 1e-3 : 1e-6));
  const phrases = {contact: /stopped where it met (\w+)/, certificate: /stopped by the certificate of (\w+)/, leash: /stopped by the leash of (\w+)/};
  for (const {scene, steps, words} of Object.values(cases)) steps.forEach(({step}, i) => {
    const said = words[i];
    for (const [by, phrase] of Object.entries(phrases)) {
      const found = phrase.exec(said);
      assert.equal(Boolean(found), step.stop?.by === by, said);
      if (found) assert.equal(found[1], scene.structures[step.stop.structure].name);
    }
    if (step.kind !== 'goes straight' || !step.stop || distance(step.proxy_m, step.to_m) < 1e-9) return;
    const [went, asked] = numbers(said); // three digits, or a thousandth of the unit
    near(went, distance(step.proxy_m, step.to_m), Math.max(0.005 * went, 5e-10), said);
    near(asked, distance(step.proxy_m, step.wanted_m), Math.max(0.005 * asked, 5e-10), said);
  });
});

test('keys and buttons step, jump and fill the view; a frame is shown at its end', async () => {
  const page = await openPage(pathToFileURL(cases.crease.file).href);
  await ready(page);
  const count = cases.crease.scene.details[4].length, says = words => page.waitForFunction(
    begin => document.getElementById('step-words').textContent.startsWith(begin), words);
  await seek(page, 4);
  await says(`sub-step ${count} of ${count}`);
  await page.locator('#view canvas').focus();
  await page.keyboard.press('b');
  await says(`sub-step ${count - 1} of`);
  await page.keyboard.press('n');
  await says(`sub-step ${count} of`);
  await page.click('#step-list li:nth-child(2) button');
  await says('sub-step 2 of');
  await page.keyboard.press('j');
  await says(`sub-step 1 of ${cases.crease.scene.details[5].length}`);
  await page.keyboard.press('z');
  const away = () => page.evaluate(() => window.palpate.view.camera.position.distanceTo(window.palpate.view.controls.target));
  const way_mm = 1000 * Math.max(...cases.crease.scene.details[5].map(step => distance(step.proxy_m, step.wanted_m)));
  assert.ok(await away() < 20 * way_mm, 'the way fills a good part of the view');
  await page.click('#play');
  await page.waitForFunction(() => window.palpate.view.glyphs.proxy.visible);
  await close(page);
});

test('a page whose sub-steps tell less than today goes on working', async () => {
  const page = await openPage(fileOf('sphere_steps.html', withData(pageText, sphereScene('playback'))));
  await ready(page);
  await seek(page, 1499);
  assert.equal(await page.isVisible('#steps'), false);
  assert.equal(await page.isVisible('#steps-panel'), false);
  const [first, last] = await drawn(page, [{frame: 1500, at: 0}, {frame: 1500, at: 2}]);
  assert.equal(first.words, 'sub-step 1 of 3: went 2.00 mm of 4.00 mm: stopped by the certificate of bone, which holds for 3.00 mm');
  assert.deepEqual(first.details, ['1 of 2 planes hold: bone', 'forces balance 4.00 mm from here']);
  assert.equal(first.marks.pull, null);
  assert.deepEqual([first.cones.length, first.guards.length], [0, 0]);
  assert.equal(last.details[1], 'forces balance here');
  near(first.planes[0].at[1], -1000 * kRadius, kView_mm, 'the disc is on its plane');
  await close(page);
});
