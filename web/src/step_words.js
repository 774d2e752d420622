// SPDX-License-Identifier: Apache-2.0
/** What a sub-step did, in words. */
import {listed, readable} from './words.js';
import {isTaut, wayOf} from './step_glyphs.js';

const kMicrometres_m = 1e-4; // below it lengths stand in um
const kNothing_m = 1e-9; // below it they are rounding, or as good as none

const distance = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));
const along = corners => corners.slice(1).reduce((sum, corner, i) => sum + distance(corners[i], corner), 0);

/** A length in m with its unit. */
export function lengthInWords(metres) {
  if (metres < kNothing_m) return '0 mm';
  return metres < kMicrometres_m ? `${readable(1e6 * metres)} µm` : `${readable(1000 * metres)} mm`;
}

const nameOf = (structures, id) => structures.find(one => one.id === id)?.name ?? 'an effect';

const kStops = {
  contact: name => `where it met ${name}`,
  edge: name => `at an edge of the mesh of ${name}, and goes on round it`,
  certificate: name => `by the certificate of ${name}`,
  leash: name => `by the leash of ${name}`,
};

/** How far a straight move came, and what ended it. */
function chordInWords(step, structures) {
  const asked = distance(step.proxy_m, step.wanted_m), went = along(wayOf(step));
  const stop = step.stop && kStops[step.stop.by]?.(nameOf(structures, step.stop.structure));
  if (!stop) return distance(step.to_m, step.wanted_m) === 0 ? `went ${lengthInWords(went)}, as far as it was led`
    : `went ${lengthInWords(went)} of ${lengthInWords(asked)}`;
  const words = went === 0 ? `did not move: all of ${lengthInWords(asked)} was stopped ${stop}`
    : `went ${lengthInWords(went)} of ${lengthInWords(asked)}: stopped ${stop}`;
  const certified = distance(step.proxy_m, step.stop.at_m);
  return certified > went * (1 + 1e-9) ? `${words}, which holds for ${lengthInWords(certified)}` : words;
}

/** One line: what this sub-step did. */
export function stepInWords(step, structures) {
  switch (step.kind) {
    case 'rests': return 'stays: the forces balance here';
    case 'looks again': return 'stays, and looks again';
    case 'slides': {
      const stop = step.stop && kStops[step.stop.by]?.(nameOf(structures, step.stop.structure));
      const on = step.planes?.[0] ? ` along ${nameOf(structures, step.planes[0].structure)}` : '';
      return `slid ${lengthInWords(along(wayOf(step)))}${on}${stop ? `, stopped ${stop}` : ''}`;
    }
    case 'ends the frame': return `ended the frame: ${chordInWords(step, structures)}`;
    default: return chordInWords(step, structures);
  }
}

function planesInWords(step, structures) {
  const planes = step.planes ?? [];
  if (planes.length === 0) return 'no plane: nothing is felt here';
  const leashed = new Set((step.leashes ?? []).map(leash => leash.plane));
  const of = planes.map((plane, i) => `${leashed.has(i) ? 'the leash of ' : ''}${nameOf(structures, plane.structure)}`);
  const holding = of.filter((_, i) => planes[i].active);
  return `${holding.length} of ${planes.length} planes hold${holding.length ? `: ${listed(holding)}` : ''}`;
}

/** What else is to be known of it: a line each. */
export function stepDetails(step, structures) {
  const lines = [planesInWords(step, structures)];
  const away = distance(step.proxy_m, step.candidate_m);
  lines.push(`forces balance ${away < kNothing_m ? 'here' : `${lengthInWords(away)} from here`}`);
  for (const leash of (step.leashes ?? []).filter(one => isTaut(one, step)))
    lines.push(`leash of ${nameOf(structures, leash.structure)}: the guard is ${lengthInWords(distance(step.proxy_m, leash.guard_m))} ` +
               `away, ${lengthInWords(leash.length_m)} at most`);
  for (const friction of step.friction ?? []) {
    const name = nameOf(structures, step.planes[friction.plane].structure);
    if (friction.most_n > 0)
      lines.push(`friction on ${name} ${friction.holds ? 'holds' : 'slips'}: ${readable(friction.force_n)} N of at most ` +
                 `${readable(friction.most_n)} N (pressed with ${readable(friction.normal_n)} N)`);
  }
  return lines;
}
