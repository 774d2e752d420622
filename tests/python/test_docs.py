# SPDX-License-Identifier: Apache-2.0
"""Every block of code on the page about Python runs, and says what the page says."""

import contextlib
import importlib.util
import io
import os
import re
import tempfile
import unittest

from support import ROOT, main

import palpate

PAGE = (ROOT / "docs" / "python.md").read_text()


class Page(unittest.TestCase):
    def test_its_blocks_run_one_after_the_other(self):
        blocks = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
        self.assertGreater(len(blocks), 6)
        names, before = {}, os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                said = [self.run_block(block, names) for block in blocks]
            finally:
                os.chdir(before)
        self.assertEqual(said[0], "skin 1.0 N upwards\n")
        self.assertIn("dict: radius_mm = -3", said[-1])
        for block, words in zip(blocks, said):
            self.assertNotIn("False", words, block)

    def run_block(self, block, names):
        if "dataframe" in block and importlib.util.find_spec("pandas") is None:
            return ""
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(compile(block, "docs/python.md", "exec"), names)
        return said.getvalue()

    def test_the_first_program_has_fifteen_lines_at_most(self):
        block = re.search(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)[1]
        self.assertLessEqual(len(block.splitlines()), 15)

    def test_it_names_every_public_class_of_errors_and_function(self):
        for name in palpate.__all__:
            if name[0] == name[0].lower() and not name.startswith("_") or name.endswith("Error"):
                self.assertIn(f"{name}", PAGE)


if __name__ == "__main__":
    main()
