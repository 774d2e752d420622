// SPDX-License-Identifier: Apache-2.0
// Draws the hard cases of docs/contact.md, sub-step by sub-step, with the page of palpate view:
//   PALPATE_WEB=$PWD/build/release/web node scripts/draw_hard_cases.mjs [OUTDIR]
// PALPATE_WEB is where the build made the page (a whole path), PALPATE the command (build/release/palpate). Needs Chromium (Debian package chromium). It makes the scenes, runs and
// exports them, and writes crease_steps.png and leash_steps.png into OUTDIR (docs/pictures).
import {execFileSync} from 'node:child_process';
import {mkdirSync, rmSync} from 'node:fs';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {close, closeBrowser, fileOf, openPage, ready, seek, web, work} from '../tests/page/browser.mjs';
import {writeHardCases} from '../tests/page/hard_cases.mjs';

const kWidth = 460, kHeight = 330; // px, of one sub-step's picture
const source = resolve(dirname(fileURLToPath(import.meta.url)), '..');
const out = resolve(process.argv[2] ?? join(source, 'docs', 'pictures'));
const program = resolve(process.env.PALPATE ?? join(source, 'build', 'release', 'palpate'));
const folder = join(work, 'hard_cases');

/** What is drawn: frames with their sub-steps (from 0) and how much is seen around the proxy, mm; from where. */
const kCases = {
  crease: {from: [0.1, -1, 0.12], opacity: 0.8,
           pictures: [[3, 0, 0.5], [4, 0, 0.5], [4, 1, 0.2], [4, 2, 0.2], [4, 6, 1.8], [4, 7, 0.2]]},
  leash: {from: [0.1, -1, 0.1], opacity: 0.8,
          pictures: [[5, 0, 1.2], [5, 1, 1.2], [5, 2, 1.2], [6, 0, 1.2], [6, 1, 1.2], [6, 2, 1.2]]},
};

/** The page of a recording with all its sub-steps. */
function record(name) {
  const palpate = (...options) => execFileSync(program, options, {cwd: folder, stdio: 'pipe',
    env: {...process.env, PALPATE_CACHE: join(folder, 'cache')}});
  palpate('trace', `${name}.toml`, '--out', name);
  palpate('view', join(name, 'recording.h5'), '-o', `${name}.html`, '--sub-steps', '0-1000', '--page', join(web, 'palpate_view.html'));
  return pathToFileURL(join(folder, `${name}.html`)).href;
}

/** One picture for each sub-step, with the page's own words. */
async function pictures(name) {
  const {from, opacity, pictures: wanted} = kCases[name];
  const page = await openPage(record(name), {width: 1000, height: 900});
  await ready(page);
  await page.addStyleTag({content: `#view { flex: none; width: ${kWidth}px; height: ${kHeight}px; }`});
  await page.selectOption('#trail-span', 'off');
  for (const slider of await page.locator('input[aria-label^="opacity of"]').all()) await slider.fill(String(opacity));
  const drawn = [];
  for (const [frame, step, radius_mm] of wanted) {
    await seek(page, frame);
    await page.evaluate(([at, direction, radius]) => {
      const {palpate} = window;
      palpate.panels.steps.stepTo(at);
      palpate.view.setCut([0, 1, 0], palpate.detail()[at].to_m); // through the proxy of this sub-step; the near side goes
      palpate.view.lookFrom(direction);
      palpate.view.fill(palpate.detail()[at].to_m, radius);
    }, [step, from, radius_mm]);
    await page.waitForFunction(at => document.getElementById('step-words').textContent.startsWith(`sub-step ${at + 1} `), step);
    await page.waitForFunction(() => window.palpate.view.isStill); // the finest picture
    const words = await page.textContent('#step-words'), details = await page.locator('#step-details li').allTextContents();
    const image = (await page.locator('#view').screenshot()).toString('base64');
    drawn.push({frame, words, details, image});
  }
  const legend = await page.innerHTML('#step-legend');
  await close(page);
  return {drawn, legend};
}

async function compose(name) {
  const {drawn, legend} = await pictures(name);
  const escaped = text => text.replace(/&/g, '&amp;').replace(/</g, '&lt;');
  const cells = drawn.map(({frame, words, details, image}) => `<figure><img src="data:image/png;base64,${image}">
    <figcaption><b>Frame ${frame}, ${escaped(words)}</b><br>${details.map(escaped).join('<br>')}</figcaption></figure>`);
  const page = await openPage(fileOf(`${name}_steps.html`, `<!DOCTYPE html><meta charset="utf-8"><style>
    body { margin: 0; width: ${2 * kWidth + 24}px; font: 14px/1.3 sans-serif; color: #1d2329; background: #fff; }
    main { display: grid; grid-template-columns: repeat(2, ${kWidth}px); gap: 12px 24px; }
    figure { margin: 0; } img { display: block; width: ${kWidth}px; border: 1px solid #99a; box-sizing: border-box; }
    p { display: flex; flex-wrap: wrap; gap: 2px 16px; margin: 10px 0; } .key { display: inline-flex; gap: 5px; align-items: center; }
    .swatch { width: 14px; height: 14px; border-radius: 3px; }</style><main>${cells.join('')}</main><p>${legend}</p>`),
    {width: 2 * kWidth + 24, height: 600});
  await page.screenshot({path: join(out, `${name}_steps.png`), fullPage: true});
  await close(page);
  console.log(join(out, `${name}_steps.png`));
}

rmSync(folder, {recursive: true, force: true});
writeHardCases(folder);
mkdirSync(out, {recursive: true});
for (const name of Object.keys(kCases)) await compose(name);
await closeBrowser();
