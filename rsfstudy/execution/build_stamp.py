"""How a wheel is built: as ever, and with the commit that it is built from. Nothing else imports
this; setuptools loads it by its path, without the package.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from setuptools.command.build_py import build_py


class BuildWithCommit(build_py):  # type: ignore[misc]  # of which there are no types
    """The modules of the package, and beside them ``commit.txt``, where git knows the commit."""

    def run(self) -> None:
        """Build, and write the commit."""
        super().run()
        if self.editable_mode:  # the checkout itself is asked
            return
        # tags could be of other names
        words = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        try:
            commit = subprocess.check_output(words, text=True, stderr=subprocess.DEVNULL)
        except (OSError, subprocess.SubprocessError):
            return
        text = commit.replace("-dirty", " with uncommitted changes")
        Path(self.build_lib, "rsfstudy", "commit.txt").write_text(text)
