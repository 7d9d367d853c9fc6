"""Accessor ``.rsf`` of xarray datasets, and the xarray backend of rsfstudy.

The accessor is registered when xarray loads its backends, and when rsfstudy returns a dataset.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr
from xarray.backends import BackendEntrypoint

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.errors import DataError
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.former_data_names import rename_former_variables

# Other modules are imported inside the methods, because xarray imports this module even if it opens
# a file that rsfstudy has not written.
if TYPE_CHECKING:
    import pandas as pd

    from rsfstudy.plots import Figure
    from rsfstudy.rig import Rig
    from rsfstudy.slider import Scene
    from rsfstudy.study import Study

_NOT_AN_RSFSTUDY_DATASET_MESSAGE = (
    "the dataset has neither the attribute 'scene' nor the attribute 'declaration', so it was "
    "not created by rsfstudy. Use a dataset from rsfstudy.simulate, critical_step, "
    "limit_cycle, run or open, or from one of their files, and do not remove the attributes."
)


@add_former_member_names
@xr.register_dataset_accessor("rsf")  # type: ignore[no-untyped-call]
class DatasetAccessor:
    """Accessor for datasets that rsfstudy has created.

    The accessor is available as ``dataset.rsf``. The dataset may contain a motion, critical step or
    limit cycle of one scene, a fit of laboratory records, or the results of a study.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to access. The methods raise ``DataError`` if rsfstudy has not created the dataset.

    Examples
    --------
    >>> from rsfstudy import Scene, simulate
    >>> motion = simulate(Scene(load_velocity_ratio=2.0), duration=1.0)
    >>> motion.rsf.scene.load_velocity_ratio
    2.0
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        """Initialise the accessor.

        Parameters
        ----------
        dataset : xarray.Dataset
            Dataset to access.
        """
        self._dataset = rename_former_variables(dataset)

    @raise_only_rsfstudy_errors
    def _repr_html_(self) -> str:
        """Return the dataset and the verdicts of its claims as HTML."""
        from rsfstudy.api import html_report

        self._require_rsfstudy_dataset_or_table()
        return html_report.format_dataset_as_html(self._dataset)

    @property
    @raise_only_rsfstudy_errors
    def scene(self) -> Scene:
        """Scene of the dataset.

        If the dataset contains the results of a study, the property returns the scene of the
        selected cell. If the dataset contains a fit, the property returns a scene with the fitted
        parameters.

        Returns
        -------
        Scene
            Scene of the motion, of the cell or of the fit.

        Raises
        ------
        DataError
            If rsfstudy has not created the dataset.
        InvalidValue
            If more than one cell or more than one fit is selected, or if the scene has a
            user-defined part that is not available in this process.
        """
        from rsfstudy.api.fitted_parameters import build_fitted_scene
        from rsfstudy.reporting import contains_fits
        from rsfstudy.storage import StoredDataset

        if contains_fits(self._dataset):
            return build_fitted_scene(self._dataset)
        return StoredDataset(self._dataset).rebuild_scene(
            self.study if self._contains_study_results else None
        )

    @property
    @raise_only_rsfstudy_errors
    def rig(self) -> Rig:
        """Rig that a fit uses to convert motions to the units of the record.

        The slip distance and the stiffness of the rig are the fitted values. The reference velocity
        of the rig is the load point velocity before the step. The normal stress of the rig is the
        mean normal stress before the step. For example,
        ``dataset.rsf.rig.in_units(motion, length="um")`` converts a motion of
        ``dataset.rsf.scene``.

        Returns
        -------
        Rig
            Rig of the fit.

        Raises
        ------
        DataError
            If the dataset is not a fit.
        InvalidValue
            If more than one fit is selected, or if the record has no normal stress.
        """
        from rsfstudy.api.fitted_parameters import build_fitted_rig

        return build_fitted_rig(self._dataset)

    @property
    @raise_only_rsfstudy_errors
    def study(self) -> Study:
        """Study that produced the dataset.

        The study always contains all cells, even if the dataset contains only some of the cells.

        Returns
        -------
        Study
            Study with the axes, the measure and the reductions of the dataset.

        Raises
        ------
        DataError
            If the dataset belongs to a single scene.
        InvalidValue
            If the study contains user-defined code.
        """
        from rsfstudy.storage import StoredDataset

        self._require_study_results()
        return StoredDataset(self._dataset).study

    @raise_only_rsfstudy_errors
    def to_si(self, **scale_values: Any) -> xr.Dataset:
        """Convert the dataset to SI units.

        Parameters
        ----------
        **scale_values : quantity
            Scales that the dataset does not contain: ``normal_stress`` in Pa, ``slip_distance`` in
            m, or ``reference_rate`` in 1/s. See ``rsfstudy.to_si``.

        Returns
        -------
        xarray.Dataset
            Dataset with stress in Pa, slip in m, time in s and slip rate in m/s.

        Raises
        ------
        InvalidValue
            If a scale is missing, not positive, or different from the scale in the dataset.
        DataError
            If the dataset has already been converted, or if rsfstudy has not created the dataset.

        Examples
        --------
        >>> from rsfstudy import Scene, simulate
        >>> motion = simulate(Scene(load_velocity_ratio=2.0), duration=1.0)
        >>> converted = motion.rsf.to_si(normal_stress="5 MPa", slip_distance="10 um")
        >>> converted["shear_stress"].attrs["units"]
        'Pa'
        """
        from rsfstudy.api.single_scene_measures import to_si

        self._require_rsfstudy_dataset()
        return to_si(self._dataset, **scale_values)

    @raise_only_rsfstudy_errors
    def in_units(self, *, stress: str = "MPa", length: str = "um", time: str = "s") -> xr.Dataset:
        """Convert the results of a study that uses a rig to other units.

        The results of each cell are converted with the scales of the rig of this cell.

        Parameters
        ----------
        stress : str, default: "MPa"
            Unit of stress.
        length : str, default: "um"
            Unit of length.
        time : str, default: "s"
            Unit of time. The units of slip rate and stiffness follow from the other units.

        Returns
        -------
        xarray.Dataset
            Dataset in the new units. Variables that are no longer normalised are renamed as in
            ``rsfstudy.to_si``.

        Raises
        ------
        DataError
            If the dataset has already been converted, or if rsfstudy has not created the dataset.
        InvalidValue
            If a unit has the wrong dimension, or if the dataset does not contain the scales of a
            rig.

        Examples
        --------
        >>> from rsfstudy import Axis, Rig, Study, run
        >>> from rsfstudy.measures import LinearStability
        >>> rig = Rig(normal_stress=5e6, slip_distance=1e-5, reference_velocity=1e-6, period=5.0)
        >>> study = Study(
        ...     name="example",
        ...     title="Critical stiffness",
        ...     base=rig.scene(normal_stress="constant", a=0.01),
        ...     axes=[Axis("b_over_a", [1.5, 2.0])],
        ...     measure=LinearStability(),
        ...     rig=rig,
        ... )
        >>> results = run(study, workers=0, output=None, progress=False)
        >>> converted = results.rsf.in_units(stress="kPa")
        >>> converted["critical_stiffness"].attrs["units"]
        'kPa um-1'
        """
        from rsfstudy.rig import DatasetUnits

        self._require_rsfstudy_dataset()
        return DatasetUnits(self._dataset).convert_to_units(stress, length, time)

    @raise_only_rsfstudy_errors
    def check(self) -> pd.DataFrame:
        """Compare the dataset with the claims of its study.

        Claims do not apply to datasets that have been converted to other units.

        Returns
        -------
        pandas.DataFrame
            Table with one row per claim, as ``rsfstudy.check`` returns it.

        Raises
        ------
        DataError
            If the dataset belongs to a single scene, or if only some cells are selected.
        """
        from rsfstudy.api import study_runs

        self._require_study_results()
        self._require_all_axes_present("claims are checked against")
        return study_runs.check(self._dataset)

    @raise_only_rsfstudy_errors
    def plot(self, *plot_arguments: Any, **plot_options: Any) -> Figure:
        """Plot the results of a study, a motion, a limit cycle or a table of holds.

        The axes of the figure have the units of the dataset.

        Parameters
        ----------
        *plot_arguments : object
            Positional arguments for ``rsfstudy.plot`` or ``rsfstudy.plot_motion``. The results of a
            study are plotted with ``rsfstudy.plot``. Motions and limit cycles are plotted with
            ``rsfstudy.plot_motion``, and tables of holds with ``rsfstudy.plot_healing``.
        **plot_options : object
            Keyword arguments for ``rsfstudy.plot`` or ``rsfstudy.plot_motion``. The arguments
            ``style``, ``width`` and ``header`` apply to all figures. In addition, ``variable``
            applies to the results of a study, and ``rig`` and ``against`` apply to a motion.

        Returns
        -------
        matplotlib.figure.Figure
            Figure of the dataset.

        Raises
        ------
        DataError
            If only some cells of a study are selected, or if the dataset cannot be plotted.
        """
        from rsfstudy.api import study_runs
        from rsfstudy.plots import plot_healing, plot_motion
        from rsfstudy.reporting import is_hold_table

        if is_hold_table(self._dataset):
            return plot_healing(self._dataset, *plot_arguments, **plot_options)
        if self._contains_study_results:
            self._require_all_axes_present("figures show")
            return study_runs.plot(self._dataset, *plot_arguments, **plot_options)
        return plot_motion(self._dataset, *plot_arguments, **plot_options)

    @raise_only_rsfstudy_errors
    def events(self, slip_rate: float | None = None) -> xr.Dataset:
        """Find the events of a motion.

        An event is a time interval of the motion in which the slip rate exceeds a threshold.

        Parameters
        ----------
        slip_rate : float, optional
            Threshold of the slip rate in V_*. The default is 10 times the highest load point
            velocity of the scene, and at least 10.

        Returns
        -------
        xarray.Dataset
            Dataset along the dimension ``event``, in the units of the motion. The variables are
            ``time``, ``duration``, ``interval`` (time since the beginning of the previous event),
            ``peak_log10_slip_rate``, ``slip``, ``stress_before`` and ``stress_after`` (largest
            spring stress before the event and smallest spring stress after the event),
            ``static_stress_drop`` and ``dynamic_stress_drop``. Each variable has an interpolation
            error ``<name>_error``, which does not include the error of the motion. ``cut`` is
            nonzero if the event is incomplete because the motion begins or ends within the event.
            The other variables of an incomplete event describe only the part that the motion
            contains.

        Raises
        ------
        DataError
            If the dataset is not a motion.
        InvalidValue
            If the slip rate is not positive and finite.

        Examples
        --------
        >>> from rsfstudy import Scene, simulate
        >>> scene = Scene(stiffness_ratio=2.0, load_velocity_ratio=2.0, normal_stress="constant")
        >>> events = simulate(scene, duration=10.0).rsf.events(slip_rate=1.5)
        >>> events["time"].values.round(3)
        array([0.2])
        """
        from rsfstudy.api.slip_events_of_motion import find_slip_events_of_motion

        if self._contains_study_results:
            raise DataError(
                "the dataset contains the results of a study, but events require the "
                "motion of one scene"
            )
        return find_slip_events_of_motion(self._dataset, slip_rate, lambda: self.scene)

    @raise_only_rsfstudy_errors
    def holds(self) -> xr.Dataset:
        """Measure frictional healing and relaxation during each hold of a motion.

        Returns
        -------
        xarray.Dataset
            Table with the dimension ``hold`` and the same variables as ``Record.holds`` of
            ``rsfstudy.fitting.Record``, in the units of the motion. Instead of standard errors, the
            table contains interpolation errors ``<name>_error``, which do not include the error of
            the motion. If friction has no peak after a hold, ``peak_friction``, ``healing`` and
            ``peak_displacement`` are NaN.

        Raises
        ------
        DataError
            If the dataset is not a motion.

        Examples
        --------
        >>> from rsfstudy import Scene, simulate
        >>> scene = Scene(normal_stress="constant", hold_time=1000, stiffness_ratio=10)
        >>> holds = simulate(scene, duration=1100.0).rsf.holds()
        >>> holds["healing"].values.round(4)
        array([0.0554])
        """
        from rsfstudy.api.healing_tables import measure_holds_of_motion

        if self._contains_study_results:
            raise DataError(
                "the dataset contains the results of a study, but holds require the "
                "motion of one scene"
            )
        return measure_holds_of_motion(self._dataset)

    @raise_only_rsfstudy_errors
    def slip_mode(self, stick_slip_from: Any) -> xr.DataArray:
        """Classify limit cycles by their peak slip rate.

        The method distinguishes slow slip from stick-slip.

        Parameters
        ----------
        stick_slip_from : quantity
            Peak slip rate at which stick-slip begins, such as ``"1 mm/s"``, or a number in m/s.
            Limit cycles with a lower peak slip rate are slow slip.

        Returns
        -------
        xarray.DataArray
            Variable ``slip_mode`` of the dataset, computed with ``stick_slip_from`` as the limit
            between slow slip and stick-slip. The codes are 0 (steady), 1 (damped oscillation), 2
            (slow slip) and 3 (stick-slip). If the motion of a cell settles to steady sliding, the
            code is unchanged.

        Raises
        ------
        InvalidValue
            If the argument is not a slip rate, or if the dataset does not contain the scales that
            convert the peak slip rate to m/s.
        DataError
            If the dataset contains no limit cycles.

        Notes
        -----
        ``rsfstudy.measures.LimitCycle`` defines the default limit between slow slip and stick-slip.

        Examples
        --------
        >>> from rsfstudy import Scene, limit_cycle
        >>> scene = Scene(normal_stress="constant", stiffness_ratio=0.8, radiation_damping=1e-3)
        >>> cycle = limit_cycle(scene, rtol=1e-4)
        >>> converted = cycle.rsf.to_si(normal_stress="5 MPa", slip_distance="10 um")
        >>> float(converted.rsf.slip_mode("1 m/s"))
        2.0
        """
        from rsfstudy.measures import LimitCycle
        from rsfstudy.rig import compute_conversion_factor, convert_to_si

        least = convert_to_si("stick_slip_from", stick_slip_from, "m/s")
        if "slip_mode" not in self._dataset:
            raise DataError("slip_mode is missing, because the dataset contains no limit cycles")
        there = self._dataset if "max_slip_rate" in self._dataset else self.to_si()
        peak = there["max_slip_rate"]
        fast = (
            peak * float(compute_conversion_factor("max_slip_rate", peak.attrs["units"], "m/s"))
            >= least
        )
        modes, slow = self._dataset["slip_mode"], LimitCycle.SLIP_MODE_NAMES.index("slow_slip")
        return modes.where(~(modes >= slow), slow + fast).assign_attrs(modes.attrs)

    @raise_only_rsfstudy_errors
    def simplify(self) -> xr.Dataset:
        """Return a simplified copy for plotting and tabulating with plain xarray.

        Returns
        -------
        xarray.Dataset
            Dataset without constant coordinates. The attribute ``constants`` contains the values of
            these coordinates as JSON. The attribute ``units`` of a dimensionless variable is its
            scale, such as "D_c/V_*", or is omitted if the variable is a pure number. Store the
            original dataset, because files that follow the CF conventions cannot contain such
            units. The other methods of the accessor need the original dataset, too.

        Raises
        ------
        DataError
            If rsfstudy has not created the dataset.

        See Also
        --------
        to_dataframe : Convert the dataset to a table without constant coordinates.

        Examples
        --------
        >>> from rsfstudy import Scene, simulate
        >>> motion = simulate(Scene(load_velocity_ratio=2.0), duration=1.0).rsf.simplify()
        >>> list(motion.coords), motion["slip"].attrs["units"]
        (['time', 'slip'], 'D_c')
        """
        from rsfstudy.api.constant_coordinate_omission import omit_constants_and_simplify_units

        self._require_rsfstudy_dataset()
        return omit_constants_and_simplify_units(self._dataset)

    @raise_only_rsfstudy_errors
    def to_dataframe(self, *, decoded: bool = False) -> pd.DataFrame:
        """Convert the dataset to a table, and omit constant coordinates.

        Parameters
        ----------
        decoded : bool, default: False
            If True, the table contains the labels of codes, for example ``ok`` instead of 0 and
            ``stick_slip`` instead of 3. For the results of a study, the table is then equal to the
            table that the command ``rsfstudy export --csv`` writes.

        Returns
        -------
        pandas.DataFrame
            Table with one row per cell of a study, or with one row per time of a motion. Variables
            with additional dimensions inside a cell, such as orbits, are omitted. For other
            datasets of one scene, the table has a single row. The status and all results are
            columns, even if their values are equal in all rows. The dictionary
            ``attrs["constant"]`` of the table contains the values of the omitted coordinates and of
            variables without dimensions. The dictionary ``attrs["units"]`` contains the units of
            each numerical column and of each number in ``attrs["constant"]``. The units of a
            normalised variable are its scale, such as ``D_c/V_*``.

        Raises
        ------
        DataError
            If rsfstudy has not created the dataset.

        Examples
        --------
        >>> from rsfstudy import Scene, simulate
        >>> scene = Scene(load_velocity_ratio=2.0)
        >>> table = simulate(scene, times=[0.5, 1.0]).rsf.to_dataframe()
        >>> table["load_point_displacement"].round(6).tolist()
        [1.0, 2.0]
        >>> table.attrs["units"]["load_point_displacement"]
        'D_c'
        """
        from rsfstudy.api.dataset_export import to_dataframe

        self._require_rsfstudy_dataset_or_table()
        return to_dataframe(self._dataset, decoded)

    @raise_only_rsfstudy_errors
    def fit_table(self) -> pd.DataFrame:
        """Return a table of fits with the column names used in laboratories.

        Returns
        -------
        pandas.DataFrame
            Table with one row per fit. The columns are the fitted parameters, their standard errors
            and the ends of their 95 % confidence intervals (``a``, ``a_stderr``, ``a_ci_low``,
            ``a_ci_high``, ``b``, ``Dc`` and so on), the load point velocities ``V0`` before and
            ``V1`` after the step, ``law``, ``window``, ``R2``, ``p_value``, ``status`` and others.
            Lengths are in um and velocities in um/s. The dictionary ``attrs["units"]`` contains the
            units of each numerical column.

        Raises
        ------
        DataError
            If the dataset is not a fit.
        """
        from rsfstudy.reporting import build_fit_table

        return build_fit_table(self._dataset)

    @raise_only_rsfstudy_errors
    def sample_parameters(self, n: int, seed: int = 0, *, posterior: bool = False) -> xr.Dataset:
        """Draw samples of the parameters of a fit.

        By default, the samples follow a multivariate t distribution with the covariance matrix of
        the fit. Slip distances and stiffness are sampled on a logarithmic scale and are therefore
        positive.

        Parameters
        ----------
        n : int
            Number of samples.
        seed : int, default: 0
            Seed of the random number generator.
        posterior : bool, default: False
            If True, the samples are selected at random and without replacement from the draws of
            emcee, which the fit contains if it was computed with the argument ``posterior``.

        Returns
        -------
        xarray.Dataset
            Samples of each parameter along the dimension ``draw``, in the units of the parameter.
            The attribute ``units`` of each variable is read by `rsfstudy.Axis.cases`.

        Raises
        ------
        DataError
            If the dataset is not a fit.
        InvalidValue
            If more than one fit is selected, if ``n`` is not a positive integer, if the fit has no
            covariance matrix, or if the fit has fewer than ``n`` posterior draws.
        """
        from rsfstudy.api.fitted_parameters import sample_fitted_parameters

        return sample_fitted_parameters(self._dataset, n, seed, posterior=posterior)

    @raise_only_rsfstudy_errors
    def failures(self, *, include_answers: bool = False) -> pd.DataFrame:
        """Return a table of the failed cells.

        Parameters
        ----------
        include_answers : bool, default: False
            If True, the table contains all cells whose status is not ``ok``. These cells include
            cells with an answer but without a value, such as ``unstable_at_any_step``, cells whose
            standard errors are not valid, and cells that are not computed yet.

        Returns
        -------
        pandas.DataFrame
            Table with one row per failed cell. The columns are the coordinates of the cell on the
            axes of the study, ``status`` and ``message``. If the dataset belongs to one scene, the
            table has no coordinates and at most one row.

        Raises
        ------
        DataError
            If rsfstudy has not created the dataset.

        Examples
        --------
        >>> from rsfstudy import Scene, simulate
        >>> motion = simulate(Scene(load_velocity_ratio=2.0), duration=1.0)
        >>> len(motion.rsf.failures())
        0
        """
        import pandas as pd

        from rsfstudy.reporting import build_data_frame_of_cells, find_failed_cells
        from rsfstudy.status import Status
        from rsfstudy.storage import StoredDataset

        if self._contains_study_results:
            axes = [axis.dimension for axis in StoredDataset(self._dataset).study_declaration.axes]
            not_ok = self._dataset["status"] != int(Status.OK)
            listed = not_ok if include_answers else find_failed_cells(self._dataset)
            return build_data_frame_of_cells(self._dataset, listed, axes)
        ended = {name: self._dataset.attrs.get(name, "") for name in ("status", "message")}
        answers = {status.label for status in Status if status.is_answer}
        not_listed = {Status.OK.label} if include_answers else answers
        rows = [] if ended["status"] in not_listed else [ended]
        return pd.DataFrame(rows, columns=list(ended))

    @property
    def _contains_study_results(self) -> bool:
        """True if the dataset contains the results of a study."""
        self._require_rsfstudy_dataset()
        return "declaration" in self._dataset.attrs

    def _require_rsfstudy_dataset(self) -> None:
        """Raise ``DataError`` if rsfstudy has not created the dataset."""
        if not {"scene", "declaration"} & set(self._dataset.attrs):
            raise DataError(_NOT_AN_RSFSTUDY_DATASET_MESSAGE)

    def _require_rsfstudy_dataset_or_table(self) -> None:
        """Raise ``DataError`` if the dataset is not a table and was not created by rsfstudy."""
        from rsfstudy.storage import StoredDataset

        if not StoredDataset(self._dataset).table_contents:
            self._require_rsfstudy_dataset()

    def _require_all_axes_present(self, requested_action: str) -> None:
        """Raise ``DataError`` if a selection has removed an axis."""
        from rsfstudy.storage import StoredDataset

        axes = [axis.dimension for axis in StoredDataset(self._dataset).study_declaration.axes]
        selected = [name for name in axes if name not in self._dataset["status"].dims]
        if selected:
            text = (
                f"{requested_action} all results of a study, but {', '.join(selected)} has been "
                "selected"
            )
            raise DataError(f"{text}. Use the complete dataset, without a selection.")

    def _require_study_results(self) -> None:
        """Raise ``DataError`` if the dataset is not from a study."""
        if not self._contains_study_results:
            raise DataError(
                "the dataset belongs to a single scene and not to a study. Use dataset.rsf.scene."
            )


class Backend(BackendEntrypoint):
    """Backend that lets xarray open and validate results files of rsfstudy.

    The call ``xarray.open_dataset(path, engine="rsfstudy")`` opens a file in the same way as
    ``rsfstudy.open``. xarray registers the accessor ``.rsf`` when it loads the backend.
    """

    description = "Results of rsfstudy, which are checked when the file is opened"
    open_dataset_parameters = ("filename_or_obj", "drop_variables")

    def open_dataset(  # type: ignore[override]  # files are read completely
        self, filename_or_obj: str | Path, *, drop_variables: str | Iterable[str] | None = None
    ) -> xr.Dataset:
        """Load a results file into memory.

        Parameters
        ----------
        filename_or_obj : str or Path
            Path of the file, or name of a study.
        drop_variables : str or iterable of str, optional
            Names of variables to omit.

        Returns
        -------
        xarray.Dataset
            Results of the study.
        """
        from rsfstudy.api import study_runs

        return study_runs.open(filename_or_obj).drop_vars(drop_variables or [])
