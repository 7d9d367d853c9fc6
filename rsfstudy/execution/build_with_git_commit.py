"""Setuptools build command that stores the commit in wheels of the package.

Setuptools loads this module by its path, without importing the package. The module is not imported
by any other module.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from setuptools.command.build_py import build_py


class BuildPyWithGitCommit(build_py):  # type: ignore[misc]  # Setuptools has no type hints.
    """Setuptools build command that writes the commit to a file in the package.

    The command writes the file ``commit.txt``. If git cannot determine the commit, the file is not
    written.
    """

    def run(self) -> None:
        """Build the modules, and write the commit to a file."""
        super().run()
        if self.editable_mode:  # An editable installation reads the commit from the checkout.
            return
        # All tags are excluded, so that the output is always the hash of the commit.
        words = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        try:
            commit = subprocess.check_output(words, text=True, stderr=subprocess.DEVNULL)
        except (OSError, subprocess.SubprocessError):
            return
        text = commit.replace("-dirty", " with uncommitted changes")
        Path(self.build_lib, "rsfstudy", "commit.txt").write_text(text)
