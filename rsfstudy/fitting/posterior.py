"""Posterior sampling of the parameters of a fit with emcee.

The sampler [1]_ uses the likelihood function of the fit, with the estimated noise model. The priors
are uniform between the bounds of the search. For slip distances and stiffness, the prior of the
logarithm is uniform.

References
----------
.. [1] Foreman-Mackey et al. (2013), Publ. Astron. Soc. Pac. 125, 306-312.
"""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import multivariate_t

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.window_model import LOGARITHMIC_PARAMETERS
from rsfstudy.measure_base import Outcome
from rsfstudy.motion import MotionStopped

if TYPE_CHECKING:
    from rsfstudy.fitting.fit_problem import FitProblem, FitSolution

#: Largest number of posterior draws.
_MAX_POSTERIOR_DRAWS = 1_000_000
#: Settings of the sampler: the number of steps between two convergence checks, the smallest length
#: of a chain in autocorrelation times, and the length of the burn-in in autocorrelation times.
(
    _CHAIN_STEPS_PER_CONVERGENCE_CHECK,
    _MIN_CHAIN_AUTOCORRELATION_TIMES,
    _BURN_IN_AUTOCORRELATION_TIMES,
) = 100, 50.0, 5.0
#: Degrees of freedom of the proposal distribution. The proposal distribution should have longer
#: tails than the likelihood.
_PROPOSAL_DEGREES_OF_FREEDOM = 5.0


def check_posterior_sampling_is_possible(draw_count: int) -> None:
    """Raise ``InvalidValue`` if posterior sampling is impossible.

    Parameters
    ----------
    draw_count : int
        Number of draws.

    Raises
    ------
    InvalidValue
        If the number of draws is invalid, or if emcee is not installed.
    """
    if not isinstance(draw_count, int) or not 0 <= draw_count <= _MAX_POSTERIOR_DRAWS:
        raise InvalidValue(
            "posterior", draw_count, f"must be a whole number from 0 to {_MAX_POSTERIOR_DRAWS:,}"
        )
    if draw_count and importlib.util.find_spec("emcee") is None:
        remedy = "pip install 'rsfstudy[posterior]'."
        raise InvalidValue(
            "posterior",
            draw_count,
            "requires the package emcee, which is not installed",
            remedy=remedy,
        )


def sample_posterior_fit_coordinates(
    fit_problem: FitProblem, fit_solution: FitSolution, draw_count: int, seed: int = 0
) -> tuple[np.ndarray, float]:
    """Sample the posterior distribution of the free parameters.

    Half of the sampling steps are stretch moves. The other half of the sampling steps are
    independent proposals from a multivariate t distribution with the covariance matrix of the fit.
    The sampler stops when the chain is longer than 50 autocorrelation times and the number of
    independent samples exceeds the number of draws.

    Parameters
    ----------
    fit_problem : FitProblem
        Least-squares problem that contains the model of the record.
    fit_solution : FitSolution
        Solution of the least-squares problem, with a finite covariance matrix.
    draw_count : int
        Number of draws.
    seed : int, default: 0
        Seed for the random number generator.

    Returns
    -------
    draws : ndarray, shape (draws, parameters)
        Coordinates of the free parameters.
    autocorrelation_time : float
        Longest autocorrelation time of the chain in steps.

    Raises
    ------
    MotionStopped
        If the work budget is exhausted before the chain is long enough.
    """
    import emcee

    halts: list[MotionStopped] = []
    errors = multivariate_t(
        fit_problem.compute_fit_coordinates(fit_solution.parameter_values),
        fit_solution.fit_coordinate_covariance,
        _PROPOSAL_DEGREES_OF_FREEDOM,
        allow_singular=True,
    )

    def log_likelihood(x: np.ndarray) -> float:
        if halts or not ((fit_problem.lower_bounds <= x) & (x <= fit_problem.upper_bounds)).all():
            return -math.inf
        try:
            left = fit_problem.compute_residuals(
                fit_problem.compute_parameter_values(x), require_stable=True
            )
        except MotionStopped as halt:
            halts.append(halt)
            return -math.inf
        if not np.isfinite(left).all():
            return -math.inf
        return -0.5 * float(
            np.square(
                fit_solution.noise_model.whiten_columns(left[:, None]) / fit_solution.noise_sd
            ).sum()
        )

    def proposed(x: np.ndarray, rng: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
        drawn = errors.rvs(len(x), rng).reshape(x.shape)
        return drawn, errors.logpdf(x) - errors.logpdf(drawn)

    rng = np.random.RandomState(seed)
    moves = [(emcee.moves.StretchMove(), 0.5), (emcee.moves.MHMove(proposed), 0.5)]
    walkers = 2 * len(fit_solution.free_parameters) + 2
    sampler = emcee.EnsembleSampler(
        walkers, len(fit_solution.free_parameters), log_likelihood, moves=moves
    )
    begin = errors.rvs(walkers, rng).reshape(walkers, -1)
    state = emcee.State(
        np.clip(begin, fit_problem.lower_bounds, fit_problem.upper_bounds),
        random_state=rng.get_state(),
    )
    while True:
        state = sampler.run_mcmc(state, _CHAIN_STEPS_PER_CONVERGENCE_CHECK)
        if halts:
            raise halts[0]
        time = float(np.max(sampler.get_autocorr_time(tol=0)))
        kept = (
            sampler.iteration - math.ceil(_BURN_IN_AUTOCORRELATION_TIMES * time)
            if math.isfinite(time)
            else 0
        )
        if kept >= _MIN_CHAIN_AUTOCORRELATION_TIMES * time and kept * walkers >= draw_count * time:
            chain = sampler.get_chain(discard=sampler.iteration - kept, flat=True)
            return chain[np.linspace(0, len(chain) - 1, draw_count).round().astype(int)], time


def sample_posterior_parameters(
    fit_problem: FitProblem, fit_solution: FitSolution, draw_count: int
) -> dict[str, Any]:
    """Sample the posterior distribution and return parameter values.

    Parameters
    ----------
    fit_problem : FitProblem
        Least-squares problem that contains the model of the record.
    fit_solution : FitSolution
        Solution of the least-squares problem.
    draw_count : int
        Number of draws.

    Returns
    -------
    dict
        Dictionary with the items ``posterior``, an array of draws with shape (draws, parameters),
        and ``autocorrelation_time``. All values are NaN if a standard error is infinite.

    Raises
    ------
    MotionStopped
        If the work budget is exhausted before the chain is long enough.
    """
    drawn, time = np.full((draw_count, len(fit_solution.free_parameters)), math.nan), math.nan
    if np.isfinite(fit_solution.fit_coordinate_covariance).all():
        drawn, time = sample_posterior_fit_coordinates(fit_problem, fit_solution, draw_count)
    logs = [name in LOGARITHMIC_PARAMETERS for name in fit_solution.free_parameters]
    drawn[:, logs] = np.exp(drawn[:, logs])
    return {"posterior": drawn, "autocorrelation_time": time}


def add_posterior_draws(
    outcome: Outcome,
    fit_problem: FitProblem,
    fit_solution: FitSolution,
    draw_count: int,
    unidentified_parameters: Sequence[str],
) -> Outcome:
    """Add posterior draws to the outcome of a fit.

    If the sampler fails, the outcome keeps the values of the fit, and the message explains why
    there are no draws.

    Parameters
    ----------
    outcome : Outcome
        Outcome of the fit without draws.
    fit_problem : FitProblem
        Least-squares problem that contains the model of the record.
    fit_solution : FitSolution
        Solution of the least-squares problem.
    draw_count : int
        Number of draws.
    unidentified_parameters : sequence of str
        Names of the parameters that the record does not constrain.

    Returns
    -------
    Outcome
        Outcome with the draws. If the work budget is exhausted before the chain is long enough,
        the status is ``work_budget_spent``. In all other cases, the status does not change.
    """
    status, reason, drawn = outcome.status, "the covariance matrix is not finite", {}
    try:
        drawn = sample_posterior_parameters(fit_problem, fit_solution, draw_count)
    except MotionStopped as halt:
        status, reason = halt.status, str(halt)
    except Exception as error:  # The errors of emcee have many types.
        reason = f"emcee raised {type(error).__name__}: {error}"
    if drawn and math.isfinite(drawn["autocorrelation_time"]):
        return replace(outcome, values={**outcome.values, **drawn})
    if unidentified_parameters and status is outcome.status:
        *first, last = unidentified_parameters
        verb = "are" if first else "is"
        reason = f"{' and '.join(filter(None, (', '.join(first), last)))} {verb} not identified"
    message = "; ".join(filter(None, (outcome.message, f"no posterior draws, because {reason}")))
    return replace(outcome, status=status, message=message)
