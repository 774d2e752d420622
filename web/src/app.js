// SPDX-License-Identifier: Apache-2.0
/** The page as a whole: what is shown of which frame, and what the controls do. */
import {Beat} from './beat.js';
import {Charts} from './charts.js';
import {DeviceButton} from './device_button.js';
import {Explore} from './explore.js';
import {Felt} from './felt.js';
import {FrameStore} from './frames.js';
import {Hand} from './hand.js';
import {bindKeys} from './keys.js';
import {Overlay} from './overlay.js';
import {Panels} from './panels.js';
import {Picking} from './picking.js';
import {Player} from './player.js';
import {Slices} from './slices.js';
import {SpaceMouse} from './space_mouse.js';
import {View3d} from './view3d.js';
import {Announcer, feltOf, flagsOf, listed, readable, roundUp} from './words.js';

const kForceRank = 0.99; // share of the frames in contact at or below the last colour's force
const kTables_ms = 500; // between two looks at charts and tables of a live loop
const kQuiet_ms = 1000; // without a frame: said
const kSame_px = 0.25; // what moved by less is where it was
const kSameForce = 0.005; // of the last colour's force
const kMostFacets = 4e6; // asked for from the loop: 200 MB at some 50 bytes each, here and on the card

export class App {
  /**
   * @param {any} scene
   * @param {(name: string, count?: number, type?: string) => any} blob
   * @param {((command: any) => boolean) | undefined} send to the loop; nothing in a playback
   * @param {{isPosed?: boolean}} use isPosed: draws what film.js asks for, and nothing by itself
   */
  constructor(scene, blob, send, {isPosed = false} = {}) {
    this.scene = scene;
    this.send = send;
    this.isLive = scene.mode === 'live';
    this.isConnected = Boolean(send); // the scene has just come
    document.body.dataset.mode = scene.mode;
    this.frames = new FrameStore();
    if (scene.frames) this.frames.append(scene.frames, blob);
    this.player = new Player(this.frames, this.isLive);
    this.felt = new Felt(scene);
    this.state = {};
    this.marks = [...(scene.marks ?? [])];
    this.look = {span: this.isLive ? '5' : 'now', by: 'force', paint: 'none'};
    this.cut = {axis: 'none', follows: false, place_mm: 0};
    this.step = 0;
    document.getElementById('main').hidden = false;
    this.view = new View3d(document.getElementById('view'), scene, blob, isPosed);
    this.overlay = new Overlay(this.view, scene);
    this.slices = new Slices(scene, blob, document.getElementById('slices'));
    this.charts = new Charts(document.getElementById('charts'), this);
    this.announcer = new Announcer(document.getElementById('said'));
    this.hand = send && !scene.choice ? new Hand(this.view, send, () => this.probe()) : undefined;
    this.button = this.hand && new DeviceButton(document.getElementById('button'), send);
    this.spaceMouse = this.hand && new SpaceMouse(isDown => (isDown ? this.button.press() : this.button.release()),
                                                  () => this.panels.showSpaceMouse());
    this.panels = new Panels(this);
    this.picking = new Picking(this.view, document.getElementById('pointed'), surface => this.panels.structures.find(surface));
    this.explore = send && scene.choice && new Explore(this);
    bindKeys(this);
    this.view.onLevels = () => this.repaint();
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
      this.view.retheme();
      this.charts.rebuild();
    });
    this.takeIn();
    this.setMarks(this.marks);
    this.seekFirst();
    if (!isPosed) this.beat = new Beat((now, elapsed_s) => this.tick(now, elapsed_s));
  }

  /** A playback begins with the first frame that felt something. */
  seekFirst() {
    if (this.isLive || this.frames.count === 0) return;
    const at = this.frames.columns.felt.subarray(0, this.frames.count).findIndex(bits => bits !== 0);
    this.seek(Math.max(0, at));
  }

  /** Where the loop's probe is, scene m. */
  probe() {
    return this.frames.count ? this.frames.triple('probe_m', this.frames.count - 1) : undefined;
  }

  // What comes from the loop.

  isSameScene(scene) {
    const parts = s => JSON.stringify([s.title, s.mode, s.view, s.volumes, s.label_volumes,
      (s.structures ?? []).map(one => [one.id, one.name, one.color, one.box_m])]);
    return parts(scene) === parts(this.scene);
  }

  beginAnew(scene, blob) {
    this.frames.clear();
    this.felt.clear();
    for (const coverage of this.view.surfaces.all.flatMap(s => s.coverages)) coverage.clear();
    if (scene.frames) this.frames.append(scene.frames, blob);
    this.player.index = 0;
    this.player.playing = this.isLive;
    this.takeIn();
  }

  addFrames(frames, blob) {
    const before = this.frames.count;
    this.frames.append(frames, blob);
    this.arrived = performance.now();
    if (this.player.playing && this.frames.count > 0 && this.looksDifferent(this.player.last)) this.beat.wake();
    const begun = this.frames.runBegin(before);
    if (begun) this.charts.isZoomed = false; // its clock begins anew
    const gone = begun || (this.frames.isFull ? this.frames.count >> 1 : 0);
    if (gone === 0) return;
    this.isOpen = true; // the first picture may be far off: what goes is measured now
    this.takeIn(); // tables keep what is forgotten; a page in the background draws nothing for minutes
    for (const surface of this.view.surfaces.all) surface.forgetFrames(this.look.paint !== 'none');
    this.frames.forget(gone);
    this.felt.done -= gone;
    for (const coverage of this.view.surfaces.all.flatMap(s => s.coverages))
      coverage.done = Math.max(0, coverage.done - gone);
    this.player.index = Math.max(0, this.player.index - gone);
  }

  addMeshes(structures, blob) {
    for (const mesh of structures ?? []) {
      const surface = this.view.surfaces.byId(mesh.id);
      if (!surface) continue;
      surface.leaveAsked();
      for (const level of mesh.levels ?? []) surface.add(level, blob);
    }
    this.isAsking = false;
    this.view.touch();
  }

  /** What the loop says in words, and its state. */
  hear(message) {
    if (message.say) {
      document.getElementById('link').textContent = message.say;
      this.announcer.say(message.say);
    }
    if (message.kind === 'error' && message.about === 'mesh') this.isAsking = false; // the next one is asked for
    const before = JSON.stringify(this.state.marks);
    Object.assign(this.state, message.state ?? {});
    if (Array.isArray(this.state.marks) && JSON.stringify(this.state.marks) !== before) this.setMarks(this.state.marks);
    this.explore?.hear(message);
    this.panels.showState(message.kind === 'error');
  }

  setConnected(isConnected) {
    if (this.isConnected !== isConnected) this.announcer.say(isConnected ? 'Connected.' : 'Connection lost.');
    this.isConnected = isConnected;
    this.hand?.forget(); // what moved while nobody heard would be a jump
    if (!isConnected) {
      this.isAsking = false; // whatever was under way
      this.view.surfaces.forgetAsked();
    }
    this.panels.showState();
    this.explore?.setConnected(isConnected);
  }

  // What the controls do.

  seek(index) {
    this.player.seek(index);
    this.step = Infinity; // the frame's end; showDetail() makes a sub-step of it
  }

  /** What is shown, and whether it goes on: what goBack() takes. */
  get moment() {
    return {index: this.player.index, step: this.step, playing: this.player.playing};
  }

  goBack({index, step, playing}) {
    this.player.seek(index);
    this.player.playing = playing;
    this.step = step;
  }

  seekBy(frames) {
    this.player.step(frames);
    this.step = Infinity;
  }

  setCut() {
    const normals = {'+x': [1, 0, 0], '-x': [-1, 0, 0], '+y': [0, 1, 0], '-y': [0, -1, 0],
                     '+z': [0, 0, 1], '-z': [0, 0, -1]};
    const normal = normals[this.cut.axis];
    if (!normal) return this.view.setCut(null);
    const proxy = this.frames.count ? this.frames.triple('proxy_m', this.player.index) : this.view.center;
    const place = this.cut.follows ? proxy
      : this.view.center.map((c, i) => c + normal[i] * -this.cut.place_mm / 1000);
    // Kept is the side that the normal points to: the near side is taken away.
    return this.view.setCut(normal.map(v => -v), place);
  }

  setMarks(marks) {
    this.marks = marks;
    this.view.glyphs.setMarks(marks);
    this.overlay.setMarks(marks);
    this.panels.showMarks();
    this.view.touch();
  }

  dropMark(name) {
    if (!this.frames.count) return;
    if (this.send) return void this.send({do: 'mark', name}); // the loop answers with all points
    const i = this.player.index;
    this.setMarks([...this.marks, {
      name, at_m: this.frames.triple('proxy_m', i), time_s: this.frames.columns.time_s[i],
      felt: listed(feltOf(this.scene, this.frames.columns.felt[i]).map(s => s.name))}]);
  }

  detail() {
    const steps = this.scene.details?.[String(this.frames.columns.index[this.player.index])];
    return steps?.length ? steps : undefined; // a frame that was not computed has none
  }

  // What is computed from the frames.

  /** Takes frames that came into tables and coverage. */
  takeIn() {
    this.felt.update(this.frames);
    for (const surface of this.view.surfaces.all) {
      if (surface.structure.bit < 0 || !surface.level) continue;
      const levels = new Set(this.isOpen ? [surface.coverage] : []); // the first picture does not wait for areas
      if (this.look.paint !== 'none') levels.add(surface.paintOf(surface.level));
      if (this.isLive && this.isOpen) levels.add(surface.memory); // of what will be forgotten
      for (const coverage of levels)
        coverage.update(this.frames, surface.structure.bit, this.felt.period_s, this.view.toView);
    }
    const scale_n = this.forceScale();
    if (scale_n !== this.scale_n || this.look.paint !== 'none') {
      this.scale_n = scale_n;
      this.repaint();
    }
    this.charts.update();
    this.panels.showFelt();
    this.taken = performance.now();
    this.takenCount = this.frames.count;
    this.shown = undefined;
  }

  /** The force of the last colour: a round number at or above 99 % of the frames that felt something. */
  forceScale() {
    const {felt} = this.frames.columns, forces = [];
    const stride = Math.max(1, Math.floor(this.frames.count / 20000));
    for (let i = 0; i < this.frames.count; i += stride) if (felt[i]) forces.push(this.frames.force(i));
    if (forces.length === 0) return 1;
    forces.sort((a, b) => a - b);
    return roundUp(forces[Math.ceil(kForceRank * forces.length) - 1]);
  }

  repaint() {
    const surfaces = this.view.surfaces.all.filter(s => s.structure.bit >= 0 && s.level);
    if (this.look.paint !== 'none')
      for (const s of surfaces) // a level that is shown for the first time
        s.paintOf(s.level).update(this.frames, s.structure.bit, this.felt.period_s, this.view.toView);
    const longest = surfaces.map(s => (this.look.paint === 'longest' ? s.paintOf(s.level).longest_s : 0));
    this.most = {longest: roundUp(Math.max(0, ...longest)),
                 hardest: this.scale_n ?? 1};
    for (const surface of surfaces) surface.paint(this.look.paint, this.most);
    this.panels.showLegend();
    this.view.touch();
  }

  /** One picture; true where the next one may look different. */
  tick(now, elapsed_s) {
    const before = this.player.index;
    this.player.advance(elapsed_s);
    if (this.player.index !== before) this.step = Infinity;
    if (this.isLive && this.frames.count !== this.takenCount && now - this.taken > kTables_ms) this.takeIn();
    if (this.hand) this.moveHand(now, elapsed_s);
    const shown = `${this.player.index} ${this.frames.generation} ${this.frames.count && 1} ${this.step}`;
    if (shown !== this.shown) {
      this.shown = shown;
      this.showFrame();
    }
    this.picking.update();
    const isDrawn = this.view.draw(now);
    if (isDrawn) this.overlay.place();
    if (!this.isOpen && (!isDrawn || !this.view.pace.isLearning)) {
      this.isOpen = true;
      this.takeIn();
    }
    this.askForDetail(); // also at rest, when nothing is drawn
    this.panels.showPlayer();
    this.panels.showAge(this.isLive && this.isConnected && this.arrived && now - this.arrived > kQuiet_ms
      ? Math.round((now - this.arrived) / 1000) : 0);
    return isDrawn || !this.isLive && this.player.playing || Boolean(this.panels.usesSpaceMouse);
  }

  /** A cap that is pushed moves the hand; what moved it is sent. */
  moveHand(now, elapsed_s) {
    const push = this.panels.usesSpaceMouse && this.spaceMouse.deflection(now); // also for its button, which a frozen hand has
    if (push && !this.state.frozen) this.hand.drive(push, elapsed_s);
    this.hand.flush();
  }

  /** What is drawn of this frame is to be drawn anew. */
  redraw() {
    this.shown = undefined;
    this.view.touch();
  }

  showSlices(proxy_m, probe_m) {
    this.slices.draw(proxy_m, probe_m);
    this.view.planes.update(this.slices.slices);
    this.panels.showSliceWords(proxy_m);
  }

  showFrame() {
    const place = this.place ?? this.view.center;
    if (this.frames.count === 0) return this.showSlices(place, place);
    const i = this.player.index, {frames, scene} = this;
    const probe_m = frames.triple('probe_m', i), proxy_m = frames.triple('proxy_m', i);
    this.view.glyphs.setFrame(this.view.toView(probe_m), this.view.toView(proxy_m),
                              frames.triple('force_n', i), this.scale_n);
    const isTrailNew = this.view.trail.update(frames, i, this.look, this.scale_n);
    this.showDetail();
    if (this.cut.follows) this.setCut();
    // A live loop has a new frame for each picture; where nothing moves in it, the page is at rest, and drawn as fine as may be.
    if (this.looksDifferent(i) || isTrailNew || !this.isLive) {
      this.view.touch();
      this.drawn = this.movingParts(i);
    }
    this.overlay.setForce(frames.force(i));
    this.showSlices(proxy_m, probe_m);
    this.charts.show(i, (chart, value) => `${readable(value)} ${chart.unit}`);
    this.panels.showFrame(i, feltOf(scene, frames.columns.felt[i]), flagsOf(scene, frames.columns.flags[i]));
    this.announce(i);
  }

  movingParts(i) {
    return ['probe_m', 'proxy_m', 'force_n'].map(name => this.frames.triple(name, i));
  }

  /** Whether a frame looks different from the one that was drawn last. */
  looksDifferent(i) {
    const {view, drawn} = this;
    if (!drawn) return true;
    const pixel_m = view.mmPerPixel(view.glyphs.proxy.position) / 1000;
    const most = [kSame_px * pixel_m, kSame_px * pixel_m, kSameForce * this.scale_n];
    return this.movingParts(i).some((now, k) => !(Math.hypot(...now.map((v, axis) => v - drawn[k][axis])) <= most[k]));
  }

  showDetail() {
    const steps = this.detail();
    this.step = Math.min(this.step, Math.max(0, (steps?.length ?? 1) - 1));
    this.view.glyphs.setSteps(steps, this.step);
    this.panels.steps.show(steps, this.step);
  }

  /** What is touched and which flags are set, when that changes. */
  announce(i) {
    const touched = listed(feltOf(this.scene, this.frames.columns.felt[i]).map(s => s.name)) || 'nothing';
    const flags = flagsOf(this.scene, this.frames.columns.flags[i]).map(flag => flag.name).join(', ');
    const words = `Touching ${touched}.${flags ? ` Flags: ${flags}.` : ''}`;
    if (words === this.announced) return;
    this.announced = words;
    this.announcer.say(words);
  }

  /** Asks the loop's side for a finer surface, one at a time, while pictures come fast enough. */
  askForDetail() {
    if (!this.send || this.isAsking || this.explore) return;
    const {surfaces, pace} = this.view;
    const wanted = surfaces.wanted(Math.min(kMostFacets, pace.budget(true)));
    if (!wanted) return;
    this.isAsking = this.send({do: 'level', structure: wanted.surface.structure.id, facets: wanted.level.facets});
    wanted.level.isAsked = this.isAsking;
  }
}
