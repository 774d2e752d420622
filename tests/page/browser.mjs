// SPDX-License-Identifier: Apache-2.0
// Chromium, the built page, and what the tests of it share. PALPATE_WEB is the folder where the page was built (with node_modules).
import assert from 'node:assert/strict';
import {existsSync, mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';

export const web = process.env.PALPATE_WEB;
export const program = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome']
  .find(path => path && existsSync(path));
if (!web || !program) {
  console.log(`SKIPPED: ${web ? 'no Chromium here (Debian package chromium)' : 'PALPATE_WEB is not set'}, so that no page was looked at`);
  process.exit(0);
}
export const require = createRequire(join(web, 'package.json'));
export const pageText = readFileSync(join(web, 'palpate_view.html'), 'utf8');
export const work = join(web, 'tests');
mkdirSync(work, {recursive: true});

// The same drawing on every machine: surfaces by SwiftShader, and the page around them without it, as a browser without a graphics
// card does; that takes a third of the time. The rest keeps Chromium off the network.
const browser = await require('playwright-core').chromium.launch({executablePath: program, args: [
  '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-gpu-compositing', '--disable-quic',
  '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync']});
export const closeBrowser = () => browser.close();

const errors = new Map();
const kPatience_ms = 120000; // on a machine that has other things to do

/** A new page that remembers what went wrong in it. `script` runs in it before its own. */
export async function openPage(address, {width = 1200, height = 800, scheme = 'light', motion = 'no-preference', script} = {}) {
  const page = await browser.newPage({viewport: {width, height}, colorScheme: scheme, reducedMotion: motion, acceptDownloads: true});
  page.setDefaultTimeout(kPatience_ms);
  if (script) await page.addInitScript(script);
  const found = [];
  errors.set(page, found);
  page.on('console', message => message.type() === 'error' && found.push(message.text()));
  page.on('pageerror', error => found.push(error.message));
  await page.goto(address, {waitUntil: 'load'});
  return page;
}

/** Ends a page, in which nothing may have gone wrong. */
export async function close(page) {
  await page.close();
  assert.deepEqual(errors.get(page), []);
}

/** The address of a file with this text. */
export function fileOf(name, text) {
  const file = join(work, name);
  writeFileSync(file, text);
  return pathToFileURL(file).href;
}

export const ready = page => page.waitForFunction(() => window.palpate?.frames.count > 0 && window.palpate.shown);

/** Shows a frame and waits until it is shown. */
export async function seek(page, index) {
  await page.evaluate(i => window.palpate.seek(i), index);
  await shown(page, index);
}

/** Waits until this frame is the one shown. */
export const shown = (page, index) => page.waitForFunction(
  i => document.getElementById('clock').textContent.endsWith(`frame ${i}`), index);

/** Waits until areas that were felt are in the table: the first pictures do not wait for them. */
export const areasFelt = page => page.waitForFunction(
  () => [...document.querySelectorAll('#felt tbody tr:not([hidden]) td:last-child')].every(one => one.dataset.value !== 'null'));

/** Text and exact value of an output. */
export const output = (page, id) => page.evaluate(
  one => ({text: document.getElementById(one).textContent, value: document.getElementById(one).dataset.value}), id);
