// SPDX-License-Identifier: Apache-2.0
// How long a page that plays a recording takes to open: PALPATE_WEB=$PWD/build/release/web node tests/page/open_time.mjs PAGE.html
// Says its size, and the time from its address to its first picture: five times, sorted.
import {statSync} from 'node:fs';
import {resolve} from 'node:path';
import {pathToFileURL} from 'node:url';
import {close, closeBrowser, openPage} from './browser.mjs';

const file = resolve(process.argv[2]), times = [];
for (let i = 0; i < 5; ++i) {
  const page = await openPage(pathToFileURL(file).href);
  times.push(await page.evaluate(() => new Promise(done => {
    const look = () => (window.palpate?.shown ? requestAnimationFrame(() => done(performance.now())) : requestAnimationFrame(look));
    look();
  })));
  await close(page);
}
await closeBrowser();
const seconds = times.sort((a, b) => a - b).map(time => (time / 1000).toFixed(2)).join(' ');
console.log(`${file}: ${(statSync(file).size / 1e6).toFixed(1)} MB, opened in ${seconds} s`);
