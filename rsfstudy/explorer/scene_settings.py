"""Settings of the scene view: the scene fields in the notation of Python code.

The settings contain texts such as ``"5 MPa"``. The view builds the scene from these texts, so the
code that the view shows reproduces the scene exactly.
"""

from __future__ import annotations

import json
import shlex
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Self

import xarray as xr

from rsfstudy.api import simulate
from rsfstudy.errors import InvalidValue
from rsfstudy.rig import DatasetUnits, Rig, read_protocol
from rsfstudy.slider import Scene, SceneFields

#: Name of the choice of loading whose segments are a table.
PROTOCOL_LOADING_NAME = "protocol"
#: Units of rigs on the page, by the scale of a scene field.
DISPLAY_UNIT_BY_SCALE_SYMBOL = {
    "sigma_*": "MPa", "D_c": "um", "V_*": "um/s", "D_c/V_*": "s", "sigma_*/D_c": "MPa/um",
    "V_*/D_c": "1/s",
}  # fmt: skip
#: SI value of each unit.
_SI_VALUE_BY_UNIT = {"MPa": 1e6, "um": 1e-6, "um/s": 1e-6, "s": 1.0, "MPa/um": 1e12, "1/s": 1.0}
#: Rig of the README, which is the default in units of a rig.
README_RIG_QUANTITIES = {
    "normal_stress": "5 MPa",
    "slip_distance": "10 um",
    "reference_velocity": "1 um/s",
    "stiffness": "0.05 MPa/um",
}
#: Number of characters of the arguments above which a call is written on several lines.
_MAX_ARGUMENT_LENGTH_OF_ONE_LINE_CALL = 70
QUANTITY_BY_SCENE_FIELD = {quantity.name: quantity for quantity in SceneFields.QUANTITIES}


@dataclass(frozen=True)
class SceneSettings:
    """Settings that define a scene, the motion of the scene, and the units.

    Parameters
    ----------
    scene : dict of str to object
        Fields of ``Scene``, or arguments of ``Rig.scene`` if there is a rig.
    rig : dict of str to str
        Quantities of the rig with units. Without a rig, the settings are dimensionless.
    protocol : str
        Table of the segments of the loading in the format of ``read_protocol``, or an empty string.
    duration : str
        Duration of the motion, or an empty string for the default.
    """

    scene: dict[str, Any] = field(default_factory=dict)
    rig: dict[str, str] = field(default_factory=dict)
    protocol: str = ""
    duration: str = ""

    @classmethod
    def from_widget_state(cls, widget_state: Mapping[str, Any]) -> Self:
        """Create settings from the state of a view.

        Parameters
        ----------
        widget_state : mapping of str to object
            State that ``as_widget_state`` returned.

        Returns
        -------
        SceneSettings
            Settings.

        Raises
        ------
        InvalidValue
            If a name is unknown, or if a value has the wrong type.
        """
        kinds = {each.name: type(getattr(cls(), each.name)) for each in fields(cls)}
        for name, value in widget_state.items():
            if name not in kinds:
                raise InvalidValue("state", name, "is unknown", choices=kinds)
            if not isinstance(value, kinds[name]):
                rule = f"must be {'an object' if kinds[name] is dict else 'a text'}"
                raise InvalidValue(f"state: {name}", value, rule)
        return cls(**widget_state)

    @classmethod
    def from_scene(cls, scene: Scene, rig: Rig | None = None) -> Self:
        """Create the settings of a scene.

        Parameters
        ----------
        scene : Scene
            Scene. Its values become dimensionless settings, or settings in units of the rig.
        rig : Rig, optional
            Rig of the scene.

        Returns
        -------
        SceneSettings
            Settings with the values that differ from the default values.
        """
        described, defaults = scene.describe(), SceneFields.map_field_names_to_defaults()
        values = {
            name: value
            for name, value in described.items()
            if value is not None and name not in ("segments", "samples")
            if value != defaults.get(name)
        }
        protocol = ""
        if values.pop("loading", None) is not None:
            protocol = format_protocol_as_csv(described.get("segments"))
        values = {"law": scene.law, "normal_stress": scene.normal_stress} | values
        if rig is None:
            return cls(values, protocol=protocol)
        derived = _find_fields_derived_from_rig(rig)
        quantities = {
            name: f"{value:.12g} {unit}"
            for name, (value, unit) in Rig.convert_quantities_for_display(rig.as_dict()).items()
        }
        converted = {
            find_dimensional_field_name(name): format_value_in_rig_units(rig, name, value)
            for name, value in values.items()
            if name not in derived
        }
        return cls(converted, quantities, protocol=protocol)

    def as_widget_state(self) -> dict[str, Any]:
        """Return the settings as a dictionary, without empty settings."""
        return {name: value for name, value in asdict(self).items() if value}

    def with_changed_field(self, field_name: str, value: Any) -> Self:
        """Return a copy of the settings with one scene field changed.

        If the value is None, the field is removed.
        """
        changed = {n: v for n, v in self.scene.items() if n != field_name}
        return replace(self, scene=changed if value is None else changed | {field_name: value})

    # ---- computation ----------------------------------------------------------------------------

    def build_rig(self) -> Rig | None:
        """Return the rig, or None if the settings are dimensionless."""
        return Rig(**self.rig) if self.rig else None

    def build_scene(self, rig: Rig | None) -> Scene:
        """Return the scene.

        Parameters
        ----------
        rig : Rig or None
            Rig that ``build_rig`` returned.

        Returns
        -------
        Scene
            Scene of the settings.
        """
        values = dict(
            SceneFields.replace_names_by_user_parts(self.scene, _find_user_defined_parts())
        )
        if self.protocol:
            with tempfile.TemporaryDirectory() as directory:
                path = Path(directory, "protocol.csv")
                path.write_text(self.protocol)
                values["loading"] = read_protocol(path, rig)
        return rig.scene(**values) if rig else Scene(**values)

    def simulate(self, scene: Scene, rig: Rig | None) -> xr.Dataset:
        """Return the motion of the scene.

        Parameters
        ----------
        scene : Scene
            Scene of the settings.
        rig : Rig or None
            Rig of the settings.

        Returns
        -------
        xarray.Dataset
            Dimensionless motion.
        """
        duration: float | None = None
        if self.duration:
            duration = rig.dimensionless(self.duration, name="duration") if rig else None
            duration = _parse_number("duration", self.duration) if rig is None else duration
        return simulate(scene, duration=duration, engine=choose_fastest_engine())

    # ---- reproduction ---------------------------------------------------------------------------

    def format_equivalent_python_code(self) -> str:
        """Return Python code that computes and saves the motion."""
        lines, values = ["import rsfstudy", ""], format_values_as_python_code(self.scene)
        for name, part in _find_user_defined_parts().items():
            for slot in [
                slot for slot in SceneFields.PART_SLOT_NAMES if self.scene.get(slot) == name
            ]:
                values[slot] = getattr(part, "__name__", name)
                lines.append(f"# Define or import the class {values[slot]} here.")
        rig_argument = ", rig" if self.rig else ""
        if self.rig:
            lines.append(
                "rig = "
                f"{format_python_call('rsfstudy.Rig', format_values_as_python_code(self.rig))}"
            )
        if self.protocol:
            lines.insert(0, "from pathlib import Path\n")
            lines.append(f'Path("protocol.csv").write_text("""{self.protocol}""")')
            lines.append(f'test = rsfstudy.read_protocol("protocol.csv"{rig_argument})')
            values["loading"] = "test"
        make = "rig.scene" if self.rig else "rsfstudy.Scene"
        lines.append(f"scene = {format_python_call(make, values)}")
        lines.append(f"motion = rsfstudy.simulate(scene{self._format_simulate_arguments()})")
        lines.append(f'rsfstudy.plot_motion(motion{rig_argument}).savefig("motion.png", dpi=300)')
        if self.rig:
            units = format_values_as_python_code(DatasetUnits.DISPLAY_UNITS)
            lines.append(f"motion = {format_python_call('rig.in_units', units, 'motion')}")
        lines.append('motion.to_netcdf("motion.nc")')
        lines.append('print(f"k/k_cr = {scene.stiffness_ratio:.6g}")')
        lines.append('print(f"peak friction {float(motion.friction_coefficient.max()):.6g}")')
        return "\n".join(lines)

    def _format_simulate_arguments(self) -> str:
        """Format the arguments that follow the scene in a call of ``rsfstudy.simulate``."""
        engine = f', engine="{choose_fastest_engine()}"'
        if not self.duration:
            return engine
        text = f"rig.dimensionless({json.dumps(self.duration)})" if self.rig else self.duration
        return f", duration={text}{engine}"

    def format_equivalent_command_line(self) -> str:
        """Return the command line that computes and saves the motion."""
        options = [f"--{name.replace('_', '-')}={value}" for name, value in self.rig.items()]
        options += [f"--set={name}={value}" for name, value in self.scene.items()]
        options += ["--protocol=protocol.csv"] if self.protocol else []
        options += [f"--duration={self.duration}"] if self.duration else []
        options += [f"--engine={choose_fastest_engine()}", "--output=motion.png"]
        command = shlex.join(["rsfstudy", "simulate", *options])
        if self.protocol:
            return f"cat > protocol.csv << 'END'\n{self.protocol.strip()}\nEND\n{command}"
        return command


def choose_fastest_engine() -> str:
    """Return the compiled engine if Numba is installed, and the SciPy engine otherwise."""
    return "compiled" if find_spec("numba") else "scipy"


def format_values_as_python_code(values: Mapping[str, Any]) -> dict[str, str]:
    """Return values as Python code, with double quotes."""
    return {
        name: json.dumps(value, ensure_ascii=False)
        if isinstance(value, str | list | dict)
        else repr(value)
        for name, value in values.items()
    }


def format_python_call(function_name: str, keywords: Mapping[str, str], *arguments: str) -> str:
    """Return a call as Python code, with one argument per line if the call is long."""
    parts = [*arguments, *(f"{name}={value}" for name, value in keywords.items())]
    if sum(map(len, parts)) < _MAX_ARGUMENT_LENGTH_OF_ONE_LINE_CALL:
        return f"{function_name}({', '.join(parts)})"
    return f"{function_name}(\n" + "".join(f"    {part},\n" for part in parts) + ")"


def format_protocol_as_csv(segments: Any) -> str:
    """Return the table of the segments of a protocol.

    Parameters
    ----------
    segments : sequence of mapping, or None
        Segments as ``Scene.describe`` returns them.

    Returns
    -------
    str
        Table in the format of ``read_protocol``, with dimensionless units.

    Raises
    ------
    InvalidValue
        If the loading has no segments, because it is a sampled history or a user-defined class.
    """
    if not segments:
        remedy = "Pass a scene with a built-in loading or with a protocol."
        raise InvalidValue("loading", "loading", "cannot be shown by widgets", remedy=remedy)
    rows = [dict(row) for row in (json.loads(segments) if isinstance(segments, str) else segments)]
    units = {
        "velocity": "V_*", "duration": "D_c/V_*", "distance": "D_c", "step": "D_c",
        "normal_stress": "sigma_*",
    }  # fmt: skip
    names = [name for name in units if any(row.get(name) is not None for row in rows)]
    lines = [", ".join(f"{name} ({units[name]})" for name in names)]
    for row in rows:
        cells = ("" if row.get(name) is None else f"{row[name]:.17g}" for name in names)
        lines.append(", ".join(cells))
    return "\n".join(lines) + "\n"


def find_dimensional_field_name(field_name: str) -> str:
    """Return the name of a field in rig units, such as ``load_velocity``."""
    quantity = QUANTITY_BY_SCENE_FIELD.get(field_name)
    is_velocity = quantity is not None and quantity.scale == "V_*" and "_ratio" in field_name
    return field_name.removesuffix("_ratio") if is_velocity else field_name


def format_value_in_rig_units(rig: Rig, field_name: str, value: Any) -> Any:
    """Format the value of a field with rig units.

    Parameters
    ----------
    rig : Rig
        Rig with the scales.
    field_name : str
        Name of the field.
    value : object
        Dimensionless value.

    Returns
    -------
    object
        Text with units. A value without a scale is returned unchanged.
    """
    quantity = QUANTITY_BY_SCENE_FIELD.get(field_name)
    if quantity is None or not quantity.scale or isinstance(value, bool | str):
        return value
    unit = DISPLAY_UNIT_BY_SCALE_SYMBOL[quantity.scale]
    return f"{value * get_rig_scale_in_display_units(rig, quantity.scale):.12g} {unit}"


def get_rig_scale_in_display_units(rig: Rig, scale_name: str) -> float:
    """Return a rig scale in the units shown on the page."""
    return (
        float(rig.si_scale_by_dimensionless_unit[scale_name].factor)
        / _SI_VALUE_BY_UNIT[DISPLAY_UNIT_BY_SCALE_SYMBOL[scale_name]]
    )


def _find_user_defined_parts() -> dict[str, Any]:
    """Return a mapping from names to the user-defined parts that this process has used."""
    return {name: part for slot in SceneFields.PART_SLOTS for name, part in slot.user_parts.items()}


def _find_fields_derived_from_rig(rig: Rig) -> set[str]:
    """Return the names of the fields that are computed from rig quantities."""
    plain = Scene().as_dict()
    of_rig = rig.scene(normal_stress=plain["normal_stress"]).as_dict()
    derived = {name for name, value in of_rig.items() if value not in (None, plain.get(name))}
    return derived | ({"stiffness_ratio"} if "stiffness" in derived else set())


def _parse_number(name: str, text: str) -> float:
    """Convert a text to a number."""
    try:
        return float(text)
    except ValueError as error:
        remedy = "Give a number in D_c/V_*, or choose the units of a rig."
        raise InvalidValue(name, text, "is not a number", remedy=remedy) from error
