// SPDX-License-Identifier: Apache-2.0
// palpate view --png and --film: the pictures are of the frames that were asked for, the same each time, and nothing else stays.
// PALPATE is the command, PALPATE_SOURCE the checkout.
import assert from 'node:assert/strict';
import {execFileSync, spawn, spawnSync} from 'node:child_process';
import {copyFileSync, existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, test} from 'node:test';
import {pathToFileURL} from 'node:url';
import {close, closeBrowser, openPage, program, work} from './browser.mjs';

const folder = join(work, 'pictures'), scene = join(folder, 'examples', 'phantom.toml');
const temporary = mkdtempSync(join(tmpdir(), 'pictures-'));
const recording = join('trace', 'recording.h5');
const surroundings = {...process.env, PALPATE_CACHE: join(folder, 'cache'), PALPATE_BROWSER: program, TMPDIR: temporary};
const run = (options, more = {}) => spawnSync(process.env.PALPATE, options, {cwd: folder, encoding: 'utf8', env: {...surroundings, ...more}});
const palpate = (...options) => {
  const {status, stderr} = run(options);
  assert.equal(status, 0, stderr);
};
rmSync(folder, {recursive: true, force: true});
for (const name of ['examples', 'demo-output/data']) mkdirSync(join(folder, name), {recursive: true});
copyFileSync(join(process.env.PALPATE_SOURCE, 'examples', 'phantom.toml'), scene);
palpate('phantom', 'demo-output/data/phantom.nrrd');
palpate('trace', scene, '--frames', '2000', '--out', 'trace');
const size = {width: 640, height: 480}, look = ['--size', '640x480', '--seen-from', 'S'];
after(async () => {
  rmSync(temporary, {recursive: true});
  await closeBrowser();
});

const isThere = name => spawnSync(name, ['-version']).status === 0;
const withoutFilms = !(isThere('ffmpeg') && isThere('ffprobe')) && 'no ffmpeg here (Debian package ffmpeg), so that no film was made';
const read = (...names) => readFileSync(join(folder, ...names));
const leftBehind = () => readdirSync(temporary);

/** Red, green and blue of a picture's pixels. */
async function pixelsOf(page, file) {
  const {width, height, data} = await page.evaluate(async address => {
    const image = new Image();
    image.src = address;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height), context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    return {width: image.width, height: image.height, data: [...context.getImageData(0, 0, image.width, image.height).data]};
  }, `data:image/png;base64,${readFileSync(file).toString('base64')}`);
  const at = (x, y) => data.slice(4 * (y * width + x), 4 * (y * width + x) + 3);
  return {width, height, at};
}

const isNear = (color, wanted) => color.every((value, i) => Math.abs(value - wanted[i]) <= 3); // rounding of colours, antialiasing
const kProxy = [0xdc, 0x72, 0x0c], kStage = [0xdf, 0xe4, 0xea], kStageDark = [0x0d, 0x10, 0x14];

/** Share of the pixels of one colour within so many pixels of a place; infinite: everywhere. */
function share(picture, wanted, place = {x: 0, y: 0}, reach = Infinity) {
  let count = 0, all = 0;
  for (let y = 0; y < picture.height; ++y)
    for (let x = 0; x < picture.width; ++x) {
      if (Math.hypot(x + 0.5 - place.x, y + 0.5 - place.y) > reach) continue;
      ++all;
      count += isNear(picture.at(x, y), wanted);
    }
  return count / all;
}

test('each picture is of its frame: the proxy is where the page has it', async () => {
  palpate('view', recording, '--png', 'pictures', '--from', '0.5', '--to', '1.7', '--every', '0.6', ...look);
  const names = ['frame-000500.png', 'frame-001100.png', 'frame-001700.png'];
  assert.deepEqual(readdirSync(join(folder, 'pictures')).sort(), names);
  palpate('view', recording, '-o', 'trace.html', '--sub-steps', 'none');
  const page = await openPage(`${pathToFileURL(join(folder, 'trace.html')).href}#picture&from=S`, size);
  await page.waitForFunction(() => window.palpate?.picture);
  const places = [];
  for (const [i, name] of names.entries()) {
    const {place, facets} = await page.evaluate(async index => {
      const app = window.palpate;
      await app.picture(index);
      const most = app.view.surfaces.mostFacets;
      return {place: app.view.toScreen(app.view.glyphs.proxy.position), facets: [app.view.surfaces.facets, most]};
    }, 500 + 600 * i);
    assert.equal(facets[0], facets[1], 'all detail');
    const picture = await pixelsOf(page, join(folder, 'pictures', name));
    assert.deepEqual([picture.width, picture.height], [size.width, size.height]);
    // A ball of 6 px radius; the arrow and the spring begin on it.
    const [here, elsewhere] = [share(picture, kProxy, place, 5), share(picture, kProxy)];
    assert.ok(here > 0.4, `${name}: ${here} of the proxy's place has its colour`);
    assert.ok(elsewhere < 0.005, `${name}: ${elsewhere} of the picture`);
    const free = share(picture, kStage);
    assert.ok(free > 0.05 && free < 0.8, `${name}: ${free} is free`);
    for (const other of places) assert.ok(Math.hypot(other.x - place.x, other.y - place.y) > 12, 'places that can be told apart');
    places.push(place);
  }
  await close(page);
});

test('the same frame is the same bytes, whatever was drawn before it', () => {
  palpate('view', recording, '--png', 'alone', '--from', '1.1', '--to', '1.1', ...look);
  assert.deepEqual(readdirSync(join(folder, 'alone')), ['frame-001100.png']);
  assert.ok(read('alone', 'frame-001100.png').equals(read('pictures', 'frame-001100.png')));
  palpate('view', recording, '--png', 'alone', '--from', '1.1', '--to', '1.1', ...look); // an own picture may be replaced
  assert.deepEqual(leftBehind(), []);
});

test('dark pictures are dark', async () => {
  palpate('view', recording, '--png', 'dark', '--from', '1.1', '--to', '1.1', '--dark', ...look);
  const page = await openPage('about:blank');
  const picture = await pixelsOf(page, join(folder, 'dark', 'frame-001100.png'));
  assert.ok(share(picture, kStageDark) > 0.05);
  assert.ok(share(picture, kStage) < 0.005); // edges of letters
  await close(page);
});

test('a film has a picture for each of its moments', {skip: withoutFilms}, () => {
  const count = file => execFileSync('ffprobe', ['-v', 'error', '-count_frames', '-show_entries',
    'stream=nb_read_frames,width,height,r_frame_rate,codec_name', '-of', 'csv=p=0', join(folder, file)], {encoding: 'utf8'}).trim();
  palpate('view', recording, '--film', 'film.mp4', '--from', '0.5', '--to', '1', ...look);
  assert.equal(count('film.mp4'), 'h264,640,480,30/1,15');
  palpate('view', recording, '--film', 'film.mp4', '--from', '1.9', '--speed', '0.5', '--fps', '25', ...look); // to the end: 0.1 s
  assert.equal(count('film.mp4'), 'h264,640,480,25/1,5');
  assert.deepEqual(leftBehind(), []);
});

test('without browser or ffmpeg it is said what to install', () => {
  const nothing = {PATH: '/nonexistent', PALPATE_BROWSER: ''};
  const none = run(['view', recording, '--png', 'none'], nothing);
  assert.equal(none.status, 3);
  assert.match(none.stderr, /apt-get install chromium\), or name one with PALPATE_BROWSER$/m);
  const film = run(['view', recording, '--film', 'none.mp4'], {PATH: '/nonexistent'});
  assert.equal(film.status, 3);
  assert.match(film.stderr, /apt-get install ffmpeg\)/);
  const wrong = run(['view', recording, '--png', 'none'], {PALPATE_BROWSER: '/nonexistent/browser'});
  assert.equal(wrong.status, 3);
  assert.match(wrong.stderr, /PALPATE_BROWSER=\/nonexistent\/browser: is no program/);
  const other = run(['view', recording, '--png', 'none', '--to', '0'], {PALPATE_BROWSER: '/bin/false'});
  assert.equal(other.status, 3);
  assert.match(other.stderr, /\/bin\/false: (has ended|is gone)/);
  const nowhere = run(['view', recording, '--png', 'none', '--to', '0'], {TMPDIR: '/nonexistent/folder'});
  assert.equal(nowhere.status, 3);
  assert.match(nowhere.stderr, /TMPDIR: is no folder for the browser's files/);
  for (const name of ['none', 'none.mp4']) assert.equal(existsSync(join(folder, name)), false);
  assert.deepEqual(leftBehind(), []);
});

test('options that are wrong or change nothing are refused', () => {
  for (const [options, words] of [
    [['--png', 'no', '--film', 'no.mp4'], /--png/],
    [['--png', 'no', '--size', '640'], /--size 640: give WIDTHxHEIGHT/],
    [['--png', 'no', '--size', '100x100'], /from 320x240 to 3840x2160/],
    [['--film', 'no.mp4', '--size', '641x480'], /even numbers for a film/],
    [['--film', 'no.avi'], /--film no.avi: films are MP4/],
    [['--png', 'no', '--seen-from', 'X'], /--seen-from/],
    [['--png', 'no', '--from', '1', '--to', '0.5'], /the recording goes from 0 to 1.999 s/],
    [['--png', 'no', '--to', '3'], /the recording goes from 0 to 1.999 s/],
    [['--png', 'no', '--every', '0'], /--every/],
    [['--png', 'no', '--fps', '30'], /--fps: it is of a film/],
    [['--png', 'no', '--speed', '2'], /--speed: it is of a film/],
    [['--film', 'no.mp4', '--every', '1'], /--every: a film has/],
    [['--film', 'no.mp4', '--speed', '0.001', '--fps', '240'], /480000 pictures are more than 100000/],
    [['--png', 'no', '--out', 'page.html'], /--out/],
    [['--png', 'no', '--sub-steps', '1-2'], /--sub-steps: .* is a recording, of which pictures are asked for/],
    [['--dark'], /--dark: it is of pictures, and neither/],
    [['--from', '1'], /--from: it is of pictures, and neither/],
  ]) {
    const {status, stderr} = run(['view', recording, ...options]);
    assert.equal(status, 2, `${options}: ${stderr}`);
    assert.match(stderr, words);
  }
  const ofScene = run(['view', scene, '--png', 'no']);
  assert.equal(ofScene.status, 2);
  assert.match(ofScene.stderr, /is no recording/);
  assert.equal(existsSync(join(folder, 'no')), false);
});

test('what Palpate did not write is not replaced', () => {
  mkdirSync(join(folder, 'mine'));
  for (const name of ['mine/frame-001100.png', 'mine.mp4']) writeFileSync(join(folder, name), 'mine');
  for (const options of [['--png', 'mine', '--from', '1.1', '--to', '1.1'], ...(withoutFilms ? [] : [['--film', 'mine.mp4']])]) {
    const {status, stderr} = run(['view', recording, ...options]);
    assert.equal(status, 3);
    assert.match(stderr, /was not written by Palpate/);
  }
  for (const name of ['mine/frame-001100.png', 'mine.mp4']) assert.equal(String(read(name)), 'mine');
});

test('Ctrl-C leaves neither files nor a browser', async () => {
  const child = spawn(process.env.PALPATE, ['view', recording, '--png', 'stopped', '--every', '0.001', ...look],
    {cwd: folder, env: surroundings, stdio: 'ignore'});
  let end;
  const ended = new Promise(done => child.on('exit', (code, signal) => done(end = signal ?? code)));
  const parts = join(folder, 'stopped'), pause = () => new Promise(done => setTimeout(done, 20));
  const started = () => existsSync(parts) && readdirSync(parts).some(part => readdirSync(join(parts, part)).length > 0);
  while (end === undefined && !started()) await pause(); // a picture is taken
  child.kill('SIGINT');
  assert.equal(await ended, 'SIGINT');
  assert.equal(existsSync(parts), false);
  assert.deepEqual(leftBehind(), []);
  // An ended process is gone when whoever adopted it has seen that.
  const running = () => readdirSync('/proc').filter(name => /^\d+$/.test(name)).filter(name => {
    try {
      return readFileSync(`/proc/${name}/cmdline`, 'utf8').includes(temporary);
    } catch {
      return false; // it ended meanwhile
    }
  });
  while (running().length > 0) await pause();
});

test('report --interactive writes the page of view, and a report links to the pages that it wrote', async () => {
  palpate('view', recording, '-o', 'by_view.html');
  palpate('report', 'trace', '--interactive', '-o', 'by_report.html');
  assert.ok(read('by_view.html').equals(read('by_report.html')));
  palpate('report', recording, '--interactive', '-o', 'by_report.html'); // of a recording; an own page may be replaced
  palpate('report', 'trace', '--playback', 'trace/', '-o', 'index.html');
  const page = await openPage(pathToFileURL(join(folder, 'index.html')).href);
  const [link] = await page.$$eval('a', all => all.map(one => one.getAttribute('href')));
  assert.equal(link, 'index-trace.html');
  await page.click('a');
  await page.waitForFunction(() => window.palpate?.frames.count === 2000);
  await close(page);
  for (const [options, words] of [
    [['trace', 'trace', '--interactive'], /--interactive: the page is of one recording/],
    [['trace', '--interactive', '--note', 'n'], /--note, --playback: they are of a report/],
    [['trace', '--playback', 'examples'], /--playback examples: is none of the FOLDERs/],
  ]) {
    const {status, stderr} = run(['report', ...options]);
    assert.equal(status, 2, stderr);
    assert.match(stderr, words);
  }
});
