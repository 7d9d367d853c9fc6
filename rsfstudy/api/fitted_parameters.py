"""Functions that sample fitted parameters and build the scene and the rig of a fit."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.execution import build_provenance_attributes
from rsfstudy.fitting import LOGARITHMIC_PARAMETERS, fitted_fields
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.reporting import split_into_single_fits
from rsfstudy.rig import Rig
from rsfstudy.slider import Scene
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset, build_scene_from_stored_fields


def _select_single_fit(dataset: xr.Dataset) -> xr.Dataset:
    """Return the fit in a dataset, or raise ``InvalidValue`` if there are several fits."""
    found = split_into_single_fits(dataset)
    if len(found) != 1:
        remedy = "Select a fit first, for example dataset.sel(law='slip')."
        raise InvalidValue("dataset", len(found), "contains several fits", remedy=remedy)
    return found[0]


def sample_fitted_parameters(
    dataset: xr.Dataset, sample_count: int, seed: int = 0, *, posterior: bool = False
) -> xr.Dataset:
    """Draw samples of the parameters of a fit.

    By default, the samples follow a multivariate t distribution, and the logarithms of slip
    distances and stiffness are sampled.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with a single fit.
    sample_count : int
        Number of samples.
    seed : int, default: 0
        Seed of the random number generator.
    posterior : bool, default: False
        If True, the samples are selected from the posterior draws that the dataset contains.

    Returns
    -------
    xarray.Dataset
        Samples of each parameter along the dimension ``draw``, in the units of the parameter.

    Raises
    ------
    InvalidValue
        If the dataset contains several fits, if ``sample_count`` is not a positive integer, if the
        covariance matrix is not finite, or if there are fewer posterior draws than samples.
    """
    one = _select_single_fit(dataset)
    if not isinstance(sample_count, int) or sample_count < 1:
        raise InvalidValue("n", sample_count, "must be a whole number, 1 or more")
    rng = np.random.default_rng(seed)
    # The covariance of parameters that the law does not have is NaN.
    has = one["covariance"].notnull().any("other_parameter").values
    names = [str(name) for name in one["parameter"].values[has]]
    drawn = (
        _select_posterior_draws(one, sample_count, rng)[:, has]
        if posterior
        else _draw_from_t_distribution(
            one.isel(parameter=has, other_parameter=has), sample_count, rng
        )
    )
    data = {
        name: (
            "draw",
            drawn[:, place],
            {key: one[name].attrs[key] for key in ("long_name", "units") if key in one[name].attrs},
        )
        for place, name in enumerate(names)
    }
    number = {"long_name": "number of the sample", "units": "1"}
    about = {
        "title": "Samples of the parameters of a fit",
        "Conventions": "CF-1.11",
        **build_provenance_attributes("dataset.rsf.sample_parameters"),
    }
    return copy_with_cf_encoding(
        xr.Dataset(data, {"draw": ("draw", np.arange(sample_count), number)}, about)
    )


def _draw_from_t_distribution(
    fit: xr.Dataset, sample_count: int, rng: np.random.Generator
) -> np.ndarray:
    """Draw samples of the parameters from a multivariate t distribution."""
    names = [str(name) for name in fit["parameter"].values]
    at = np.array([fit[name].item() for name in names])
    covariance = fit["covariance"].values
    if not (names and np.isfinite(covariance).all()):
        raise InvalidValue(
            "dataset",
            Status.labels_by_code()[int(fit["status"])],
            "has no covariance matrix for sampling",
        )
    logs = np.array([name in LOGARITHMIC_PARAMETERS for name in names])
    scales = np.where(logs, at, 1.0)
    degrees = fit["degrees_of_freedom"].item()
    spread = rng.multivariate_normal(
        np.zeros(len(at)), covariance / np.outer(scales, scales), sample_count
    )
    spread /= np.sqrt(rng.chisquare(degrees, sample_count) / degrees)[:, None]
    return np.where(logs, at * np.exp(np.where(logs, spread, 0.0)), at + spread)


def _select_posterior_draws(
    fit: xr.Dataset, sample_count: int, rng: np.random.Generator
) -> np.ndarray:
    """Select posterior draws at random without replacement."""
    remedy = f"Fit the record with posterior={sample_count}, or pass posterior=False."
    rule = "requires a fit with posterior draws"
    if "posterior" not in fit:
        raise InvalidValue("posterior", True, rule, remedy=remedy)
    if not fit["posterior"].notnull().any():
        rule += f". The message of this fit is: {fit['message'].item() or 'none'}"
        raise InvalidValue("posterior", True, rule, remedy="Pass posterior=False.")
    draws = fit["posterior"].transpose("draw", "parameter").values
    if sample_count > len(draws):
        rule = f"is larger than the number of posterior draws, {len(draws)}"
        raise InvalidValue("n", sample_count, rule, remedy=remedy)
    return draws[np.sort(rng.choice(len(draws), sample_count, replace=False))]


def build_fitted_scene(dataset: xr.Dataset) -> Scene:
    """Build a scene from the fitted parameters.

    The scene contains a single step of the load point velocity. Quantities are normalised by the
    fitted slip distance and the load point velocity before the step.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with a single fit.

    Returns
    -------
    Scene
        Scene of the fit.
    """
    one = _select_single_fit(dataset)
    declared = StoredDataset(dataset).study_declaration
    first = build_scene_from_stored_fields(declared.base)
    if "law" in one.coords:
        first = first.with_(law=str(one["law"].item()))
    distances = (
        float(declared.measure[f"{n}_guess"]) for n in ("slip_distance", "slip_distance_2")
    )
    found = {n: one[n].item() for n in map(str, one["parameter"].values)}
    stiffness = one["window_stiffness"].item() if "window_stiffness" in one else None
    before, after = one["velocity_before"].item(), one["velocity_after"].item()
    fields = fitted_fields(first, distances, found, stiffness, before)
    return first.with_(**fields, load_velocity_ratio=after / before)


def build_fitted_rig(dataset: xr.Dataset) -> Rig:
    """Return the rig of a fit.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with a single fit.

    Returns
    -------
    Rig
        Rig with the fitted slip distance and stiffness, and with the load point velocity and the
        mean normal stress before the step.

    Raises
    ------
    InvalidValue
        If the record has no normal stress.
    """
    one, slider = _select_single_fit(dataset), build_fitted_scene(dataset)
    stress = one["normal_stress_before"].item() if "normal_stress_before" in one else math.nan
    if not stress > 0.0:
        remedy = (
            "Read the record with normal_stress=, or create a rsfstudy.Rig with the normal stress."
        )
        raise InvalidValue(
            "normal_stress", None, "is required, but the record has no normal stress", remedy=remedy
        )
    velocity = one["velocity_before"].item() * 1e-6
    distance = velocity / slider.reference_rate
    return Rig(
        normal_stress=stress,
        slip_distance=distance,
        reference_velocity=velocity,
        stiffness=slider.stiffness * stress / distance,
    )
