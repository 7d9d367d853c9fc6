r"""Measures that compute the effect of weak noise on recurrence times from the phase response.

A small change of the spring stress :math:`f` at some point of the cycle shifts all later events in
time. For each unknown, the phase response :math:`Z` is the time by which all later events are
advanced per unit change of the unknown. The phase response is the periodic solution of the adjoint
of the linearised equations :math:`dy/dt = F(y)`,

.. math::

    \frac{dZ}{dt} = -\left(\frac{\partial F}{\partial y}\right)^T Z, \quad Z \cdot F = 1.

White noise with the amplitude :math:`\epsilon` shifts the events randomly. The variance of an event
time grows by :math:`\epsilon^2 D` in each cycle, with :math:`D = \int_0^T Z_f^2 \, dt`, so the
coefficient of variation of the recurrence interval is :math:`\epsilon \sqrt{D}/T`.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from rsfstudy import Accuracy, Integrator, Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import EventStatistics, LimitCycle, Measure, Outcome, Output, Status
from rsfstudy.motion import EventKind, rise

#: Number of cycles after which the motion is on the limit cycle, and number of cycles after which
#: the adjoint solution is periodic.
CYCLES_TO_CYCLE, CYCLES_TO_ADJOINT = 12, 8
#: Tolerance of the adjoint solution, and step of its difference quotients, relative to a.
ADJOINT_TOLERANCE, RELATIVE_STEP = 1e-9, 1e-5
#: Requested accuracy of the phase response.
THEORY_ACCURACY = Accuracy(rtol=1e-9, engine="compiled")


class _CycleStart(NamedTuple):
    """Start values of all unknowns except time, and duration of the cycle in D_c/V_*."""

    unknowns: np.ndarray
    duration: float


@dataclass(frozen=True)
class PhaseResponse(Measure):
    r"""Sensitivity of the recurrence interval to weak white noise.

    The scene must have a limit cycle with one event per period, and must not include inertia or
    noise. The results are the values of :math:`\sqrt{D}/T` for two types of noise: noise in the
    shear stress, and noise that acts equally on the shear stress and on the state variable.
    """

    name: ClassVar[str] = "phase_response"
    primary_output = "stress_noise_sensitivity"
    outputs = (
        Output(
            "stress_noise_sensitivity",
            r"$\sqrt{D}/T$",
            "1",
            "coefficient of variation of the interval over the amplitude of noise",
        ),
        Output(
            "joint_noise_sensitivity",
            r"$\sqrt{D_\Theta}/T$",
            "1",
            (
                "coefficient of variation of the interval over the amplitude of noise, if noise "
                "also acts on the state variable"
            ),
        ),
        Output("recurrence_interval"),
    )
    typical_rhs_evaluations = 40_000

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the phase response.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status and results.
        """
        if scene.has_mass or scene.parts.loading_noise.is_active:
            raise InvalidValue("scene", scene, "must have neither mass nor noise")
        cycle = LimitCycle(phases=2).run_nested(scene, integrator)
        if cycle.status is not Status.OK:
            return Outcome(cycle.status, message=cycle.message)
        response = _AdjointSolution(scene, _find_cycle_start(scene, integrator))
        stress, joint = response.integrate()
        interval = response.start.duration
        return Outcome(
            Status.OK,
            {
                "stress_noise_sensitivity": math.sqrt(stress) / interval,
                "joint_noise_sensitivity": math.sqrt(joint) / interval,
                "recurrence_interval": interval,
            },
        )


def _find_cycle_start(scene: Scene, integrator: Integrator) -> _CycleStart:
    """Find the cycle start (where V rises through V_0) and the cycle duration."""
    if not scene.is_perturbed:
        scene = scene.with_(displacement_step=0.1, load_velocity_ratio=scene.load_velocity)
    asked, times = rise("log_slip_rate", scene.log_load_velocity), []
    for event in integrator.follow(scene, [asked], with_time=True):
        if event.kind is EventKind.RISE:
            times.append(event.time)
        if len(times) == CYCLES_TO_CYCLE:
            break
    unknowns = np.array([event.point.spring_stress, *event.point.psis])
    return _CycleStart(unknowns, times[-1] - times[-2])


class _AdjointSolution:
    """Periodic solution of the adjoint equations along a limit cycle.

    Parameters
    ----------
    scene : Scene
        Scene with the limit cycle.
    start : _CycleStart
        Start and duration of the cycle.
    """

    def __init__(self, scene: Scene, start: _CycleStart) -> None:
        """Integrate the cycle along its path length."""
        equations = scene.equations_between_ruptures(with_time=True)
        self._rates, self._p = equations.rate_function, equations.parameters
        self._step, self.start = RELATIVE_STEP * scene.a, start
        arrives = self._remaining_time
        arrives.__func__.terminal = True  # type: ignore[attr-defined]
        self._orbit = solve_ivp(
            lambda _s, y: self._rates(tuple(y.tolist()), self._p),
            (0.0, math.inf),
            [*start.unknowns, 0.0],
            method="DOP853",
            rtol=ADJOINT_TOLERANCE,
            atol=ADJOINT_TOLERANCE * scene.a,
            events=arrives,
            dense_output=True,
        )

    def _remaining_time(self, _length: float, y: np.ndarray) -> float:
        """Return the time until the end of the cycle."""
        return float(self.start.duration - y[-1])

    def _flow(self, y: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the time derivatives of the unknowns, and the time per unit path length."""
        rates = self._rates((*y.tolist(), 0.0), self._p)
        return np.array(rates[:-1]) / rates[-1], rates[-1]

    def _adjoint_rates(self, length: float, values: np.ndarray) -> np.ndarray:
        """Return the derivatives of the response Z and of the integrals of squared responses."""
        y = self._orbit.sol(length)[:-1]
        z = values[: len(y)]
        slowness = self._flow(y)[1]
        gradient = np.empty(len(y))
        for i in range(len(y)):
            ahead, behind = y.copy(), y.copy()
            ahead[i] += self._step
            behind[i] -= self._step
            change = self._flow(ahead)[0] - self._flow(behind)[0]
            gradient[i] = change @ z / (2.0 * self._step)
        squares = z[0] ** 2, (z[0] + z[1]) ** 2
        return slowness * np.array([*-gradient, *squares])

    def integrate(self) -> tuple[float, float]:
        """Return the integrals of the squared phase responses over a cycle.

        Returns
        -------
        stress, joint : float
            Integral of the squared response to spring stress, and of the squared sum of the
            responses to spring stress and state.
        """
        length = float(self._orbit.t[-1])
        flow = self._flow(self.start.unknowns)[0]
        z = flow / (flow @ flow)
        # The adjoint equations are stable backwards in time.
        for _ in range(CYCLES_TO_ADJOINT):
            z = z / (z @ flow)
            result = solve_ivp(
                self._adjoint_rates,
                (length, 0.0),
                [*z, 0.0, 0.0],
                method="DOP853",
                rtol=ADJOINT_TOLERANCE,
                atol=ADJOINT_TOLERANCE,
            )
            z = result.y[: len(z), -1]
        return -float(result.y[-2, -1]), -float(result.y[-1, -1])


@lru_cache(maxsize=8)
def compute_phase_response(scene: Scene) -> Outcome:
    """Compute the phase response of a scene that has no noise.

    Parameters
    ----------
    scene : Scene
        Scene without noise.

    Returns
    -------
    Outcome
        Outcome of ``PhaseResponse``.
    """
    return PhaseResponse()(scene, THEORY_ACCURACY)


@dataclass(frozen=True)
class NoisyRecurrence(EventStatistics):
    """Measure that computes event statistics and predicts the effect of weak shear stress noise.

    The fields are described in ``EventStatistics``.
    """

    name: ClassVar[str] = "noisy_recurrence"
    outputs = (
        *EventStatistics.outputs,
        Output(
            "interval_cv_theory",
            "$CV$",
            "1",
            "coefficient of variation of the recurrence interval by the phase response",
        ),
        *PhaseResponse.outputs,
    )

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the statistics of the events, and add the theoretical predictions.

        See ``EventStatistics.compute``.
        """
        outcome = super().compute(scene, integrator)
        theory = compute_phase_response(scene.with_(loading_noise="none"))
        if Status.OK not in (outcome.status, theory.status) or not theory.values:
            return outcome
        expected = scene.stress_noise * theory.values["stress_noise_sensitivity"]
        values = {**outcome.values, **theory.values, "interval_cv_theory": expected}
        return Outcome(outcome.status, values, outcome.message)
