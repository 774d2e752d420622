# SPDX-License-Identifier: Apache-2.0
"""What the package raises beside TypeError, KeyError, MemoryError and KeyboardInterrupt."""


class Error(Exception):
    """An error of the package: one line that says where, what is wrong and what to do."""


class SceneError(Error, ValueError):
    """A scene that cannot be felt as it is written, or a file that it names."""


class FileError(Error, OSError):
    """A file that was named: missing, damaged, of another kind, or not to be written."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class ArgumentError(Error, ValueError):
    """An argument that is out of range, of the wrong shape, or goes with nothing else."""
