// SPDX-License-Identifier: Apache-2.0
// Many labels: slices in their colours, planes among the surfaces, the list, and a structure that is pointed at.
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {close, closeBrowser, fileOf, openPage, pageText, ready, seek, work} from './browser.mjs';
import {container, frame, kCenter, withData} from './container.mjs';
import {kColors, kEdge, kNames, kSpacing, labelAt, labelScene, labelVolume} from './label_scene.mjs';

after(closeBrowser);

const address = fileOf('labels.html', withData(pageText, labelScene('playback')));
const page = await openPage(address, {width: 1400, height: 900});
await ready(page);
after(() => close(page));
await seek(page, 1500);

/** Colour of a pixel of a slice as the page has it, and the place of the scene that it stands for. */
const pixel = (one, x, y) => page.evaluate(([i, px, py]) => {
  const slice = window.palpate.slices.slices[i], at = 4 * (px + py * slice.width);
  return {rgba: [...slice.image.data.subarray(at, at + 4)], place: slice.grid.place(slice.indexAt([px + 0.5, py + 0.5], slice.level))};
}, [one, x, y]);

const rgb = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16));

test('labels lie over the slices in their colours, each pixel by the label voxel that its middle is in', async () => {
  const seen = new Set();
  await page.evaluate(() => window.palpate.slices.setOpacity(1));
  await seek(page, 1499); // drawn with that: of a frame that is shown already nothing is drawn anew
  for (const one of [0, 1, 2])
    for (let y = 3; y < 64; y += 5)
      for (let x = 3; x < 64; x += 5) {
        const {rgba, place} = await pixel(one, x, y);
        const voxel = place.map((v, i) => kCenter[i] + kSpacing * Math.round((v - kCenter[i]) / kSpacing));
        const label = labelAt(voxel);
        seen.add(label);
        if (label === 1 || label === 2) assert.deepEqual(rgba, [...rgb(kColors[label - 1]), 255], `slice ${one}, ${x}, ${y}`);
        // What no structure has is half as strong.
        if (label === 3) assert.ok(rgba[0] >= 127 && rgba[1] < 128 && rgba[1] === rgba[2], String(rgba));
        if (label === 0) assert.ok(rgba[0] === rgba[1] && rgba[1] === rgba[2], String(rgba));
      }
  assert.deepEqual([...seen].sort(), [0, 1, 2, 3]);
});

test('the words say the label and the value at the proxy, and those under the pointer', async () => {
  await seek(page, 1501);
  await page.waitForFunction(() => /^At the proxy: (Bone|no label), -?\d/.test(document.getElementById('slice-words').textContent));
  const axial = page.locator('#slices canvas').first();
  await axial.scrollIntoViewIfNeeded();
  const box = await axial.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2); // the axial slice's middle is the core's
  assert.match(await page.textContent('#slice-words'), /^Under the pointer: Core, -?\d+(\.\d+)? HU$/);
  await page.mouse.move(5, 5);
  assert.match(await page.textContent('#slice-words'), /^At the proxy: /);
});

test('a structure that is hidden is hidden in the slices too, and so is its surface', async () => {
  const core = async () => (await pixel(0, 32, 32)).rgba;
  await page.evaluate(() => window.palpate.slices.setOpacity(1));
  await seek(page, 1502);
  assert.deepEqual(await core(), [...rgb(kColors[1]), 255]);
  await page.uncheck('#show-1');
  await page.waitForFunction(color => {
    const {slices, view} = window.palpate, {image, width} = slices.slices[0], at = 4 * (32 + 32 * width);
    return image.data[at] === image.data[at + 1] && image.data[at] !== color && !view.surfaces.byId(1).mesh.visible;
  }, rgb(kColors[1])[0]);
  await page.check('#show-1');
  await page.waitForFunction(() => window.palpate.view.surfaces.byId(1).mesh.visible);
});

test('the planes among the surfaces have the pictures of the slices, and go through the proxy', async () => {
  assert.equal(await page.evaluate(() => window.palpate.view.planes.isShown), false);
  await page.check('#planes');
  await page.selectOption('#cut-axis', '+z'); // no cut applies to them
  await seek(page, 1600);
  const planes = await page.evaluate(() => window.palpate.view.planes.planes.map(({mesh, texture, slice}) => ({
    corners: [...mesh.geometry.getAttribute('position').array], isSame: texture.image.data === slice.image.data,
    isCut: (mesh.material.clippingPlanes ?? []).length > 0, isVisible: mesh.visible, through: slice.through})));
  assert.equal(planes.length, 3);
  const proxy = frame(1600).proxy_m.map((v, i) => 1000 * (v - kCenter[i]));
  for (const {corners, isSame, isCut, isVisible, through} of planes) {
    assert.deepEqual([isSame, isCut, isVisible], [true, false, true]);
    for (let corner = 0; corner < 4; ++corner)
      assert.ok(Math.abs(corners[3 * corner + through] - proxy[through]) < 1e-5, 'a corner is not in the plane of the proxy'); // f32, mm
    // 64 voxels of 2 mm from edge to edge.
    for (const axis of [0, 1, 2].filter(one => one !== through)) {
      const values = [0, 1, 2, 3].map(corner => corners[3 * corner + axis]);
      assert.ok(Math.abs(Math.max(...values) - Math.min(...values) - 128) < 1e-4);
    }
  }
  await page.waitForTimeout(1200); // at rest, as fine as may be
  await page.screenshot({path: join(work, 'labels-planes.png')});
  await page.selectOption('#cut-axis', 'none');
  await page.locator('#view canvas').focus();
  await page.keyboard.press('s');
  await page.waitForFunction(() => !window.palpate.view.planes.isShown);
});

test('the list is searched, shown and hidden as a whole, and each has its transparency', async () => {
  const shown = () => page.evaluate(() => window.palpate.view.surfaces.all.filter(s => s.mesh.visible).map(s => s.structure.name));
  await page.fill('#filter', 'left nucl');
  assert.equal(await page.textContent('#filter-words'), '5 of 12');
  assert.equal(await page.locator('.structure:visible').count(), 5);
  await page.click('#hide-all'); // those that are left
  assert.deepEqual(await shown(), kNames.filter(name => !name.endsWith('left')));
  await page.click('#show-all');
  assert.deepEqual(await shown(), kNames);
  await page.fill('#filter', '');
  await page.click('#hide-all');
  assert.deepEqual(await shown(), []);
  await page.click('#show-all');
  await page.locator('input[aria-label="opacity of bone"]').fill('0.3');
  assert.equal(await page.evaluate(() => window.palpate.view.surfaces.byId(0).material.opacity), 0.3);
});

/** Where a place of the page's frame is on the screen. */
const screen = place_m => page.evaluate(place => {
  const {view} = window.palpate, {x, y} = view.toScreen(view.glyphs.proxy.position.clone().set(...view.toView(place)));
  const box = view.canvas.getBoundingClientRect();
  return [box.left + x, box.top + y];
}, place_m);

test('what the pointer is over is named, and a click selects it in the list', async () => {
  await page.locator('#view canvas').focus();
  await page.keyboard.press('5'); // from above
  await page.waitForFunction(() => document.getElementById('seen-from').textContent.includes('(S)'));
  const middle = kCenter.map((v, axis) => v + 0.055 * [Math.cos(0.4 * Math.PI), Math.sin(0.4 * Math.PI), 0][axis]); // of the third
  await page.mouse.move(...await screen(middle));
  await page.waitForFunction(() => !document.getElementById('pointed').hidden);
  assert.equal(await page.textContent('#pointed'), 'Nucleus 3 left');
  await page.mouse.down();
  await page.mouse.up();
  assert.deepEqual(await page.$$eval('.structure.selected', all => all.map(one => one.textContent)), ['Nucleus 3 leftcut']);
  assert.ok(await page.evaluate(() => {
    const [row, list] = [document.querySelector('.structure.selected'), document.getElementById('structures')].map(e => e.getBoundingClientRect());
    return row.top >= list.top - 1 && row.bottom <= list.bottom + 1;
  }), 'its row is not in sight');
  assert.ok(await page.evaluate(() => window.palpate.view.surfaces.byId(4).material.emissive.getHex() !== 0));
  await page.waitForFunction(() => document.getElementById('said').textContent === 'Nucleus 3 left, hard');
  await page.mouse.move(...await screen(kCenter.map((v, i) => v + [0.04, 0.055, 0][i]))); // beside all
  await page.waitForFunction(() => document.getElementById('pointed').hidden);
  await page.mouse.down();
  await page.mouse.up();
  assert.equal(await page.locator('.structure.selected').count(), 0);
  await page.focus('#show-2'); // by keyboard
  assert.equal(await page.evaluate(() => window.palpate.panels.structures.selected.structure.id), 2);
});

test('a surface that is cut away is not pointed at', async () => {
  await page.locator('input[aria-label="opacity of bone"]').fill('1');
  const over = async () => {
    await page.mouse.move(3, 3);
    await page.mouse.move(...await screen(kCenter));
    await page.waitForTimeout(100);
    return page.textContent('#pointed');
  };
  assert.equal(await over(), 'bone');
  await page.selectOption('#cut-axis', '+z'); // from above: the near half is away, and the core is seen
  await page.uncheck('input[aria-label="cut core"]');
  assert.equal(await over(), 'core');
  await page.selectOption('#cut-axis', 'none');
});

test('without a volume of numbers the labels stand alone, opaque on black', async () => {
  const alone = await openPage(fileOf('labels_alone.html', withData(pageText, labelScene('playback', {volumes: []}))));
  await ready(alone);
  await seek(alone, 1500);
  const found = await alone.evaluate(() => {
    const {slices} = window.palpate, {image, width, height} = slices.slices[0], middle = 4 * (20 + 20 * width);
    return {width, height, core: [...image.data.subarray(middle, middle + 4)], corner: [...image.data.subarray(0, 4)],
            hidden: ['volume-row', 'labels-opacity'].map(id => document.getElementById(id).hidden), words: document.getElementById('slice-words').textContent};
  });
  assert.deepEqual([found.width, found.height], [kEdge, kEdge]);
  assert.deepEqual(found.core, [...rgb(kColors[1]), 255]);
  assert.deepEqual(found.corner, [0, 0, 0, 0]);
  assert.deepEqual(found.hidden, [true, true]);
  assert.match(found.words, /^At the proxy: (Bone|no label)$/);
  await close(alone);
});

test('a damaged label volume is said', async () => {
  const {voxels, entry} = labelVolume();
  for (const [changes, words] of [[{labels: entry.labels.slice(0, 2)}, /has label 3 of 2/], [{shape: [2, 2, 2]}, /and 8 are needed/]]) {
    const bytes = container({kind: 'scene', title: 't', mode: 'playback', axes: 'LPS', rate_hz: 1000,
                             label_volumes: [{...entry, ...changes}]}, {atlas: voxels});
    const broken = await openPage(fileOf('damaged_labels.html', withData(pageText, bytes)));
    await broken.waitForFunction(() => !document.getElementById('problem').hidden);
    assert.match(await broken.textContent('#problem'), words);
    await close(broken);
  }
});
