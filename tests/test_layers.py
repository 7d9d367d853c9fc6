"""Tests of the layers of the package.

Packages import from lower layers only, and heavy libraries are imported by few modules.
"""

import ast
import importlib.util
import itertools
import re
import subprocess
import sys
from pathlib import Path

import rsfstudy
from rsfstudy import slider
from rsfstudy.cli.commands import MODULE_BY_COMMAND
from rsfstudy.execution import cell_computation
from rsfstudy.study import named_study_index, study_loader

ROOT = Path(rsfstudy.__file__).parent

FILES = sorted(ROOT.rglob("*.py"))
#: Layers from bottom to top. Each package imports from lower layers only. The studies and their
#: pages are above all layers.
FLOORS = (
    ("_deprecation",),
    ("errors", "status", "defaults", "formatting", "_lazy_exports", "_former_modules"),
    ("object_digest",),
    ("argument_checks",),
    ("exception_conversion",),
    ("former_data_names", "netcdf_encoding", "path_checks", "quantities"),
    ("slider",),
    ("parts", "vocabulary"),
    ("axes", "motion"),
    ("measure_base",),
    ("critical_steps", "limit_cycles", "responses", "fitting"),
    ("measures", "rig"),
    ("study",),
    ("reductions", "referee"),
    ("storage",),
    ("execution", "plots"),
    ("reporting",),
    ("api",),
    ("explorer",),
    ("__init__",),
    ("cli",),
    ("named_studies",),
)
#: Modules that may import a library which is slow to import.
HOMES = {
    "dask": {"execution/dask_clusters", "storage/dataset_files", "storage/zarr_store"},
    "distributed": {"execution/dask_clusters", "execution/worker_pool", "execution/worker_log"},
    "llvmlite": {"motion/compiled/compile_cache", "motion/compiled/array_operations"},
    "matplotlib": {"plots"},
    "numba": {
        "motion/compiled/compile_cache",
        "motion/compiled/array_operations",
        "motion/compiled/numba_backend",
    },
    "bokeh": {"explorer"},
    "click": {"cli"},
    "panel": {"explorer"},
    "tornado": {"explorer/server"},
    "pint": {"rig/units"},
    "rich": {"cli", "api/progress"},
    "sqlite3": {"storage/cell_journal"},
    "zarr": set(),  # xarray writes and reads Zarr stores.
    "msgspec": {
        "storage/stored_declarations",
        "storage/plain_data_conversion",
        "storage/study_reconstruction",
        "referee/benchmark_problem_files",
    },
}


def imports(file: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def room(file: Path) -> str:
    return file.relative_to(ROOT).parts[0].removesuffix(".py")


def test_every_module_has_a_floor():
    # An editable install leaves the named studies in studies/.
    rooms = {room(file) for file in FILES} | {"named_studies"}
    assert rooms == set(itertools.chain(*FLOORS))


def test_imports_point_down():
    """Imports go from higher to lower layers, including type imports.

    A reader can therefore read the layers from bottom to top.
    """
    floor = {name: number for number, names in enumerate(FLOORS) for name in names}
    for file in FILES:
        for name in imports(file):
            package, _, within = name.partition(".")
            to = within.partition(".")[0]
            # The top-level package exports the functions for users.
            to = to if to in floor else "__init__"
            if package == "rsfstudy" and within and to != room(file):
                assert floor[to] < floor[room(file)], f"{file} imports {name}"


def test_no_circle_of_modules():
    """There are no circular imports.

    Imports inside functions are included, but type imports are not.
    """
    modules = set(map(name_of, FILES))
    asks = {name_of(file): needed(file, modules) for file in FILES}
    while free := [name for name, others in asks.items() if not others & set(asks)]:
        for name in free:
            del asks[name]
    assert not asks, f"import one another: {sorted(asks)}"


def needed(file: Path, modules: set[str]) -> set[str]:
    """Return the modules that a file imports, except for types."""
    tree = ast.parse(file.read_text())
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = [ast.Pass()]
    found = set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            named = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= named if named <= modules else named | {str(node.module)}
    return found & modules - {name_of(file)}


def name_of(file: Path) -> str:
    return ".".join(file.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__")


def test_heavy_libraries_stay_in_their_rooms():
    for file in ROOT.rglob("*.py"):
        for name in imports(file):
            home = HOMES.get(name.split(".")[0])
            place = file.relative_to(ROOT).with_suffix("").as_posix()
            assert home is None or {room(file), place} & home, f"{file} imports {name}"


def test_physics_is_plain_python():
    """The slider package imports neither xarray nor Dask.

    Its parts import the standard library only.
    """
    for file in (ROOT / "slider").rglob("*.py"):
        top = file.parent.name == "slider"
        allowed = {"rsfstudy", *sys.stdlib_module_names, *(("numpy", "scipy") if top else ())}
        for name in imports(file):
            assert name.split(".")[0] in allowed, f"{file} imports {name}"


def test_the_guide_to_the_physics_names_modules_that_are_there():
    """The modules in the table of equations exist."""
    rows = [line for line in (slider.__doc__ or "").splitlines() if line.startswith("    ")]
    named = {name.strip() for row in rows for name in row[56:].split(",")}
    assert len(rows) == 11
    for name in named:
        assert importlib.util.find_spec(f"rsfstudy.slider.{name}"), name


def test_studies_load_nothing_that_draws():
    """Loading the studies does not import Matplotlib."""
    asked = (
        "import sys; from rsfstudy.study import study_loader as catalogue\n"
        "from rsfstudy.study import named_study_index as names\n"
        "for name in names.list_study_names(): catalogue.load_study(name)\n"
        "print(*{'matplotlib'} & set(sys.modules))"
    )
    ran = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == ""


def test_a_worker_loads_nothing_more_for_a_measure_in_the_file_of_a_study(tmp_path):
    """A worker receives the measure of a study, but no plots or reductions."""
    for name in named_study_index.list_study_names():
        study = study_loader.load_study(name)
        task = cell_computation.SharedCellSettings(study.base, study.measure, study.accuracy)
        (tmp_path / name).write_bytes(cell_computation.serialize_cell_settings(task))
    heavy = {"xarray", "pandas", "matplotlib", "netCDF4", "numba"}
    asked = (
        "import pathlib, pickle, sys, rsfstudy.execution.cell_computation\n"
        f"sent = [file.read_bytes() for file in pathlib.Path({str(tmp_path)!r}).iterdir()]\n"
        "print(len([pickle.loads(task) for task in sent]))\n"
        f"print(*{heavy} & set(sys.modules))"
    )
    ran = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert ran.stdout.split("\n") == [str(len(named_study_index.list_study_names())), "", ""]


HEAVY = (
    "numpy scipy pandas xarray netCDF4 matplotlib dask distributed numba rich importlib.metadata"
)


def test_help_and_the_list_of_studies_load_next_to_nothing():
    """Help texts and the list of studies do not import heavy libraries."""
    lines = [["--help"], ["list"], ["list", "--json"], *([n, "--help"] for n in MODULE_BY_COMMAND)]
    asked = (
        "import contextlib, sys; from rsfstudy.cli.command_line import main\n"
        f"for words in {lines}:\n"
        "    sys.argv = ['rsfstudy', *words]\n"
        "    with contextlib.suppress(SystemExit): main()\n"
        f"    print('loaded:', *set({HEAVY.split()}) & set(sys.modules))"
    )
    ran = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    *answers, after = ran.stdout.split("loaded:\n")
    assert (len(answers), after) == (len(lines), "")
    assert all(len(answer.splitlines()) > 6 for answer in answers)


def test_no_function_takes_an_accuracy_and_a_meter():
    """An integrator contains both, so no function takes the two arguments."""
    found = []
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef):
                arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
                texts = {ast.unparse(argument) for argument in arguments}
                accuracies = [t for t in texts if re.search(r"\baccuracy\b|\bAccuracy\b", t)]
                meters = [t for t in texts if re.search(r"meter\b|\bWorkMeter\b", t)]
                meters = [t for t in meters if "parameter" not in t.lower()]
                if accuracies and meters:
                    found.append(f"{file.name}:{node.name}")
    assert found == []
