# SPDX-License-Identifier: Apache-2.0
"""The stubs say what the module has, and every public name says what it is for."""

import ast
import inspect
import re
import typing
import unittest
from pathlib import Path

from support import main

import palpate
from palpate import _palpate

_SPECIAL = {"__init__", "__len__"}  # that a class of ours may define


def is_ours(name):
    return not name.startswith("_") or name in _SPECIAL


def stub_of(node):
    """Names in a class or module of a stub; functions with their arguments."""
    names = {}
    for part in node.body:
        if isinstance(part, ast.FunctionDef):
            is_value = any(getattr(d, "id", "") == "property" for d in part.decorator_list)
            arguments = [a.arg for a in part.args.args if a.arg != "self"]
            names[part.name] = None if is_value else arguments
        elif isinstance(part, ast.ClassDef):
            names[part.name] = stub_of(part)
        elif isinstance(part, ast.AnnAssign):
            names[part.target.id] = None
    return names


def module_of(thing):
    """The same of the module itself."""
    names = {}
    for name, value in vars(thing).items():
        if not is_ours(name):
            continue
        if isinstance(value, type):
            names[name] = module_of(value)
        elif callable(value) or isinstance(value, staticmethod):
            signature = getattr(thing, name).__doc__.splitlines()[0]
            if name == "__init__" and "self: " not in signature:
                continue  # nobody makes one from Python
            arguments = re.findall(r"(\w+): ", signature[signature.index("(") :])
            names[name] = [argument for argument in arguments if argument != "self"]
        else:
            names[name] = None
    return names


class Stubs(unittest.TestCase):
    def test_the_stub_has_what_the_module_has(self):
        file = Path(_palpate.__file__).parent / "_palpate.pyi"
        stub = stub_of(ast.parse(file.read_text()))
        self.assertGreater(len(stub), 10)
        self.assertEqual(stub, module_of(_palpate))

    def test_the_package_is_marked_as_typed(self):
        self.assertTrue((Path(palpate.__file__).parent / "py.typed").is_file())

    def test_every_public_name_is_documented_and_annotated(self):
        seen = 0
        for name in palpate.__all__:
            value = getattr(palpate, name)
            if isinstance(value, str):
                continue
            self.assertTrue(inspect.getdoc(value), name)
            members = [(name, value)]
            if isinstance(value, type):
                members += [
                    (f"{name}.{part}", member)
                    for part, member in vars(value).items()
                    if not part.startswith("_")
                ]
            for path, member in members:
                function = member.fget if isinstance(member, property) else member
                function = getattr(function, "__func__", function)
                if isinstance(member, property):
                    self.assertTrue(inspect.getdoc(member), path)
                if not inspect.isfunction(function):
                    continue
                seen += 1
                self.assertTrue(inspect.getdoc(function), path)
                hints = set(function.__annotations__)
                wanted = set(inspect.signature(function).parameters) - {"self", "cls"}
                self.assertEqual(wanted | {"return"}, hints, path)
        self.assertGreater(seen, 30)
        self.assertTrue(typing.get_type_hints(palpate.Loop.frame))


if __name__ == "__main__":
    main()
