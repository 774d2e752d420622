// SPDX-License-Identifier: Apache-2.0
// A recording in one file: what the page shows is what the container has.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {after, test} from 'node:test';
import {areasFelt, close, closeBrowser, fileOf, openPage, output, pageText, ready, seek, shown} from './browser.mjs';
import {container, frame, framesOf, kCenter, kFrames, kRadius, sphereScene, withData} from './container.mjs';

const address = fileOf('sphere.html', withData(pageText, sphereScene('playback')));
const page = await openPage(address);
await ready(page);
after(async () => {
  await close(page);
  await closeBrowser();
});
const length = v => Math.hypot(...v);
const depth = f => Math.hypot(...f.probe_m.map((v, i) => v - f.proxy_m[i]));

test('begins with the first frame that felt something', async () => {
  assert.equal(await page.evaluate(() => window.palpate.player.index), 1000);
});

test('numbers are those of the data, bit for bit', async () => {
  for (const i of [0, 999, 1001, 1500, 1777, kFrames - 1]) {
    await seek(page, i);
    const wanted = frame(i);
    const sent = await page.evaluate(at => Object.fromEntries(
      ['probe_m', 'proxy_m', 'force_n'].map(name => [name, window.palpate.frames.triple(name, at)])), i);
    for (const name of ['probe_m', 'proxy_m', 'force_n']) assert.deepEqual(sent[name].map(v => v + 0), wanted[name].map(v => v + 0));
    assert.equal(Number((await output(page, 'force')).value), length(wanted.force_n));
    assert.equal(Number((await output(page, 'depth')).value), 1000 * depth(wanted));
    assert.equal(Number((await output(page, 'clock')).value), wanted.time_s);
    const charts = await page.$$eval('.chart:not([hidden]) output', all => all.map(one => Number(one.dataset.value)));
    assert.deepEqual(charts, [length(wanted.force_n), 1000 * depth(wanted), wanted.sub_steps, wanted.spent_us, wanted.late_us]);
    assert.equal((await output(page, 'touching')).text, wanted.felt ? 'bone' : 'nothing');
    assert.equal((await output(page, 'flags')).text, wanted.flags ? 'solver_cap: give it more steps' : 'none');
  }
});

test('a frame that was not computed has no sub-steps, and stops nothing', async () => {
  await page.evaluate(() => { window.palpate.scene.details = {1500: []}; });
  await seek(page, 1500);
  await shown(page, 1500);
  await seek(page, 1501);
  await shown(page, 1501);
  await page.evaluate(() => { delete window.palpate.scene.details; });
});

test('a surface without a bit of its own is said to be another one', async () => {
  const said = await page.evaluate(() => {
    const {frames} = window.palpate, felt = frames.columns.felt[5];
    frames.columns.felt[5] = 0x80000001;
    window.palpate.announced = undefined;
    window.palpate.announce(5);
    frames.columns.felt[5] = felt;
    return window.palpate.announced;
  });
  assert.match(said, /^Touching bone and another surface\./);
});

test('the scale is that of the plane of the view, also at its edges', async () => {
  const ratios = await page.evaluate(() => {
    const {view} = window.palpate, middle = view.controls.target;
    view.draw(performance.now() + 1e6);
    const right = middle.clone().setFromMatrixColumn(view.camera.matrixWorld, 0);
    return [-0.5, 0, 0.5].map(share => {
      const a = middle.clone().addScaledVector(right, share * view.radius), b = a.clone().addScaledVector(right, 0.1);
      return (view.toScreen(b).x - view.toScreen(a).x) * view.mmPerPixel(a) / 0.1;
    });
  });
  for (const ratio of ratios) assert.ok(Math.abs(ratio - 1) < 1e-6, `${ratios}`);
});

test('the bar of the scale says its length, however small it is', async () => {
  const words = await page.evaluate(() => {
    const {overlay} = window.palpate, own = overlay.view.mmPerPixel, said = [];
    for (const mm of [0.001, 1e-5, 3e-6]) {
      overlay.view.mmPerPixel = () => mm;
      overlay.placeScale();
      said.push([overlay.barWords.textContent, parseFloat(overlay.bar.style.width) * mm]);
    }
    delete overlay.view.mmPerPixel;
    if (overlay.view.mmPerPixel !== own) throw new Error('not put back');
    overlay.placeScale();
    return said;
  });
  for (const [text, mm] of words) {
    const [, number, unit] = /^([\d.]+) (µm|mm) at/.exec(text);
    assert.ok(Math.abs(Number(number) * (unit === 'mm' ? 1 : 1e-3) / mm - 1) < 1e-4, `${text}: ${mm} mm`);
  }
});

test('the drawn probe, proxy and force are where the frame has them', async () => {
  await seek(page, 1300);
  const drawn = await page.evaluate(() => {
    const {probe, proxy, direction} = window.palpate.view.glyphs;
    return [probe.position, proxy.position, direction].map(v => [v.x, v.y, v.z]);
  });
  const f = frame(1300), mm = place => place.map((v, i) => 1000 * (v - kCenter[i]));
  assert.deepEqual(drawn[0], mm(f.probe_m));
  assert.deepEqual(drawn[1], mm(f.proxy_m));
  f.force_n.forEach((v, i) => assert.ok(Math.abs(drawn[2][i] - v / length(f.force_n)) < 1e-15)); // a division's rounding
});

test('scrub bar, keys and steps lead to their frames', async () => {
  await page.$eval('#scrub', bar => {
    bar.value = '1234';
    bar.dispatchEvent(new Event('input'));
  });
  await shown(page, 1234);
  await page.locator('#view canvas').focus();
  for (const [key, index] of [['.', 1235], [',', 1234], ['>', 1334], ['<', 1234], ['End', kFrames - 1], ['Home', 0]]) {
    await page.keyboard.press(key);
    await shown(page, index);
  }
  await page.click('#forth');
  await shown(page, 1);
  const box = await page.locator('.chart .u-over').first().boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2); // the chart's middle is the middle of the time
  await page.waitForFunction(() => window.palpate.player.index > 1);
  const index = await page.evaluate(() => window.palpate.player.index);
  assert.ok(Math.abs(index - (kFrames - 1) / 2) <= kFrames / box.width, `frame ${index}`); // a pixel
});

test('slow motion passes a hundredth of the time, and play ends at the last frame', async () => {
  await seek(page, 1000);
  await page.selectOption('#speed', '0.01');
  const slow = await page.evaluate(() => {
    const {player} = window.palpate;
    player.playing = true;
    player.advance(1.0005); // s; half a frame more, so that rounding does not decide
    player.playing = false;
    return player.index;
  });
  assert.equal(slow, 1010);
  await page.selectOption('#speed', '1');
  await seek(page, kFrames - 50);
  await page.click('#play');
  await shown(page, kFrames - 1);
  assert.equal(await page.textContent('#play'), 'Play');
});

test('at rest the page looks seldom whether anything changed, and a key or the pointer ends the rest', async () => {
  const counted = await page.evaluate(async () => {
    const {beat, view} = window.palpate, work = beat.work, times = [];
    const isQuiet = () => performance.now() - view.touched > 2000 && view.isStill && beat.rest !== undefined;
    while (!isQuiet()) await new Promise(done => setTimeout(done, 50));
    beat.work = (...given) => times.push(performance.now()) && work(...given);
    const began = performance.now();
    do await new Promise(done => setTimeout(done, 1500)); while (times.length < 2);
    beat.work = work;
    return {times, elapsed_ms: performance.now() - began};
  });
  // Between two looks a timer of 100 ms runs out, which is never early by more than a millisecond.
  assert.ok(counted.times.length >= 2 && counted.times.length <= counted.elapsed_ms / 99 + 1, JSON.stringify(counted));
  for (const event of ['keydown', 'pointermove']) {
    const isAwake = await page.evaluate(async one => {
      const {beat} = window.palpate;
      while (beat.rest === undefined) await new Promise(done => setTimeout(done, 1));
      document.body.dispatchEvent(one === 'keydown' ? new KeyboardEvent(one, {key: 'x'}) : new PointerEvent(one));
      return beat.rest === undefined;
    }, event);
    assert.ok(isAwake, event);
  }
});

test('the table has time, mean and greatest force, and the share of the area', async () => {
  await areasFelt(page);
  const cells = await page.$$eval('#felt tbody tr:not([hidden]) td', all => all.map(one => Number(one.dataset.value)));
  let sum = 0, most = 0, time = 0;
  for (let i = 1000; i < kFrames; ++i) {
    const force = length(frame(i).force_n);
    sum += force;
    most = Math.max(most, force);
    time += frame(i).time_s - frame(i - 1).time_s;
  }
  assert.deepEqual(cells.slice(0, 3), [time, sum / 1000, most]);
  // Felt is what is within r = 2 mm of half the equator: a band of angle a to both sides, 2 sin(a/2) = r/R, and half a disc at each
  // end. A sample stands for a place up to r/6 away.
  const r = 0.002, a = 2 * Math.asin(r / (2 * kRadius));
  const share = 100 * (Math.sin(a) / 2 + r * r / (4 * kRadius * kRadius));
  assert.ok(Math.abs(cells[3] - share) < share / 6, `${cells[3]} % is not ${share} %`);
});

test('what is painted is where it was felt', async () => {
  await page.selectOption('#paint', 'touched');
  const wrong = await page.evaluate(() => {
    const surface = window.palpate.view.surfaces.byId(0), coverage = surface.paintOf(surface.level);
    let touched = 0, far = 0;
    for (let v = 0; v < coverage.count; ++v) {
      if (!coverage.isTouched[v]) continue;
      ++touched;
      if (Math.abs(coverage.places[3 * v + 2]) > coverage.radius_mm || coverage.places[3 * v + 1] > coverage.radius_mm) ++far;
    }
    return {touched, far, isColored: surface.material.vertexColors};
  });
  assert.ok(wrong.touched > 10);
  assert.equal(wrong.far, 0); // felt was the half with y < 0 of the equator
  assert.equal(wrong.isColored, true);
  await page.selectOption('#paint', 'none');
});

test('the legend has the colour that what was touched is painted with', async () => {
  await page.selectOption('#paint', 'touched');
  const {painted, swatch} = await page.evaluate(() => {
    const surface = window.palpate.view.surfaces.byId(0), {isTouched} = surface.paintOf(surface.level);
    const color = surface.mesh.geometry.getAttribute('color'), v = isTouched.indexOf(1);
    const key = [...document.querySelectorAll('#legend .key')].find(one => one.textContent === 'painted: touched');
    return {painted: [color.getX(v), color.getY(v), color.getZ(v)],
            swatch: getComputedStyle(key.querySelector('.swatch')).backgroundColor.match(/\d+/g).map(Number)};
  });
  // A vertex has linear light, a swatch the bytes of sRGB.
  const bytes = painted.map(c => 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055));
  assert.ok(swatch.every((v, i) => Math.abs(v - bytes[i]) < 1), `${swatch} is not ${bytes}`);
  await page.selectOption('#paint', 'none');
});

test('structures are hidden, made transparent and cut one by one', async () => {
  await page.uncheck('#show-0');
  await page.locator('input[aria-label="opacity of core"]').fill('0.5');
  await page.selectOption('#cut-axis', '+z');
  await page.uncheck('input[aria-label="cut core"]');
  const state = await page.evaluate(() => window.palpate.view.surfaces.all.map(s =>
    [s.mesh.visible, s.material.opacity, s.material.clippingPlanes.length]));
  assert.deepEqual(state, [[false, 1, 1], [true, 0.5, 0]]);
  await page.check('#show-0');
  await page.selectOption('#cut-axis', 'none');
});

test('where surfaces are cut, a line follows them', async () => {
  await page.selectOption('#cut-axis', '+z'); // through the centre
  await page.waitForFunction(() => window.palpate.view.cutEdge.lines.places.length > 0);
  const {places, facets} = await page.evaluate(() => {
    const {cutEdge, surfaces} = window.palpate.view;
    return {places: cutEdge.lines.places, facets: surfaces.byId(0).facets};
  });
  const rings = facets === 2 * 2 * 12 * 11 ? 12 : 60, radius = 1000 * kRadius;
  let outer = 0;
  for (let i = 0; i < places.length; i += 3) {
    const away = Math.hypot(places[i], places[i + 1]);
    assert.ok(Math.abs(places[i + 2]) < 1e-4, 'on the plane, within single precision');
    const isOuter = away > radius / 2 + 5; // the core has half of it
    outer += isOuter;
    // A chord of the circle is nearer to its centre than the circle by this; positions have 16 bits.
    const wanted = isOuter ? radius : radius / 2, least = Math.cos(Math.PI / (2 * (isOuter ? rings : 12)));
    assert.ok(away < wanted + 0.002 && away > least * wanted - 0.002, `${away} of ${wanted} mm`);
  }
  assert.ok(outer >= 4 * rings, 'two ends for each sector');
  await page.selectOption('#cut-axis', 'none');
  await page.waitForFunction(() => !window.palpate.view.cutEdge.object.visible);
});

test('the level of detail is the finest within the facets that there is time for', async () => {
  const facets = await page.evaluate(() => {
    const {surfaces} = window.palpate.view, of = budget => {
      surfaces.chooseLevels(budget);
      return surfaces.all.map(s => s.facets);
    };
    const found = [of(0), of(10000), of(1e9)];
    window.palpate.view.touch();
    return found;
  });
  const count = rings => 2 * 2 * rings * (rings - 1);
  assert.deepEqual(facets, [[count(12), count(12)], [count(12), count(12)], [count(60), count(12)]]);
});

test('slices show the voxels around the proxy through the window', async () => {
  await seek(page, 1500);
  const voxel = (i, j, k) => Math.max(0, Math.min(255, Math.round(255 *
    (1 - Math.hypot(...[i, j, k].map(v => 0.002 * (v - 31.5))) / 0.064))));
  const grey = (value, from, to) => Math.round(Math.min(255, Math.max(0, 255 * (-1000 + 2550 * value / 255 - from) / (to - from))));
  const read = () => page.evaluate(() => [...document.querySelectorAll('#slices canvas')].map(canvas =>
    canvas.getContext('2d').getImageData(40, 20, 1, 1).data[0]));
  // The proxy is at index (31.5, 11.5, 31.5) but for rounding; the third axis of a picture goes down.
  const at = await page.evaluate(() => window.palpate.slices.slices.map(slice => slice.level));
  assert.deepEqual(await read(), [grey(voxel(40, 20, at[0]), -200, 800), grey(voxel(40, at[1], 43), -200, 800),
                                  grey(voxel(at[2], 40, 43), -200, 800)]);
  await page.locator('#level').fill('0');
  await page.waitForFunction(() => window.palpate.slices.window[0] === -500);
  await page.waitForFunction(() => window.palpate.shown);
  await page.waitForTimeout(100);
  assert.equal((await read())[0], grey(voxel(40, 20, at[0]), -500, 500));
  assert.deepEqual(await page.$$eval('#slices .slice:first-child b', all => all.slice(0, 4).map(b => b.textContent)), ['R', 'L', 'A', 'P']);
});

test('letters say where the patient is', async () => {
  const edges = () => page.$$eval('.edge', all => all.map(one => one.textContent).join(' '));
  for (const [key, words, letters] of [['1', 'the front (A)', 'R L S I'], ['2', 'behind (P)', 'L R S I'], ['3', 'the right (R)', 'P A S I'],
                                       ['4', 'the left (L)', 'A P S I'], ['5', 'above (S)', 'R L P A']]) {
    await page.locator('#view canvas').focus();
    await page.keyboard.press(key);
    await page.waitForFunction(w => document.getElementById('seen-from').textContent === `Seen from ${w}`, words);
    if (key !== '5') assert.equal(await edges(), letters);
  }
});

test('words for screen readers follow what is touched', async () => {
  await seek(page, 10);
  await page.waitForFunction(() => document.getElementById('said').textContent === 'Touching nothing.');
  await seek(page, 1500);
  await page.waitForFunction(() => document.getElementById('said').textContent === 'Touching bone. Flags: solver_cap.');
});

test('points are dropped, listed and saved for Slicer in mm', async () => {
  await seek(page, 1600);
  await page.fill('#mark-name', 'here');
  await page.keyboard.press('Enter');
  assert.deepEqual(await page.$$eval('#marks button', all => all.map(one => one.textContent)), ['start', 'here']);
  const [file] = await Promise.all([page.waitForEvent('download'), page.click('#markups')]);
  const {markups: [list]} = JSON.parse(readFileSync(await file.path(), 'utf8'));
  assert.equal(file.suggestedFilename(), 'sphere.toml.mrk.json');
  assert.equal(list.coordinateSystem, 'LPS');
  assert.deepEqual(list.controlPoints[1].position, frame(1600).proxy_m.map(v => 1000 * v));
});

test('every control has a name and is reached by Tab', async () => {
  const nameless = await page.$$eval('button, input, select', all => all.filter(one => !one.closest('[hidden]') &&
    !one.textContent.trim() && !one.getAttribute('aria-label') && !one.labels?.length).map(one => one.outerHTML));
  assert.deepEqual(nameless, []);
  const unreached = await page.$$eval('button, input, select, summary, #view canvas', all => all.filter(one => one.tabIndex < 0).length);
  assert.equal(unreached, 0);
});

test('the path does not join two trials', async () => {
  const begin = kFrames / 2, {arrays} = framesOf(0, kFrames), step = 0.05; // m, between the trials
  for (let i = begin; i < kFrames; ++i) {
    arrays.trial[i] = 1;
    for (const name of ['probe_m', 'proxy_m']) arrays[name][3 * i + 2] += step;
  }
  const trials = await openPage(fileOf('trials.html', withData(pageText, sphereScene('playback', {}, arrays))));
  await ready(trials);
  await trials.selectOption('#trail-span', 'all');
  await trials.waitForFunction(() => window.palpate.look.span === 'all' && window.palpate.shown);
  const {places, most} = await trials.evaluate(() => ({places: window.palpate.view.trail.places,
                                                       most: window.palpate.view.trail.segmentsAtMost}));
  const stride = Math.ceil((kFrames - 1) / most);
  const place = i => [...arrays.proxy_m.subarray(3 * i, 3 * i + 3)].map(v => 1000 * v);
  const between = (a, b) => length(a.map((v, axis) => v - b[axis]));
  let longest = 0;
  for (let i = 1; i < kFrames; ++i) if (i !== begin) longest = Math.max(longest, between(place(i), place(i - 1)));
  const segments = Array.from({length: places.length / 6}, (_, i) => [places.slice(6 * i, 6 * i + 3), places.slice(6 * i + 3, 6 * i + 6)]);
  const lengths = segments.map(([a, b]) => between(a, b));
  assert.ok(stride * longest < 1000 * step / 10, 'else it says nothing');
  assert.ok(Math.max(...lengths) <= stride * longest + 1e-9, `${Math.max(...lengths)} mm of ${stride} steps of ${longest} mm`);
  for (const z of [0, 1000 * step]) // both are there
    assert.ok(segments.filter(([a]) => Math.abs(a[2] - z) < 1).length > kFrames / stride / 4);
  await close(trials);
});

test('a device that reports more slowly than the loop does not shorten what was felt', async () => {
  const {arrays} = framesOf(0, kFrames); // felt: the second half
  for (let i = 0; i < kFrames; ++i) arrays.time_s[i] = 0.008 * Math.floor(i / 8);
  const slow = await openPage(fileOf('slow.html', withData(pageText, sphereScene('playback', {}, arrays))));
  await ready(slow);
  const time = await slow.$eval('#felt td[data-of=time]', cell => Number(cell.dataset.value));
  assert.ok(Math.abs(time - 1) < 1e-9, `${time} s of 1000 frames at 1 kHz`);
  await close(slow);
});

test('frames between which some were not recorded have their own numbers', async () => {
  const {frames, arrays} = framesOf(0, kFrames);
  arrays.number = Uint32Array.from({length: kFrames}, (_, i) => (i < 1200 ? i : i + 500));
  const gap = await openPage(fileOf('gap.html', withData(pageText, sphereScene('playback',
    {details: undefined, frames: {...frames, columns: {...frames.columns, number: 'number'}}}, arrays))));
  await ready(gap);
  await gap.evaluate(() => window.palpate.seek(1300));
  await shown(gap, 1800);
  await close(gap);
});

test('frames without a trial, as older commands sent them, are one trial', async () => {
  const {frames} = framesOf(0, kFrames), {trial, ...columns} = frames.columns;
  assert.ok(trial);
  const older = await openPage(fileOf('older.html', withData(pageText, sphereScene('playback', {frames: {...frames, columns}}))));
  await ready(older);
  assert.deepEqual(await older.evaluate(() => {
    const {count, columns} = window.palpate.frames;
    return [count, columns.trial?.subarray(0, count).every(one => one === 0)];
  }), [kFrames, true]);
  await close(older);
});

const whole = sphereScene('playback');
const changed = (at, bytes) => {
  const copy = Buffer.from(whole);
  copy.set(bytes, at);
  return copy;
};
const scene = {kind: 'scene', title: 't', mode: 'playback', axes: 'LPS', rate_hz: 1000, view: {center_m: [0, 0, 0], radius_m: 0.1}};
const surface = {id: 0, name: 'a', color: '#ffffff', bit: 0, box_m: [[0, 0, 0], [1, 1, 1]], levels: [{facets: 1, positions: 'p', indices: 'i'}]};
const damaged = {
  'wrong kind of file': [changed(0, [1]), /does not begin with PALPVIEW/],
  'later version': [changed(8, [9]), /has version 9/],
  'cut in the description': [whole.subarray(0, 500), /is cut off/],
  'cut in its head': [whole.subarray(0, 5), /ends after 5 bytes/],
  'cut in the blobs': [whole.subarray(0, whole.length - 5000), /is cut off/],
  'broken description': [changed(20, [0xff, 0xff]), /no JSON object/],
  'frames alone': [container({kind: 'frames'}, {}), /kind "frames"/],
  'missing blob': [container({...scene, structures: [surface]}, {}), /no blob "p"/],
  'corner beyond the vertices': [container({...scene, structures: [surface]}, {p: new Uint16Array(9), i: new Uint32Array([0, 1, 3])}),
    /corner 3 of 3 vertices/],
  'blob of another type': [container({...scene, structures: [surface]}, {p: new Float32Array(9), i: new Uint32Array(3)}), /type "f32"/],
  'column too short': [container({...scene, frames: {first: 0, count: 3, columns: {time_s: 't', probe_m: 't', proxy_m: 't', force_n: 't'}}},
    {t: new Float64Array(3)}), /3 values, and 9 are needed/],
  'volume too small': [container({...scene, volumes: [{name: 'v', shape: [9, 9, 9], to_scene: Array(16).fill(0), voxels: 'v', low: 0, high: 1}]},
    {v: new Uint8Array(8)}), /8 values, and 729 are needed/],
};

test('damaged data gets one clear message and no error', async () => {
  const coded = withData(pageText, whole);
  const texts = [...Object.entries(damaged).map(([name, [bytes, words]]) => [name, withData(pageText, bytes), words]),
                 ['base 64', coded.replace('gzip+base64">', 'gzip+base64">%%'), /no base 64/],
                 ['gzip', coded.replace('gzip+base64">', 'gzip+base64">AAAA'), /no whole gzip/],
                 ['zip', coded.replace('"gzip+base64"', '"zip"'), /coded as "zip"/],
                 ['nothing', pageText, /no data inside/]];
  const broken = await openPage('about:blank');
  for (const [name, text, words] of texts) {
    await broken.goto(fileOf('damaged.html', text), {waitUntil: 'load'});
    await broken.waitForFunction(() => !document.getElementById('problem').hidden);
    assert.match(await broken.textContent('#problem'), words, name);
  }
  await close(broken);
});
