"""A gate for changes that must not change numbers: two work trees, compared on this machine.

    python tests/gate.py compare REFERENCE               # events, samples, files: some minutes
    python tests/gate.py compare REFERENCE --studies     # and all named studies, by SciPy
    python tests/gate.py compare REFERENCE --studies --engine compiled --only limit_cycles,laws
    python tests/gate.py freeze                          # writes frozen_events.json anew
    python tests/gate.py sensitivity                     # what a last bit does to the frozen events

REFERENCE is a work tree of an earlier commit (`git worktree add REFERENCE COMMIT`); the other is
the one this file stands in. Each tells its numbers in a process of its own, by the interpreter
`.venv/bin/python` in it, in which the tree is installed (`pip install --no-deps -e TREE`). What is
asked of both is what `telling.py` and `frozen_scenes.py` beside this file ask; where a name that
they import moves, let them try the new one first. Programs that one tree has compiled never serve
the other.

What one tree tells and the other does not is listed, and fails nothing; all else that differs by
more than a tolerance does, and the exit status is 1. Differences are relative: those of events to
what `telling.apart` says, those of others to the largest number of their kind, and those of an
error estimate to the number it is of. What depends on where steps end (that slip has settled or a
regime changes, samples within steps, studies) has a tolerance of its own for the compiled engine:
a last bit moves ends of steps farther than it moves motions. Studies that measure time are left
out.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

ENGINES = ("scipy", "compiled")
HERE = Path(__file__).resolve().parents[1]
FROZEN = Path(__file__).with_name("frozen_events.json")
#: How a motion with another last bit is made; and by how much a tolerance is changed.
LAST_BIT, SLIGHTLY = 2.3e-16, 1e-9


def tell(asked: argparse.Namespace) -> None:
    """Write what the tree of this interpreter tells to a file."""
    import telling

    import rsfstudy
    from rsfstudy import named_studies

    for package in (rsfstudy, named_studies):
        (place,) = package.__path__
        if asked.tree not in Path(place).resolve().parents:
            sys.exit(f"{sys.executable} has {package.__name__} in {place}.")
    warnings.simplefilter("ignore")
    answers, folder = telling.Answers(), asked.answers.parent
    for engine in ENGINES:
        telling.tell_events(answers, engine)
        telling.tell_samples(answers, engine)
    telling.tell_files(answers, folder / "files")
    if asked.studies:
        telling.tell_studies(answers, folder / "studies", asked.engine, asked.only)
    asked.answers.write_text(json.dumps(asdict(answers)))


# ---- what differs --------------------------------------------------------------------------------


@dataclass
class Group:
    """How one group of numbers, or of texts, differs."""

    equal: int = 0
    all: int = 0
    worst: float = 0.0
    where: str = ""
    alone: list[str] = field(default_factory=list)

    def add(self, label: str, off: list[float]) -> None:
        """Add the differences of one label."""
        self.all += len(off)
        self.equal += off.count(0.0)
        if max(off, default=0.0) > self.worst:
            self.worst = max(off)
            self.where = f"{label} [{off.index(self.worst)}]"


def differences(reference: list[float], ours: list[float], least: float) -> list[float]:
    """Relative differences, number by number; infinite where there are not as many, or one is
    finite.
    """
    if len(reference) != len(ours):
        return [math.inf] * max(len(reference), len(ours))
    scale = max([least, *(abs(value) for value in reference if math.isfinite(value))])
    off = []
    for a, b in zip(reference, ours, strict=True):
        same = a == b or (math.isnan(a) and math.isnan(b))
        far = not (math.isfinite(a) and math.isfinite(b) and scale)
        off.append(0.0 if same else math.inf if far else abs(a - b) / scale)
    return off


def compared(reference: dict[str, Any], ours: dict[str, Any]) -> Iterator[tuple[str, Group]]:
    """All groups, by what they are called."""
    for kind in ("texts", "numbers"):
        groups = {**reference[kind], **ours[kind]}
        for name in sorted(groups):
            group = Group()
            before, after = (tree[kind].get(name, {}) for tree in (reference, ours))
            group.alone = [f"{label} (of the reference)" for label in before.keys() - after.keys()]
            group.alone += [f"{label} (of this tree)" for label in after.keys() - before.keys()]
            for label in sorted(before.keys() & after.keys()):
                if kind == "texts":
                    group.add(label, [0.0 if before[label] == after[label] else math.inf])
                else:
                    least, values = before[label]
                    group.add(label, differences(values, after[label][1], least))
            yield f"{name}, {kind}", group


def allowed(name: str, asked: argparse.Namespace) -> float:
    """The tolerance of a group."""
    if name.endswith("texts"):
        return 0.0
    if name.startswith("work"):
        return float(asked.tolerance_work)
    if "scipy" in name:
        return float(asked.tolerance_scipy)
    steps = name.startswith(("steps", "samples", "studies"))
    return float(asked.tolerance_steps if steps else asked.tolerance_compiled)


def compare(asked: argparse.Namespace) -> int:
    """Have both trees tell, and print what differs."""
    with tempfile.TemporaryDirectory() as place:
        folder = (asked.folder or Path(place)).resolve()
        trees = {"reference": asked.reference.resolve(), "ours": HERE}
        found = [answers_of(tree, folder / name, asked) for name, tree in trees.items()]
    console, passed = Console(width=None if sys.stdout.isatty() else 140), True
    table = Table("", "identical", "of", "largest difference", "tolerance", "where")
    for name, group in compared(*found):
        most = allowed(name, asked)
        passed &= group.worst <= most
        colour = "" if group.worst <= most else "[red]"
        numbers = f"{group.equal}", f"{group.all}", f"{colour}{group.worst:.2g}", f"{most:g}"
        table.add_row(name, *numbers, group.where)
        for label in group.alone:
            console.print(f"{name}: only one tree has {label}", style="yellow", highlight=False)
    console.print(table)
    return 0 if passed else 1


def answers_of(tree: Path, folder: Path, asked: argparse.Namespace) -> dict[str, Any]:
    """What a tree tells, in a process of its own."""
    interpreter = tree / ".venv/bin/python"
    if not interpreter.exists():
        sys.exit(f"{tree} has no interpreter of its own.\n{remedy(tree)}")
    folder.mkdir(parents=True, exist_ok=True)
    answers = folder / "answers.json"
    words = [interpreter, __file__, "tell", tree, answers, "--engine", asked.engine]
    words += [*(["--studies"] if asked.studies else []), "--only", ",".join(asked.only)]
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    surroundings = {**kept, "XDG_CACHE_HOME": str(folder / "cache")}
    done = subprocess.run([*map(str, words)], cwd=folder, env=surroundings, check=False)
    if done.returncode:
        failed = f"{tree} told nothing: {interpreter} ended with {done.returncode}."
        sys.exit(f"{failed}\nIs the tree installed there? {remedy(tree)}")
    found: dict[str, Any] = json.loads(answers.read_text())
    return found


def remedy(tree: Path) -> str:
    """How to make the interpreter of a tree."""
    python = f"{tree}/.venv/bin/python"
    return f"Make it: python -m venv {tree}/.venv && {python} -m pip install -e '{tree}[test]'"


# ---- the frozen events ---------------------------------------------------------------------------


def freeze(_asked: argparse.Namespace) -> int:
    """Write the events of all frozen scenes, by SciPy, and the work of both engines."""
    from frozen_scenes import MOTIONS
    from telling import told

    frozen = {}
    for name, motion in MOTIONS.items():
        found, other = (told(motion, engine) for engine in ENGINES)
        work = {"scipy": found.work[-1:], "compiled": other.work[-1:]}
        frozen[name] = {"kinds": found.kinds, "work": work, "numbers": found.numbers}
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(it)}" for name, it in frozen.items())
    FROZEN.write_text(f"{{\n{lines}\n}}\n")
    return 0


def sensitivity(asked: argparse.Namespace) -> int:
    """Print how far events move with a last bit of all fields, and with a slight change of rtol."""
    from frozen_scenes import MOTIONS
    from telling import apart, told

    from rsfstudy import Scene

    chance, table = random.Random(asked.seed), Table("", "last bits", "steps", "rtol")
    for name, motion in MOTIONS.items():
        reference = told(motion, "scipy")
        fields = {"mu_star": 0.76, **motion.fields}
        numbers = [n for n, value in fields.items() if type(value) is float]
        off = [apart(motion, reference, told(motion, "compiled"))]
        for _ in range(asked.draws):
            moved = {n: fields[n] * (1.0 + chance.choice((-1, 0, 1)) * LAST_BIT) for n in numbers}
            scene = Scene(**fields | moved)
            off += [apart(motion, reference, told(motion, engine, scene)) for engine in ENGINES]
        other = told(motion._replace(rtol=motion.rtol * (1.0 + SLIGHTLY)), "scipy")
        of_rtol = max(apart(motion, reference, other))
        table.add_row(
            name, *(f"{max(each):.1e}" for each in zip(*off, strict=True)), f"{of_rtol:.1e}"
        )
    Console().print(table)
    return 0


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    told, comparing = commands.add_parser("tell"), commands.add_parser("compare")
    told.add_argument("tree", type=Path)
    told.add_argument("answers", type=Path)
    comparing.add_argument("reference", type=Path)
    comparing.add_argument("--folder", type=Path, help="where to keep what both tell")
    comparing.add_argument("--tolerance-scipy", type=float, default=0.0)
    comparing.add_argument("--tolerance-compiled", type=float, default=1e-12)
    comparing.add_argument("--tolerance-steps", type=float, default=1e-8, help="compiled")
    comparing.add_argument("--tolerance-work", type=float, default=0.02, help="a share")
    for command in (told, comparing):
        command.add_argument("--studies", action="store_true", help="named studies too")
        command.add_argument("--engine", choices=ENGINES, default="scipy", help="of studies")
        command.add_argument("--only", type=lambda t: [*filter(None, t.split(","))], default=[])
    commands.add_parser("freeze")
    moving = commands.add_parser("sensitivity")
    moving.add_argument("--draws", type=int, default=20)
    moving.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    does = {"tell": tell, "compare": compare, "freeze": freeze, "sensitivity": sensitivity}
    return does[asked.command](asked) or 0


if __name__ == "__main__":
    sys.exit(main())
