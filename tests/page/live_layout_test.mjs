// SPDX-License-Identifier: Apache-2.0
// What a reader of a live page sees, hears and reaches: text, order of the focus, words that are read out, nothing that moves by itself.
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {close, closeBrowser, openPage, pageText, ready, work} from './browser.mjs';
import {kCenter} from './container.mjs';
import {FakeServer} from './fake_server.mjs';
import {labelScene} from './label_scene.mjs';
import {measure} from './measure.mjs';

/** A loop's page with many structures, long names of gains, points, everything that can be pressed pressed. */
const kLong = 'Frontal_Inferior_Orbital_part_of_the_left_hemisphere';
const server = new FakeServer(pageText);
server.scene = labelScene('live', {effects: [0, 1, 2].map(id => (
  {id, name: `${kLong}_${id}`, kind: 'surface', parts: [{name: 'strength', gain: 1, most: 1}]}))});
const live = await server.listen();
after(async () => {
  await closeBrowser();
  server.close();
});

for (const [width, height] of [[1400, 900], [390, 844]])
  for (const scheme of ['light', 'dark'])
    test(`live, ${width} x ${height}, ${scheme}: all text is legible, nothing overlaps, nothing moves by itself`, async () => {
      const page = await openPage(live, {width, height, scheme, motion: 'reduce'});
      await page.waitForFunction(() => document.getElementById('link').textContent === 'connected');
      server.sendFrames(1400, 20, 0);
      server.send(JSON.stringify({say: '', state: {mouse: true, frozen: true, recording: true, file: 'live/recording-001.h5', device: 'page',
        marks: [{name: `A point with a long name, ${kLong}`, at_m: kCenter, time_s: 1.5, felt: 'bone'}]}}));
      await ready(page);
      await page.waitForSelector('#record[aria-pressed=true]');
      await page.click('#hand');
      await page.focus('#show-3');
      await page.evaluate(() => document.querySelectorAll('details').forEach(one => (one.open = true)));
      await page.evaluate(() => window.scrollTo(0, 0)); // the transport stays at the top of a phone's screen, over what is scrolled
      await page.waitForTimeout(300);
      await page.waitForFunction(() => !window.palpate.view.isDirty);
      assert.deepEqual(await page.evaluate(measure), []);
      assert.equal(await page.evaluate(() => document.getAnimations().length), 0);
      const moving = await page.evaluate(() => [...document.querySelectorAll('*')].map(one => getComputedStyle(one))
        .filter(style => style.transitionDuration !== '0s' || style.animationName !== 'none' || style.scrollBehavior === 'smooth').length);
      assert.equal(moving, 0);
      await page.screenshot({path: join(work, `live-${width}-${scheme}.png`), fullPage: width < 600});
      await close(page);
    });

test('Tab goes through the controls in the order in which they are seen, and words that change are not read out', async () => {
  const page = await openPage(live);
  await page.waitForFunction(() => document.getElementById('link').textContent === 'connected');
  server.sendFrames(1400, 20, 0);
  server.send(JSON.stringify({say: '', state: {mouse: true, marks: []}}));
  await ready(page);
  await page.waitForSelector('#hand:visible');
  const before = await page.evaluate(() => {
    const live = [...document.querySelectorAll('output, [aria-live], [role=status], [role=alert]')]
      .filter(one => (one.getAttribute('aria-live') ?? 'polite') !== 'off').map(one => one.id);
    return {live, toolbars: document.querySelectorAll('[role=toolbar]').length};
  });
  // Two of these answer to what a user chooses among data; a toolbar would promise arrow keys.
  assert.deepEqual(before, {live: ['problem', 'label-count', 'choice-words', 'said'], toolbars: 0});
  const order = [];
  await page.evaluate(() => document.activeElement.blur());
  for (let i = 0; i < 200; ++i) {
    await page.keyboard.press('Tab');
    const at = await page.evaluate(() => {
      const one = document.activeElement, all = [...document.querySelectorAll('*')];
      const style = getComputedStyle(one);
      return one === document.body ? null : {place: all.indexOf(one), name: one.id || one.textContent || one.ariaLabel,
        isSeen: one.getClientRects().length > 0, isMarked: style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 1};
    });
    if (!at || order.some(one => one.place === at.place)) break;
    order.push(at);
  }
  assert.ok(order.length > 40, `${order.length} controls`);
  order.forEach((one, i) => {
    assert.ok(i === 0 || one.place > order[i - 1].place, `${one.name} comes after ${order[i - 1]?.name}`);
    assert.ok(one.isSeen && one.isMarked, `${one.name} has the focus, and that is not seen`);
  });
  await close(page);
});
