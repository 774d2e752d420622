# SPDX-License-Identifier: Apache-2.0
"""Every block of Python on every page runs, and the page on Python says what comes out."""

import contextlib
import importlib.util
import io
import os
import re
import shlex
import shutil
import tempfile
import unittest

from support import ROOT, main, run_command

import palpate

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]
PAGE = (ROOT / "docs" / "python.md").read_text()

# Commands that a page says in its text: what its blocks need, and what can be done after them.
BEFORE = {"files.md": ["palpate trace examples/cavity.toml --out t"]}
AFTER = {"files.md": ["palpate trace examples/cavity.toml --device path:path.csv --out mine"]}
# Blocks need these besides numpy; a machine need not have them.
OPTIONAL = {
    "h5py": r"h5py|\bframes\[",
    "pandas": "dataframe",
    "distributed": "distributed",
}


def blocks_of(text):
    """The blocks to run: those that say "not run: WHY" are not (tests/readme/code_blocks.h)."""
    return re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


class Page(unittest.TestCase):
    said = {}

    def said_by(self, page):
        """What each block of a page says, run one after the other in a folder with examples/."""
        if page in self.said:
            return self.said[page]
        text, names, before = page.read_text(), {}, os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(ROOT / "examples", f"{folder}/examples")
            os.chdir(folder)
            try:
                self.run_commands(BEFORE, page.name, text)
                said = [self.run_block(block, page.name, names) for block in blocks_of(text)]
                self.said[page] = said
                self.run_commands(AFTER, page.name, text)
            finally:
                os.chdir(before)
        return said

    def run_commands(self, commands, page, text):
        for line in commands.get(page, []):
            self.assertIn(line, text)
            done = run_command(*shlex.split(line)[1:], cwd=os.getcwd())
            self.assertEqual(done.returncode, 0, done.stderr)

    def run_block(self, block, page, names):
        for module, use in OPTIONAL.items():
            if re.search(use, block) and importlib.util.find_spec(module) is None:
                return ""
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(compile(block, page, "exec"), names)
        return said.getvalue()

    def test_blocks_of_each_page_run_one_after_the_other(self):
        pages = [page for page in PAGES if blocks_of(page.read_text())]
        self.assertGreater(len(pages), 1)
        for page in pages:
            with self.subTest(page.name):
                said = self.said_by(page)
                for block, words in zip(blocks_of(page.read_text()), said):
                    self.assertNotIn("False", words, block)

    def test_the_page_on_python_says_what_comes_out(self):
        said = self.said_by(ROOT / "docs" / "python.md")
        self.assertGreater(len(said), 6)
        self.assertEqual(said[0], "skin 1.0 N upwards\n")
        self.assertIn("dict: radius_mm = -3", said[-1])

    def test_the_page_on_files_reads_what_a_trace_has_written(self):
        page = ROOT / "docs" / "files.md"
        said = self.said_by(page)
        rows, force_n = re.fullmatch(r"(\d+) frames, largest force (\S+) N\n", said[3]).groups()
        self.assertGreater(int(rows), 1000)
        self.assertGreater(float(force_n), 0.1)
        if importlib.util.find_spec("h5py") is not None:
            self.assertRegex(said[0], rf"^[1-9]\d* of {rows} frames in contact\ndepth: ")
            self.assertRegex(said[1], r"^wall: [1-9]\d* times, at most ")

    def test_the_first_program_has_fifteen_lines_at_most(self):
        self.assertLessEqual(len(blocks_of(PAGE)[0].splitlines()), 15)

    def test_it_names_everything_public(self):
        public = [name for name in palpate.__all__ if not name.startswith("_")]
        named = [name for name in public if re.search(rf"palpate\.{name}\b|`{name}[`(]", PAGE)]
        self.assertEqual(named, public)


if __name__ == "__main__":
    main()
