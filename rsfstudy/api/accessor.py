"""The accessor ``.rsf`` of datasets: which scene or study they are of, and what can be asked of
them. A dataset has it once xarray has opened a file, where this module is found as a backend, or
rsfstudy has made the dataset.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr
from xarray.backends import BackendEntrypoint

from rsfstudy._deprecation import renamed_members
from rsfstudy.error_boundary import error_boundary
from rsfstudy.errors import DataError

# all else is loaded when asked for: xarray imports this module whatever file it opens
if TYPE_CHECKING:
    import pandas as pd

    from rsfstudy.plots import Figure
    from rsfstudy.rig import Rig
    from rsfstudy.slider import Scene
    from rsfstudy.study import Study

_FOREIGN_DATASET_MESSAGE = (
    "the dataset is not of rsfstudy: it has neither the attribute 'scene' nor 'declaration'. "
    "Take it from rsfstudy.simulate, critical_step, limit_cycle, run or open, or from a file of "
    "theirs, with its attributes."
)


@renamed_members
@xr.register_dataset_accessor("rsf")  # type: ignore[no-untyped-call]
class Accessor:
    """What a dataset of rsfstudy says of itself: a motion, the answer for one scene, or the results
    of a study.

    Parameters
    ----------
    dataset : xarray.Dataset
        Any; one that is not of rsfstudy is refused with `DataError` when something is asked of it.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    @error_boundary
    def _repr_html_(self) -> str:
        """Return an HTML table of the dataset and the verdicts of its claims."""
        from rsfstudy.api import html_report

        self._require_rsfstudy_dataset()
        return html_report.dataset_html(self._dataset)

    @property
    @error_boundary
    def scene(self) -> Scene:
        """The scene: of results of a study that of the one cell that is selected, of a fit that
        with the parameters found.

        Raises
        ------
        InvalidValue
            Where no single cell is selected, or a part is a user's own and not known here.
        """
        from rsfstudy.api.fitted_parameters import fitted_scene
        from rsfstudy.reporting import is_fit
        from rsfstudy.storage import scene_of_dataset

        if is_fit(self._dataset):
            return fitted_scene(self._dataset)
        return scene_of_dataset(self._dataset, self.study if self._is_study else None)

    @property
    @error_boundary
    def rig(self) -> Rig:
        """The rig of one fit of a record, whose scales are those of ``.scene``: the slip distance
        and the stiffness of the fit, velocity and mean normal stress before the step. It turns
        motions of that scene into its units, as in ``rig.in_units(motion, length="um")``.

        Raises
        ------
        DataError
            Where the dataset is no fit.
        InvalidValue
            Where several fits are selected, or the record does not tell normal stress.
        """
        from rsfstudy.api.fitted_parameters import fitted_rig

        return fitted_rig(self._dataset)

    @property
    @error_boundary
    def study(self) -> Study:
        """The study that made the dataset, all of it, whatever is selected.

        Raises
        ------
        DataError
            Where the dataset is of one scene.
        InvalidValue
            Where the study has code of a user's own.
        """
        from rsfstudy.storage import study_of_dataset

        self._require_study()
        return study_of_dataset(self._dataset)

    @error_boundary
    def to_si(self, **scale_values: Any) -> xr.Dataset:
        """The dataset in SI units.

        Parameters
        ----------
        **scales
            ``normal_stress``, ``slip_distance`` and ``reference_rate`` of `rsfstudy.to_si`.
        """
        from rsfstudy.api.single_scene import to_si

        self._require_rsfstudy_dataset()
        return to_si(self._dataset, **scale_values)

    @error_boundary
    def in_units(self, *, stress: str = "MPa", length: str = "um", time: str = "s") -> xr.Dataset:
        """The results of a study of a rig in these units, by the scales that each cell has; all of
        them, as `rsfstudy.to_si` says.

        Parameters
        ----------
        stress, length, time : str
            Velocities and stiffnesses follow.

        Raises
        ------
        InvalidValue
            For units of another kind, and for results that hold no scales: those of no rig.
        """
        from rsfstudy.rig import convert_dataset_units, read_si_scales

        self._require_rsfstudy_dataset()
        return convert_dataset_units(
            self._dataset, read_si_scales(self._dataset), stress, length, time
        )

    @error_boundary
    def check(self) -> pd.DataFrame:
        """The claims of the study held against the dataset, as `rsfstudy.check` gives them: none
        applies in other units.
        """
        from rsfstudy.api import study_runs

        self._require_study()
        self._require_all_cells_present("claims are held against")
        return study_runs.check(self._dataset)

    @error_boundary
    def plot(self, *plot_arguments: Any, **plot_options: Any) -> Figure:
        """The figure of the results of a study, or the picture of a motion or a limit cycle, in the
        units that they have.

        Parameters
        ----------
        *what, **how
            As of `rsfstudy.plot` for the results of a study (`variable`, `style`), and as of
            `rsfstudy.plot_motion` for a motion or a cycle (`rig`, `against`).
        """
        from rsfstudy.api import study_runs
        from rsfstudy.plots import plot_motion

        if self._is_study:
            self._require_all_cells_present("figures show")
            return study_runs.plot(self._dataset, *plot_arguments, **plot_options)
        return plot_motion(self._dataset, *plot_arguments, **plot_options)

    @error_boundary
    def events(self, slip_rate: float | None = None) -> xr.Dataset:
        """The events of a motion: what is faster than a slip rate.

        Parameters
        ----------
        slip_rate : float, optional
            Over V_*; by default ten times the fastest load point velocity of the scene.

        Returns
        -------
        xarray.Dataset
            Along ``event``, in the units of the motion: ``time``, ``duration``, ``interval`` (since
            the event before began), ``peak_log10_slip_rate``, ``slip``, ``stress_before``,
            ``stress_after`` (the extremes of spring stress on either side), ``static_stress_drop``
            and ``dynamic_stress_drop``. Each is read within steps, and has beside it the error of
            reading; that of the motion is as its ``rtol``. ``cut`` says of which event the motion
            holds a part only: its numbers are those of that part.

        Raises
        ------
        DataError
            Where the dataset is no motion.
        InvalidValue
            For a slip rate that is not positive and finite.
        """
        from rsfstudy.api.motion_events import find_motion_events

        if self._is_study:
            raise DataError("the dataset is of a study: events are told of a motion of one scene")
        return find_motion_events(self._dataset, slip_rate, lambda: self.scene)

    @error_boundary
    def slip_mode(self, stick_slip_from: Any) -> xr.DataArray:
        """What sliders do in the end, where stick-slip begins at a slip rate in units.

        Parameters
        ----------
        stick_slip_from : quantity
            Peak slip rate from which a cycle is stick-slip and below which it is slow slip, as in
            ``"1 mm/s"``, or a number in m/s; `LimitCycle` says what it is otherwise.

        Returns
        -------
        xarray.DataArray
            `slip_mode` of the dataset, each cell by its own V_*: of results of a rig, or of a limit
            cycle in its units.

        Raises
        ------
        InvalidValue
            For what is no slip rate, and for a dataset that does not tell its scales.
        DataError
            For a dataset without limit cycles.
        """
        from rsfstudy.limit_cycles import SLIP_MODES
        from rsfstudy.rig import convert_to_si, unit_factor

        least = convert_to_si("stick_slip_from", stick_slip_from, "m/s")
        if "slip_mode" not in self._dataset:
            raise DataError("slip_mode is not there: the dataset is of no limit cycles")
        there = self._dataset if "max_slip_rate" in self._dataset else self.to_si()
        peak = there["max_slip_rate"]
        fast = peak * float(unit_factor("max_slip_rate", peak.attrs["units"], "m/s")) >= least
        modes, slow = self._dataset["slip_mode"], SLIP_MODES.index("slow_slip")
        return modes.where(~(modes >= slow), slow + fast).assign_attrs(modes.attrs)

    @error_boundary
    def to_dataframe(self) -> pd.DataFrame:
        """A table without columns that never change.

        Returns
        -------
        pandas.DataFrame
            Of results of a study a row a cell, of a motion a row a time, with what there is for
            each: orbits within cells are left out. Of another answer for one scene, its numbers in
            one row. What never changes is in ``attrs["constant"]``.
        """
        from rsfstudy.api.dataset_export import to_dataframe

        self._require_rsfstudy_dataset()
        return to_dataframe(self._dataset)

    @error_boundary
    def fit_table(self) -> pd.DataFrame:
        """One row a fit of a record, with the columns that laboratories use; lengths in um.

        Returns
        -------
        pandas.DataFrame
            ``a``, ``a_std``, ``b``, ``b_std``, ``Dc``, ``Dc_std`` and so on, of what was looked
            for; ``V0``, ``V1``, ``law``, ``window``, ``R2`` and ``status``.

        Raises
        ------
        DataError
            Where the dataset is no fit.
        """
        from rsfstudy.reporting import fit_table

        return fit_table(self._dataset)

    @error_boundary
    def sample_parameters(self, n: int, seed: int = 0) -> xr.Dataset:
        """Samples of the parameters of one fit, as its errors let them be.

        Parameters
        ----------
        n : int
            How many.
        seed : int

        Returns
        -------
        xarray.Dataset
            Each parameter along ``draw``, in its units, by Student's t. Slip distances and
            stiffness stay positive: their logarithms are drawn.

        Raises
        ------
        InvalidValue
            Where several fits are selected, or the record does not tell a parameter at all.
        """
        from rsfstudy.api.fitted_parameters import sample_parameters

        return sample_parameters(self._dataset, n, seed)

    @error_boundary
    def failures(self) -> pd.DataFrame:
        """The cells that failed or gave no number.

        Returns
        -------
        pandas.DataFrame
            One row a cell: its coordinates on the axes of the study, ``status`` and ``message``. Of
            one scene, a row without coordinates, or none.
        """
        import pandas as pd

        from rsfstudy.reporting import build_frame_of_cells
        from rsfstudy.status import Status
        from rsfstudy.storage import read_declaration

        if self._is_study:
            axes = [axis["dimension"] for axis in read_declaration(self._dataset).axes]
            return build_frame_of_cells(
                self._dataset, self._dataset["status"] != int(Status.OK), axes
            )
        ended = {name: self._dataset.attrs.get(name, "") for name in ("status", "message")}
        rows = [] if ended["status"] == Status.OK.label else [ended]
        return pd.DataFrame(rows, columns=list(ended))

    @property
    def _is_study(self) -> bool:
        self._require_rsfstudy_dataset()
        return "declaration" in self._dataset.attrs

    def _require_rsfstudy_dataset(self) -> None:
        if not {"scene", "declaration"} & set(self._dataset.attrs):
            raise DataError(_FOREIGN_DATASET_MESSAGE)

    def _require_all_cells_present(self, requested_action: str) -> None:
        """Refuse results of which cells were selected."""
        from rsfstudy.storage import read_declaration

        axes = [axis["dimension"] for axis in read_declaration(self._dataset).axes]
        selected = [name for name in axes if name not in self._dataset["status"].dims]
        if selected:
            text = (
                f"{requested_action} all results of a study, and of these {', '.join(selected)} "
                "is selected"
            )
            raise DataError(f"{text}. Ask the dataset as it was opened.")

    def _require_study(self) -> None:
        if not self._is_study:
            raise DataError("the dataset is of one scene: no study made it. Ask for its scene.")


class Backend(BackendEntrypoint):
    """``xarray.open_dataset(path, engine="rsfstudy")``, which checks the file as `rsfstudy.open`
    does. xarray loads it with all its backends, and with it the accessor.
    """

    description = "Results of rsfstudy, checked when they are opened"
    open_dataset_parameters = ("filename_or_obj", "drop_variables")

    def open_dataset(  # type: ignore[override]  # no other options: the file is read whole
        self, filename_or_obj: str | Path, *, drop_variables: str | Iterable[str] | None = None
    ) -> xr.Dataset:
        """The results in a file, in memory."""
        from rsfstudy.api import study_runs

        return study_runs.open(filename_or_obj).drop_vars(drop_variables or [])
