# SPDX-License-Identifier: Apache-2.0
"""How the programs of this folder end and write. A program imports this before anything that needs
numpy, so that one line says what is missing."""

import importlib.util
import os
import pathlib
import signal
import sys

NAME = pathlib.Path(sys.argv[0]).name


class BadInput(Exception):
    """One line: FILE[:LINE]: what is wrong; what to do."""


def say(words):
    print(f"{NAME}: {words}", file=sys.stderr)


if importlib.util.find_spec("numpy") is None:
    say(f"numpy is missing for {sys.executable}; install it with: apt-get install python3-numpy, "
        "or: pip install numpy")  # fmt: skip
    sys.exit(2)


def end_with(main):
    """Ends with the status that main() returns; with 2 where it refuses its input."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # as when head has read enough
    try:
        status = main()
    except BadInput as error:
        say(error)
        status = 2
    except OSError as error:
        say(f"{error.filename or 'a file'}: {error.strerror}; mend this and run it again")
        status = 2
    except KeyboardInterrupt:
        status = 130
    sys.exit(status)


def end_as_part(module, program):
    """Ends where a module is run that is no program."""
    if module == "__main__":
        say(f"is a part of {program} and no program; run {program} --help")
        sys.exit(2)


def read_text(file):
    try:
        return file.read_text(encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{file}: cannot be read ({error.strerror}); give a file that is "
                       "there") from error  # fmt: skip
    except UnicodeDecodeError as error:
        raise BadInput(f"{file}: is no text; give a text file") from error


def check_writable(file):
    """Refuses what cannot be written, before any work is done for it."""
    part = file.with_name(file.name + ".part")
    try:
        if file.is_dir():
            raise IsADirectoryError(0, "it is a folder")
        with part.open("a"):
            pass
        part.unlink()
    except OSError as error:
        raise BadInput(f"{file}: cannot be written ({error.strerror}); name a file in a folder "
                       "that is there") from error  # fmt: skip


def write_whole(file, text):
    """The file has its name only when it is complete."""
    check_writable(file)
    part = file.with_name(file.name + ".part")
    part.write_bytes(text.encode())
    os.replace(part, file)


def make_folder(folder):
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"{folder}: cannot be made a folder ({error.strerror}); name a folder that "
                       "can be written") from error  # fmt: skip
