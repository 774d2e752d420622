#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Looks at pages as a browser lays them out, and names what a reader could not read.

usage: check_pages.py [--shots FOLDER] PAGE...

A page is an HTML file, or an SVG file, which is shown as a page of ours shows pictures.

Each page is shown 390, 768 and 1280 px wide, light and dark, and as printed on A4. Checked are:
the size of text, its contrast, text over text, what is beyond the page or cut off, and that a
chart's legend has the line and the marker of each of its series. With --shots there are pictures of
each, of what colour-blind eyes see, and the print as PDF.

Needs Chromium (the variable CHROMIUM names another program than chromium); Python's own library is
enough besides. Ends with 0 when nothing was found, 1 when something was, 77 without Chromium."""
import argparse
import base64
import json
import os
import pathlib
import select
import shutil
import subprocess
import sys
import tempfile

WIDTHS_PX = (390, 768, 1280)
PRINT_PX = 718  # A4 less 1 cm on both sides, at 96 px per inch
ANSWER_S = 60

# Runs in the page. Limits: text of at least 11 px on a screen and 6.5 pt on paper; contrast of WCAG
# 2.1, 1.4.3. Boxes of text are taken without a quarter of their height, which is ascent and descent
# that letters rarely use.
MEASURE = r"""
(printed => {
const found = [];
const name = text => '"' + text.trim().replace(/\s+/g, ' ').slice(0, 40) + '"';
const leastPx = printed ? 8.6 : 10.95;
const page = document.documentElement.clientWidth;
const landscape = 1047;  // px of A4 less 1 cm on both sides, where a page of its own is asked for
const ends = element => printed && element.closest('.many') ? landscape : page;
const scrolls = style => /auto|scroll|hidden/.test(style.overflowX + style.overflowY);

function channels(css) {
  const parts = css.match(/[\d.]+/g).map(Number);
  return {rgb: parts.slice(0, 3), alpha: parts.length > 3 ? parts[3] : 1};
}
function luminance(rgb) {
  const [r, g, b] = rgb.map(c => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}
function contrast(a, b) {
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
}
function behind(element) {
  for (let at = element; at; at = at.parentElement) {
    const paper = at.tagName === 'svg' && at.querySelector(':scope > rect[width="100%"]');
    const color = paper ? channels(getComputedStyle(paper).fill)
                        : channels(getComputedStyle(at).backgroundColor);
    if (color.alpha === 1) return color.rgb;
  }
  return [255, 255, 255];
}

// Each line of visible text with its box.
const lines = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (walker.nextNode()) {
  const node = walker.currentNode, element = node.parentElement;
  if (!node.data.trim() || element.closest('title, desc, script, style')) continue;
  const range = document.createRange();
  range.selectNodeContents(node);
  const boxes = [...range.getClientRects()].filter(box => box.width > 0 && box.height > 0);
  if (boxes.length === 0) continue;
  const style = getComputedStyle(element), svg = element.closest('svg');
  const scale = svg ? Math.hypot(element.getScreenCTM().a, element.getScreenCTM().b) : 1;
  const size = parseFloat(style.fontSize) * scale;
  if (size < leastPx) found.push(`text of ${size.toFixed(1)} px: ${name(node.data)}`);
  const color = channels(svg ? style.fill : style.color);
  const ratio = contrast(color.rgb, behind(element));
  if (ratio < 4.5) found.push(`contrast ${ratio.toFixed(1)} : 1: ${name(node.data)}`);
  let clip = {left: -1e9, top: -1e9, right: 1e9, bottom: 1e9}, box = null;
  for (let at = element; at && at !== document.body; at = at.parentElement)
    if (scrolls(getComputedStyle(at)) && at.tagName !== 'svg') { box = at; break; }
  if (box) clip = box.getBoundingClientRect();
  if (svg) {
    const edge = svg.getBoundingClientRect();
    for (const b of boxes)
      if (b.left < edge.left - 1 || b.right > edge.right + 1 || b.top < edge.top - 1 ||
          b.bottom > edge.bottom + 3)
        found.push(`beyond its chart: ${name(node.data)}`);
  }
  for (const b of boxes) {
    if (!box && (b.right > ends(element) + 1 || b.left < -1)) found.push(`beyond the page: ${name(node.data)}`);
    const spare = b.height / 8;
    const line = {left: Math.max(b.left, clip.left), right: Math.min(b.right, clip.right),
                  top: Math.max(b.top + spare, clip.top),
                  bottom: Math.min(b.bottom - spare, clip.bottom), text: node.data};
    if (line.right - line.left > 1 && line.bottom - line.top > 1) lines.push(line);
  }
}
lines.sort((a, b) => a.top - b.top);
for (let i = 0; i < lines.length; ++i)
  for (let j = i + 1; j < lines.length && lines[j].top < lines[i].bottom - 1; ++j)
    if (lines[i].left < lines[j].right - 1 && lines[j].left < lines[i].right - 1)
      found.push(`text over text: ${name(lines[i].text)} and ${name(lines[j].text)}`);

if (!printed && document.documentElement.scrollWidth > page + 1)
  found.push(`the page is ${document.documentElement.scrollWidth} px wide on ${page} px`);
for (const box of document.querySelectorAll('body *')) {
  const style = getComputedStyle(box);
  if (box.closest('svg') || !scrolls(style)) continue;
  if (box.scrollHeight > box.clientHeight + 1)
    found.push(`cut off below: ${name(box.getAttribute('aria-label') || box.textContent)}`);
  if (printed && box.scrollWidth > box.clientWidth + 1)
    found.push(`cut off at the right: ${name(box.getAttribute('aria-label') || box.textContent)}`);
}
if (printed)
  for (const table of document.querySelectorAll('table')) {
    const head = table.querySelector('thead'), row = table.querySelector('tbody tr');
    if (head && getComputedStyle(head).display !== 'table-header-group')
      found.push(`heading is not repeated: ${name(table.textContent)}`);
    if (row && getComputedStyle(row).breakInside !== 'avoid')
      found.push(`a page may end within a row: ${name(table.textContent)}`);
    if (table.getBoundingClientRect().right > ends(table) + 1)
      found.push(`wider than the paper: ${name(table.textContent)}`);
  }

// A legend's keys and what they stand for.
const strokes = path => { const s = getComputedStyle(path);
  return [s.stroke, s.strokeWidth, s.strokeDasharray, s.fill].join(' '); };
// The shape without where it is: places along it, from its left upper corner.
function shape(path) {
  const box = path.getBBox(), length = path.getTotalLength();
  return Array.from({length: 13}, (_, i) => path.getPointAtLength(i / 12 * length))
    .flatMap(point => [point.x - box.x, point.y - box.y]);
}
const alike = (a, b) => a.every((place, i) => Math.abs(place - b[i]) < 0.8);  // of 9 px
for (const svg of document.querySelectorAll('svg')) {
  if (svg.getClientRects().length === 0 || svg.querySelector('svg')) continue;
  const title = name(svg.querySelector('title')?.textContent || 'chart');
  const looks = [];
  for (const series of svg.querySelectorAll('.series')) {
    const number = series.dataset.series;
    const key = svg.querySelector(`.key[data-series="${number}"]`);
    if (!key) { found.push(`no legend for series ${number} of ${title}`); continue; }
    const called = name(key.textContent);
    const [line, mark] = ['.line', '.mark'].map(part => {
      const inKey = key.querySelector(part), inPlot = series.querySelector(part);
      if (!inKey !== !inPlot)
        found.push(`${part.slice(1)} only in the ${inKey ? 'legend' : 'plot'}: ${called} of ${title}`);
      else if (inKey && strokes(inKey) !== strokes(inPlot))
        found.push(`${part.slice(1)} looks otherwise in the legend: ${called} of ${title}`);
      return inKey;
    });
    if (!mark) { found.push(`no marker in the legend: ${called} of ${title}`); continue; }
    for (const one of series.querySelectorAll('.mark'))
      if (!alike(shape(one), shape(mark))) {
        found.push(`marker of another shape in the legend: ${called} of ${title}`);
        break;
      }
    const style = getComputedStyle(mark);
    const look = [style.fill === style.stroke, line && getComputedStyle(line).strokeDasharray];
    for (const other of looks)
      if (alike(shape(mark), other.shape) && String(look) === String(other.look))
        found.push(`only colour tells ${called} from ${other.called} in ${title}`);
    looks.push({shape: shape(mark), look, called});
  }
}
return [...new Set(found)];
})
"""


class Browser:
    """Chromium without a window, driven over a pipe by its DevTools protocol."""

    def __init__(self, program):
        self.profile = tempfile.TemporaryDirectory(prefix="check_pages_", ignore_cleanup_errors=True)
        commands, self.to_browser = os.pipe()
        self.from_browser, answers = os.pipe()
        options = [
            "--headless=new", "--disable-gpu", "--disable-quic", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync",
            "--disable-dev-shm-usage", "--hide-scrollbars", "--remote-debugging-pipe",
            f"--user-data-dir={self.profile.name}",
        ]
        if os.geteuid() == 0:
            options.append("--no-sandbox")  # Chromium refuses to run as root otherwise
        self.process = subprocess.Popen(
            ["sh", "-c", f'exec "$@" 3<&{commands} 4>&{answers}', "sh", program, *options,
             "about:blank"],
            pass_fds=(commands, answers), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        os.close(commands)
        os.close(answers)
        self.unread, self.last_id, self.events, self.session = b"", 0, [], None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.call("Page.enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(ANSWER_S)
        self.profile.cleanup()

    def next_message(self):
        while b"\0" not in self.unread:
            if not select.select([self.from_browser], [], [], ANSWER_S)[0]:
                sys.exit("check_pages.py: Chromium does not answer")
            data = os.read(self.from_browser, 1 << 20)
            if not data:
                sys.exit("check_pages.py: Chromium ended; started as root in a container without "
                         "the rights it needs?")
            self.unread += data
        text, self.unread = self.unread.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, **parameters):
        self.last_id += 1
        message = {"id": self.last_id, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to_browser, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.next_message()
            if answer.get("id") != self.last_id:
                self.events.append(answer)
            elif "error" in answer:
                sys.exit(f"check_pages.py: {method}: {answer['error']['message']}")
            else:
                return answer["result"]

    def show(self, page, width, scheme="light", media=""):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=900,
                  deviceScaleFactor=1, mobile=width < 600)
        self.call("Emulation.setEmulatedMedia", media=media,
                  features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.events = []
        self.call("Page.navigate", url=page.resolve().as_uri())
        while not any(event.get("method") == "Page.loadEventFired" for event in self.events):
            self.events.append(self.next_message())

    def value_of(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        if "exceptionDetails" in answer:
            sys.exit(f"check_pages.py: {answer['exceptionDetails']['exception']['description']}")
        return answer["result"].get("value")

    def shoot(self, file):
        width, height = self.value_of(
            "[document.documentElement.clientWidth, document.documentElement.scrollHeight]")
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        data = self.call("Page.captureScreenshot", captureBeyondViewport=True, clip=clip)["data"]
        file.write_bytes(base64.b64decode(data))

    def print_to(self, file):
        data = self.call("Page.printToPDF", printBackground=True, paperWidth=8.27,
                         paperHeight=11.69, preferCSSPageSize=True)["data"]
        file.write_bytes(base64.b64decode(data))


def with_picture(svg, folder):
    """A page with nothing but this picture, as wide as there is room."""
    page = pathlib.Path(folder) / "picture.html"
    page.write_text('<!DOCTYPE html><html lang="en"><meta charset="utf-8">'
                    '<meta name="viewport" content="width=device-width">'
                    "<style>body { margin: 16px; background: #fff } "
                    "svg { display: block; max-width: 100%; height: auto }</style>"
                    f"<body>{svg.read_text(encoding='utf-8')}</body></html>", encoding="utf-8")
    return page


def check(browser, file, shots):
    """What is wrong with one page, a line each."""
    found = []
    page = with_picture(file, browser.profile.name) if file.suffix == ".svg" else file
    title = f"{file.resolve().parent.name}-{file.stem}"
    for width in WIDTHS_PX:
        for scheme in ("light", "dark"):
            browser.show(page, width, scheme)
            found += [f"{file}: {width} px, {scheme}: {what}"
                      for what in browser.value_of(MEASURE + "(false)")]
            if shots:
                browser.shoot(shots / f"{title}-{width}-{scheme}.png")
    browser.show(page, PRINT_PX, media="print")
    found += [f"{file}: printed: {what}" for what in browser.value_of(MEASURE + "(true)")]
    if shots:
        browser.show(page, WIDTHS_PX[-1])
        browser.print_to(shots / f"{title}.pdf")
        for eyes in ("protanopia", "deuteranopia", "tritanopia", "achromatopsia"):
            browser.call("Emulation.setEmulatedVisionDeficiency", type=eyes)
            browser.shoot(shots / f"{title}-{eyes}.png")
        browser.call("Emulation.setEmulatedVisionDeficiency", type="none")
    return found


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n")[0])
    parser.add_argument("--shots", type=pathlib.Path)
    parser.add_argument("pages", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    for page in arguments.pages:
        if not page.is_file():
            sys.exit(f"check_pages.py: {page} does not exist; give HTML or SVG files")
    names = [os.environ.get("CHROMIUM", ""), "chromium", "chromium-browser", "google-chrome"]
    program = next((found for found in map(shutil.which, filter(None, names)) if found), None)
    if not program:
        print("SKIPPED: no Chromium here, so that no page was looked at (Debian package chromium)")
        sys.exit(77)
    if arguments.shots:
        arguments.shots.mkdir(parents=True, exist_ok=True)
    found = []
    with Browser(program) as browser:
        for page in arguments.pages:
            found += check(browser, page, arguments.shots)
    for line in found:
        print(line)
    print(f"{len(arguments.pages)} pages, {len(WIDTHS_PX)} widths, light, dark and print: "
          f"{len(found)} found")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
