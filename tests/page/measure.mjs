// SPDX-License-Identifier: Apache-2.0
/** Runs in the page: what is wrong with its text. */
export function measure() {
  const found = [], lines = [];
  const channels = css => css.match(/[\d.]+/g).map(Number);
  const luminance = rgb => rgb.slice(0, 3).map(c => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = element => {
    for (let at = element; at; at = at.parentElement) {
      const color = channels(getComputedStyle(at).backgroundColor);
      if (color.length === 3 || color[3] === 1) return color;
    }
    return [255, 255, 255];
  };
  const contrastOf = element => {
    const shades = [channels(getComputedStyle(element).color), behind(element)].map(luminance).sort((a, b) => a - b);
    return (shades[1] + 0.05) / (shades[0] + 0.05);
  };
  for (const control of document.querySelectorAll('select, input:not([type=range]):not([type=checkbox])')) // their text is no text node
    if (!control.disabled && control.getClientRects().length && contrastOf(control) < 4.5) found.push(`contrast of ${control.id}`);
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode, element = node.parentElement, style = getComputedStyle(element);
    if (!node.data.trim() || element.closest('script, style, option, :disabled, .unseen') || style.visibility === 'hidden') continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const name = `"${node.data.trim().slice(0, 40)}"`;
    const size = parseFloat(style.fontSize);
    const boxes = [...range.getClientRects()].filter(box => box.width > 0 && box.height > 0);
    if (boxes.length === 0) continue;
    if (size < 11) found.push(`text of ${size} px: ${name}`);
    const contrast = contrastOf(element);
    if (contrast < 4.5) found.push(`contrast ${contrast.toFixed(1)} : 1: ${name}`);
    const clip = element.closest('aside, #structures, .scroll')?.getBoundingClientRect();
    for (const box of boxes) {
      if (box.right > document.documentElement.clientWidth + 1 || box.left < -1) found.push(`beyond the page: ${name}`);
      if (clip && (box.bottom > clip.bottom || box.top < clip.top)) continue; // scrolled away
      lines.push({left: box.left, right: box.right, top: box.top + box.height / 8, bottom: box.bottom - box.height / 8, name});
    }
  }
  for (let i = 0; i < lines.length; ++i)
    for (let j = i + 1; j < lines.length; ++j) {
      const [a, b] = [lines[i], lines[j]];
      if (a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1)
        found.push(`${a.name} over ${b.name}`);
    }
  const controls = [...document.querySelectorAll('button, select, input, .slice, .plot')].filter(one => one.getClientRects().length)
    .map(one => ({box: one.getBoundingClientRect(), name: one.id || one.ariaLabel || one.className}));
  for (let i = 0; i < controls.length; ++i)
    for (let j = i + 1; j < controls.length; ++j) {
      const [a, b] = [controls[i].box, controls[j].box];
      if (a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1)
        found.push(`control ${controls[i].name} over ${controls[j].name}`);
    }
  if (document.documentElement.scrollWidth > document.documentElement.clientWidth)
    found.push(`the page is ${document.documentElement.scrollWidth} px wide`);
  return found;
}
