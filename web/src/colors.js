// SPDX-License-Identifier: Apache-2.0
/** Colours that are numbers: of forces, as in the pictures of a report, and of the style sheet. */

/* global PALPATE_FORCE_COLORS */
const kForce = PALPATE_FORCE_COLORS; // those of a report's pictures, by build.mjs: [red, green, blue] each

/** Colour of a share of the greatest force: sRGB, 0 to 1. */
export function forceColor(share) {
  if (!(share > 0)) return kForce[0];
  if (share >= 1) return kForce.at(-1);
  const at = share * (kForce.length - 1), low = Math.floor(at), part = at - low;
  return kForce[low].map((value, i) => value + part * (kForce[low + 1][i] - value));
}

export const kTouchedShare = 0.75; // its colour is that of what was touched, however hard

/** CSS of a colour of three numbers from 0 to 1. */
export const cssColor = color => `rgb(${color.map(c => Math.round(255 * c)).join(' ')})`;

/** CSS of the colours of forces from left to right. */
export function forceGradient() {
  const stops = kForce.map(cssColor);
  return `linear-gradient(90deg, ${stops.join(', ')})`;
}

/** "#rrggbb" as three numbers from 0 to 1, grey for anything else. */
export function hexColor(text) {
  const match = /^#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})$/i.exec(text ?? '');
  return match ? match.slice(1).map(part => parseInt(part, 16) / 255) : [0.7, 0.7, 0.7];
}

/** A colour of the style sheet, as it is now (light or dark). */
export function styleColor(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
