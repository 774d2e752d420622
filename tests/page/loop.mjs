// SPDX-License-Identifier: Apache-2.0
// palpate view on a scene of a test, and what its page has. PALPATE is the command.
import {execFileSync, spawn} from 'node:child_process';
import {mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {work} from './browser.mjs';

export class Loop {
  /** Ends with the test. @param {string} name of a folder for all that it writes @param {any} t the test @param {string} scene TOML */
  constructor(name, t, scene) {
    t.after(() => this.stop());
    this.folder = join(work, name);
    this.environment = {...process.env, PALPATE_CACHE: join(work, 'cache')};
    rmSync(this.folder, {recursive: true, force: true});
    mkdirSync(this.folder, {recursive: true});
    writeFileSync(join(this.folder, 'scene.toml'), scene);
  }

  palpate(...options) {
    return execFileSync(process.env.PALPATE, options, {cwd: this.folder, stdio: 'pipe', env: this.environment});
  }

  /** Starts it; gives back its link. */
  async start(...options) {
    this.child = spawn(process.env.PALPATE, ['view', 'scene.toml', '--seconds', '800', '--out', 'live', ...options],
                       {cwd: this.folder, env: this.environment});
    let said = '';
    return new Promise((done, fail) => {
      for (const stream of [this.child.stdout, this.child.stderr])
        stream.on('data', data => {
          said += data;
          const found = /http:\/\/127\.0\.0\.1:\S+/.exec(said);
          if (found) done(found[0]);
        });
      this.child.on('exit', code => fail(new Error(`palpate view ended with ${code}: ${said}`)));
    });
  }

  /** The recording that is under way is written. */
  stop() {
    return this.child && new Promise(done => (this.child.exitCode === null ? this.child.on('exit', done).kill('SIGINT') : done()));
  }

  read(file) {
    return readFileSync(join(this.folder, file), 'utf8');
  }
}

/** A column of all frames of a page; vectors as lists of three. */
export const column = (page, name) => page.evaluate(one => {
  const {frames} = window.palpate, values = frames.columns[one], width = /_(m|n)$/.test(one) ? 3 : 1;
  return Array.from({length: frames.count}, (_, i) => width === 1 ? values[i] : frames.triple(one, i));
}, name);
