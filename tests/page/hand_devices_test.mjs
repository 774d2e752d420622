// SPDX-License-Identifier: Apache-2.0
// A SpaceMouse and the device's button in the page. No real cap was at hand: the browser's side of one is played here.
import assert from 'node:assert/strict';
import {after, test} from 'node:test';
import {close, closeBrowser, openPage, pageText} from './browser.mjs';
import {frame} from './container.mjs';
import {FakeServer} from './fake_server.mjs';

const server = new FakeServer(pageText, {marks: [], details: undefined});
const address = await server.listen();
after(async () => {
  await closeBrowser();
  server.close();
});

/** A page whose loop leaves the device to it, seen from the front: right is +x, up +z, towards the reader -y. */
async function openLive(script) {
  const page = await openPage(address, {script});
  await page.waitForFunction(() => document.getElementById('link').textContent === 'connected' && window.palpate);
  server.send(JSON.stringify({say: '', kind: 'info', state: {mouse: true, marks: []}}));
  server.sendFrames(0, 20, 0);
  await page.waitForFunction(() => window.palpate.frames.count === 20 && !document.getElementById('hand').hidden);
  await page.locator('#view canvas').focus();
  await page.keyboard.press('1');
  server.take('probe');
  return page;
}

/** What a browser with WebHID has: one cap, that the reader has to allow. */
function fakeHid() {
  const cap = new EventTarget();
  Object.assign(cap, {vendorId: 0x256f, productId: 0xc62e, productName: 'SpaceMouse Wireless', opened: false,
    collections: [{usagePage: 1, usage: 8}],
    open: async () => (cap.opened = true), close: async () => (cap.opened = false)});
  /** A report of 16-bit numbers, little-endian. */
  window.report = (reportId, numbers, width = 2) => {
    const data = new DataView(new ArrayBuffer(width * numbers.length));
    numbers.forEach((value, i) => (width === 2 ? data.setInt16(2 * i, value, true) : data.setUint8(i, value)));
    cap.oninputreport?.({reportId, data, device: cap});
  };
  window.hid = {asked: [], isAllowed: true, cap};
  const hid = new EventTarget();
  Object.assign(hid, {
    getDevices: async () => [],
    requestDevice: async ({filters}) => {
      window.hid.asked.push(filters);
      return window.hid.isAllowed ? [cap] : [];
    }});
  window.unplug = () => hid.dispatchEvent(Object.assign(new Event('disconnect'), {device: cap}));
  Object.defineProperty(navigator, 'hid', {value: hid});
}

/** Pushes the cap for a while, as it does: a report every 8 ms. Gives back how long, s, and the ways that were sent, m. */
async function push(page, numbers, ms) {
  server.take('probe');
  await page.evaluate(([values, length]) => new Promise(done => {
    let reports = 0; // a browser that stands still for that long says some all the same
    const end = performance.now() + length, timer = setInterval(() => {
      window.report(1, values);
      if (++reports < 10 || performance.now() < end) return;
      clearInterval(timer);
      window.report(1, values.map(() => 0));
      done();
    }, 8);
  }), [numbers, ms]);
  await page.waitForFunction(() => !window.palpate.hand.isDriven && !window.palpate.hand.isMoved);
  await page.evaluate(() => window.palpate.send({do: 'pushed'})); // by the socket, behind all places
  while (!server.commands.some(command => command.do === 'pushed')) await new Promise(done => setTimeout(done, 5));
  const start = frame(19).probe_m;
  return server.take('probe').map(({at_m}) => at_m.map((v, i) => v - start[i]));
}

test('a cap moves the hand along the view, as long and as strongly as it is pushed', async () => {
  const page = await openLive(fakeHid);
  assert.equal(await page.isVisible('#space-mouse'), true);
  await page.click('#space-mouse');
  await page.waitForSelector('#space-mouse[aria-pressed=true]');
  assert.deepEqual(await page.evaluate(() => window.hid.asked), [[{vendorId: 0x046d, usagePage: 1, usage: 8}, {vendorId: 0x256f, usagePage: 1, usage: 8}]]);

  // The cap counts right, towards the reader, down; seen from the front: +x, -y, -z.
  for (const [numbers, axis, sign] of [[[350, 0, 0], 0, 1], [[0, 350, 0], 1, -1], [[0, 0, 350], 2, -1], [[-350, 0, 0], 0, -1]]) {
    const ways = await push(page, [...numbers, 0, 0, 0], 1000);
    const lengths = ways.map(way => Math.hypot(...way)), farthest = ways[lengths.indexOf(Math.max(...lengths))];
    assert.ok(ways.length > 2, `${ways.length} places`);
    [0, 1, 2].filter(other => other !== axis).forEach(other => assert.ok(Math.abs(farthest[other]) < 1e-6, `${farthest}`));
    // 0.1 m/s: over 1 s 100 mm, but for a picture at each end, and 0.1 s until silence would have stopped it; less where
    // pictures are slow, as the hand goes on for at most 0.05 s with each.
    assert.ok(sign * farthest[axis] > 0.004 && sign * farthest[axis] < 0.12, `${numbers}: ${farthest}`);
    // Where a picture takes longer than 0.1 s the cap was silent in it, and the hand begins anew at the probe, which stays
    // where it is here.
    ways.slice(1).forEach((way, i) => assert.ok([ways[i], [0, 0, 0]].some(from =>
      Math.hypot(...way.map((v, k) => v - from[k])) <= 0.1 * 0.05 + 1e-9), `faster than 0.1 m/s: ${ways[i]} to ${way}`));
  }
  assert.deepEqual(await push(page, [17, -17, 10, 0, 0, 0], 100), []); // within the dead zone of 5 %
  assert.ok(await page.evaluate(() => { // beyond the full deflection, and in two directions at once, it is no faster
    const {spaceMouse} = window.palpate;
    window.report(1, [500, 500, 0, 0, 0, 0]);
    return Math.abs(Math.hypot(...spaceMouse.deflection(performance.now())) - 1) < 1e-12;
  }));
  await close(page);
});

test('a cap that falls silent stands still, and so does one while the probe is frozen', async () => {
  const page = await openLive(fakeHid);
  await page.click('#space-mouse');
  await page.waitForSelector('#space-mouse[aria-pressed=true]');
  await page.evaluate(async () => { // until it is seen, and no more
    while (!window.palpate.hand.isDriven) {
      window.report(1, [350, 0, 0, 0, 0, 0]);
      await new Promise((resolve) => setTimeout(resolve, 8));
    }
  });
  await page.waitForFunction(() => window.palpate.hand.isDriven === false);
  server.send(JSON.stringify({state: {frozen: true}}));
  await page.waitForFunction(() => window.palpate.state.frozen);
  assert.deepEqual(await push(page, [350, 0, 0, 0, 0, 0], 100), []);
  await close(page);
});

test("the cap's first button is the device's, and an unplugged cap lets it go", async () => {
  const page = await openLive(fakeHid);
  await page.click('#space-mouse');
  await page.waitForSelector('#space-mouse[aria-pressed=true]');
  await page.evaluate(() => window.report(3, [2, 0], 1)); // another one
  await page.evaluate(() => window.report(3, [3, 0], 1));
  assert.deepEqual(await server.next('button'), {do: 'button', on: true});
  await page.evaluate(() => window.unplug());
  assert.deepEqual(await server.next('button'), {do: 'button', on: false});
  await page.waitForSelector('#space-mouse[aria-pressed=false]');
  assert.equal(await page.evaluate(() => window.hid.cap.opened), false);
  await close(page);
});

test('who does not allow it, or may not open it, goes on without', async () => {
  const page = await openLive(fakeHid);
  await page.evaluate(() => (window.hid.isAllowed = false));
  await page.click('#space-mouse');
  await page.waitForFunction(() => window.hid.asked.length === 1);
  assert.equal(await page.getAttribute('#space-mouse', 'aria-pressed'), 'false');
  await page.evaluate(() => {
    window.hid.isAllowed = true;
    window.hid.cap.open = async () => { throw new Error('Failed to open the device.'); };
  });
  await page.click('#space-mouse');
  await page.waitForFunction(() => document.getElementById('link').textContent === 'The SpaceMouse cannot be opened: Failed to open the device.');
  assert.equal(await page.getAttribute('#space-mouse', 'aria-pressed'), 'false');
  await close(page);
});

test('without WebHID a cap that the browser has as a gamepad does; without either there is no such button', async () => {
  const page = await openLive(() => {
    Object.defineProperty(navigator, 'hid', {value: undefined});
    window.pads = [null];
    navigator.getGamepads = () => window.pads;
  });
  assert.equal(await page.isVisible('#space-mouse'), false);
  await page.evaluate(() => {
    window.pads = [{id: 'Some Gamepad (Vendor: 045e Product: 028e)', axes: [1, 0], buttons: []}, null];
    dispatchEvent(new Event('gamepadconnected'));
  });
  assert.equal(await page.isVisible('#space-mouse'), false);
  await page.evaluate(() => {
    window.pads.push({id: '3Dconnexion SpaceNavigator (Vendor: 046d Product: c626)', axes: [0, 0, -1, 0, 0, 0], buttons: [{pressed: false}]});
    dispatchEvent(new Event('gamepadconnected'));
  });
  await page.click('#space-mouse');
  let {at_m} = await server.next('probe');
  if (at_m[2] === frame(19).probe_m[2]) ({at_m} = await server.next('probe')); // a first picture may take no time
  assert.ok(at_m[2] > frame(19).probe_m[2], String(at_m)); // pulled up
  await page.evaluate(() => (window.pads[2].buttons[0].pressed = true));
  assert.deepEqual(await server.next('button'), {do: 'button', on: true});
  await page.evaluate(() => { // a hand that is frozen has its button
    window.palpate.state.frozen = true;
    window.pads[2].buttons[0].pressed = false;
  });
  assert.deepEqual(await server.next('button'), {do: 'button', on: false});
  await page.evaluate(() => (window.pads[2].buttons[0].pressed = true));
  assert.deepEqual(await server.next('button'), {do: 'button', on: true});
  await page.evaluate(() => {
    window.palpate.state.frozen = false;
    window.pads.length = 0;
    dispatchEvent(new Event('gamepaddisconnected'));
  });
  assert.deepEqual(await server.next('button'), {do: 'button', on: false});
  await page.waitForSelector('#space-mouse:not(:visible)', {state: 'attached'});
  await close(page);
});

test("the device's button is down while the page's is, by pointer, by key and by a screen reader's click", async () => {
  const page = await openLive();
  const next = async on => assert.deepEqual(await server.next('button'), {do: 'button', on});
  await page.hover('#button');
  await page.mouse.down();
  await next(true);
  assert.equal(await page.getAttribute('#button', 'aria-pressed'), 'true');
  await page.mouse.move(5, 5);
  await page.mouse.up(); // elsewhere
  await next(false);
  await page.locator('#view canvas').focus();
  await page.keyboard.down('p');
  await next(true);
  await page.keyboard.down('p'); // repeats
  await page.waitForTimeout(50);
  assert.deepEqual(server.take('button'), []);
  await page.keyboard.up('p');
  await next(false);
  await page.focus('#button');
  await page.keyboard.press('Space');
  await next(true);
  await next(false);
  await page.evaluate(() => document.getElementById('button').click());
  await next(true);
  await next(false);
  await page.locator('#view canvas').focus();
  await page.keyboard.down('p');
  await next(true);
  await page.focus('#mark-name'); // it comes up wherever the focus is by then
  await page.keyboard.up('p');
  await next(false);
  await page.evaluate(() => { // a page that stood still for a while gets all of them at once
    for (const kind of ['keydown', 'keyup', 'keydown', 'keyup'])
      document.body.dispatchEvent(new KeyboardEvent(kind, {key: 'p', bubbles: true}));
  });
  const sent = [];
  for (let tries = 0; tries < 500 && sent.length < 4; ++tries) {
    await page.waitForTimeout(20);
    sent.push(...server.take('button'));
  }
  assert.deepEqual(sent.map(command => command.on), [true, false, true, false]);
  await page.focus('#mark-name'); // a name with p presses nothing
  await page.keyboard.type('pp');
  await page.waitForTimeout(50);
  assert.deepEqual(server.take('button'), []);
  await close(page);
});
