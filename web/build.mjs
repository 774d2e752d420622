// SPDX-License-Identifier: Apache-2.0
// Makes the one file of the page: node build.mjs FOLDER. FOLDER has node_modules, by `npm ci` beside package.json and its lock, and
// gets palpate_view.html. Same sources, same bytes.
import {readFileSync, renameSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
if (process.argv.length !== 3) throw new Error('usage: node build.mjs FOLDER');
const folder = resolve(process.argv[2]);
const modules = join(folder, 'node_modules');
const output = join(folder, 'palpate_view.html');
const {build} = createRequire(join(folder, 'package.json'))('esbuild');
const kDataMark = '<!-- PALPATE-DATA -->';

/** The colours of the report pages, from where those have them. */
function reportColors() {
  const file = join(here, '..', 'engine', 'report', 'internal', 'series_look.h');
  const text = readFileSync(file, 'utf8');
  const css = ['kLightPalette', 'kDarkPalette'].map(name => {
    const begin = text.indexOf(`PagePalette ${name}{`);
    const colors = [...text.slice(begin, text.indexOf('};', begin)).matchAll(/"(#[0-9a-f]{3,6})"/g)].map(m => m[1]);
    if (begin < 0 || colors.length !== 14)
      throw new Error(`${file}: ${name} has ${colors.length} colours, and 14 are known here: see reportColors in build.mjs`);
    const names = ['paper', 'ink', 'soft', 'band', 'accent', 'line', ...Array.from({length: 8}, (_, i) => `s${i}`)];
    return names.map((key, i) => `--${key}: ${colors[i]};`).join(' ');
  });
  return `:root { ${css[0]} }\n@media (prefers-color-scheme: dark) { :root { ${css[1]} } }\n`;
}

/** The colours of forces in the pictures of a report, from where those have them. */
function forceColors() {
  const file = join(here, '..', 'engine', 'picture', 'internal', 'force_colors.cpp');
  const text = readFileSync(file, 'utf8'), begin = text.indexOf('kColors{{{');
  const numbers = [...text.slice(begin, text.indexOf(';', begin)).matchAll(/\d+\.\d+/g)].map(m => Number(m[0]));
  if (begin < 0 || numbers.length < 6 || numbers.length % 3) throw new Error(`${file}: kColors is not there: see forceColors in build.mjs`);
  return Array.from({length: numbers.length / 3}, (_, i) => numbers.slice(3 * i, 3 * i + 3));
}

/** Replaces exactly one mark; a replacement may hold any characters. */
function replaceOnce(text, mark, replacement) {
  const parts = text.split(mark);
  if (parts.length !== 2) throw new Error(`build.mjs: "${mark}" stands ${parts.length - 1} times, not once`);
  return parts.join(replacement);
}

// Whoever has the page has the licences of what is in it.
const licences = ['three', 'uplot'].map(name => `${name}\n${readFileSync(join(modules, name, 'LICENSE'), 'utf8')}`).join('\n');
const bundle = await build({
  entryPoints: [join(here, 'src', 'main.js')], bundle: true, minify: true, format: 'iife', target: 'es2022',
  legalComments: 'none', banner: {js: `/*!\nThis page contains:\n\n${licences.replaceAll('*/', '* /')}*/`}, write: false, charset: 'utf8',
  define: {PALPATE_FORCE_COLORS: JSON.stringify(forceColors())}, logLevel: 'warning', nodePaths: [modules], absWorkingDir: here,
});
const style = reportColors() + readFileSync(join(modules, 'uplot', 'dist', 'uPlot.min.css'), 'utf8') +
              readFileSync(join(here, 'style.css'), 'utf8');
let page = readFileSync(join(here, 'index.html'), 'utf8');
page = replaceOnce(page, '/* STYLE */', style);
page = replaceOnce(page, '/* SCRIPT */', bundle.outputFiles[0].text.replaceAll('</script', '<\\/script'));
if (page.split(kDataMark).length !== 2) throw new Error(`build.mjs: "${kDataMark}" does not stand once in the page`);
writeFileSync(`${output}.new`, page);
renameSync(`${output}.new`, output);
