// SPDX-License-Identifier: Apache-2.0
// What a reader sees: text that is large and dark enough, nothing over anything else, nothing beyond the page. Pictures are kept.
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {close, closeBrowser, fileOf, openPage, pageText, ready, seek, work} from './browser.mjs';
import {sphereScene, withData} from './container.mjs';
import {measure} from './measure.mjs';

const address = fileOf('layout.html', withData(pageText, sphereScene('playback', {device: 'A device with a long name, recording to recording-with-a-long-name-001.h5'})));
after(closeBrowser);

for (const [width, height] of [[1200, 800], [390, 844], [1920, 1080]])
  test(`${width} x ${height}: all text is legible and nothing overlaps, light and dark`, async () => {
    const page = await openPage(address, {width, height});
    await ready(page);
    await page.selectOption('#paint', 'longest');
    for (const scheme of ['light', 'dark']) {
      await page.emulateMedia({colorScheme: scheme});
      for (const index of [1500, 1700]) {
        await seek(page, index);
        for (const key of ['1', '4', '6']) { // where the force's words come to other letters
          await page.locator('#view canvas').focus();
          await page.keyboard.press(key);
          await page.waitForTimeout(250);
          await page.waitForFunction(() => !window.palpate.view.isDirty);
          assert.deepEqual(await page.evaluate(measure), []);
        }
      }
      await page.screenshot({path: join(work, `playback-${width}-${scheme}.png`), fullPage: width < 600});
    }
    await close(page);
  });

test('the measure sees what it is for', async () => {
  const page = await openPage(address, {width: 390, height: 844});
  await ready(page);
  const found = await page.evaluate(`{
    document.querySelector('header').insertAdjacentHTML('afterbegin', '<p style="font-size:9px;color:#eee;position:absolute">tiny</p>' +
      '<p style="width:500px;white-space:nowrap;position:absolute;left:0;font-size:30px">much too wide for such a small page, this is</p>');
    (${measure})();
  }`);
  for (const words of ['text of 9 px: "tiny"', 'contrast 1', 'beyond the page: "much too wide', '"tiny" over'])
    assert.ok(found.some(line => line.includes(words)), `${words} is not in ${found}`);
  await close(page);
});
