"""Outputs of a fit, with their units and meanings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rsfstudy.fitting.joint_window_model import strip_window_number
from rsfstudy.fitting.record import RECORD_COLUMNS
from rsfstudy.fitting.window_model import LAW_SPECIFIC_PARAMETERS, PARAMETERS
from rsfstudy.quantities import Output

#: Outputs of every fit that have a single value.
_SCALAR_OUTPUTS = (
    Output("a_minus_b", "$a-b$", "1", "rate dependence of steady friction"),
    Output("a_minus_b_stderr", "", "1", "standard error of a - b"),
    Output("noise_sd", "", "1", "standard deviation of the noise"),
    Output("outliers", "", "1", "number of rows that were omitted as outliers"),
    Output("friction_quantum", "", "1", "rounding step of the recorded friction, or 0"),
    Output("noise_order", "", "1", "order of the autoregressive process of the noise"),
    Output("n_eff", "", "1", "effective sample size"),
    Output("degrees_of_freedom", "", "1", "degrees of freedom of the confidence intervals"),
    Output("p_value", "", "1", "p-value of the autocorrelation test of the whitened residuals"),
    Output("aic", "", "1", "Akaike information criterion, including the noise model"),
    Output("r_squared", "$R^2$", "1", "coefficient of determination of the fit"),
    Output("velocity_before", "$V_0$", "um s-1", "load point velocity before the step"),
    Output("velocity_after", "$V_1$", "um s-1", "load point velocity after the step"),
    Output("window_begins", "", "um", "load point displacement at the beginning of the window"),
    Output("window_ends", "", "um", "load point displacement at the end of the window"),
    Output("load_point_noise", "", "um", "standard deviation of the noise of the load point"),
    Output("rows_fitted", "", "1", "number of rows in the window"),
    Output("normal_stress_before", r"$\sigma_*$", "Pa", "mean normal stress before the step"),
    Output("window_stiffness", "$k$", "um-1", "stiffness divided by normal stress before the step"),
    Output(
        "window_stiffness_stderr", "", "um-1", "standard error of the stiffness, if it is fixed"
    ),
    *(
        Output(name, "", "1", f"{name} of the parameters", dims=("parameter", "other_parameter"))
        for name in ("covariance", "correlation")
    ),
)
#: Outputs with one value per row of the record.
_OUTPUTS_PER_RECORD_ROW = tuple(
    Output(*about, dims=("row",))
    for about in (
        *((f"record_{q.name}", q.symbol, q.units, q.long_name) for q in RECORD_COLUMNS[:3]),
        ("fitted_friction", r"$\mu$", "1", "fitted friction with the trend"),
        ("fitted_friction_stderr", "", "1", "standard error of the fitted friction"),
        ("detrended_friction", r"$\mu$", "1", "fitted friction without the trend"),
        ("residual", "", "1", "recorded friction minus fitted friction"),
        ("whitened_residual", "", "1", "whitened residual divided by its standard deviation"),
    )
)
#: Suffixes and descriptions of the outputs that belong to each parameter in addition to its value.
_PARAMETER_OUTPUT_DESCRIPTIONS_BY_SUFFIX = {
    "stderr": "standard error",
    "ci_low": "lower end of the 95 % confidence interval",
    "ci_high": "upper end of the 95 % confidence interval",
}
#: Outputs of a fit with posterior draws.
_POSTERIOR_OUTPUTS = (
    Output("autocorrelation_time", "", "1", "autocorrelation time of the chains, in steps"),
    Output(
        "posterior",
        "",
        "1",
        "samples of the parameters from the posterior distribution",
        dims=("draw", "parameter"),
    ),
)


def build_fit_outputs(
    parameter_names: Sequence[str], with_posterior: bool, window_count: int
) -> tuple[Output, ...]:
    """Describe the outputs of a fit.

    Parameters
    ----------
    parameter_names : sequence of str
        Names of the free parameters.
    with_posterior : bool
        If True, include the draws from the posterior distribution.
    window_count : int
        Number of windows in the fit. If there are several windows, the outputs include the normal
        stress before each step.

    Returns
    -------
    tuple of Output
        Descriptions of the outputs for the parameters, for the whole fit, and for the rows of the
        record.
    """
    found = [output for name in parameter_names for output in _iterate_outputs_of_parameter(name)]
    stresses = [
        Output(f"normal_stress_before_{n}", "", "Pa", f"mean normal stress before step {n}")
        for n in range(1, window_count + 1 if window_count > 1 else 1)
    ]
    return (
        *found,
        *(_POSTERIOR_OUTPUTS if with_posterior else ()),
        *_SCALAR_OUTPUTS,
        *stresses,
        *_OUTPUTS_PER_RECORD_ROW,
    )


def _iterate_outputs_of_parameter(parameter_name: str) -> Iterator[Output]:
    """Describe the outputs that contain a parameter and its errors."""
    about = PARAMETERS[strip_window_number(parameter_name)]
    optional = strip_window_number(parameter_name) in LAW_SPECIFIC_PARAMETERS
    yield Output(
        parameter_name, about.symbol, about.units, about.long_name, error=True, optional=optional
    )
    for suffix, words in _PARAMETER_OUTPUT_DESCRIPTIONS_BY_SUFFIX.items():
        yield Output(
            f"{parameter_name}_{suffix}", "", about.units, f"{words} of the {about.long_name}"
        )
