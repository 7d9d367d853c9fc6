r"""Deterministic model of the laboratory earthquakes of Gualandi et al. (2023).

The model is a spring-slider with the slip law, radiation damping and a pore fluid. The pores close
when the slip rate increases, and the porosity evolves over a separate slip distance. At normal
stresses between 16.6 and 21.9 MPa, the cycle with one event per period is unstable, and long and
short recurrence intervals alternate. The coefficient of variation (CV) of the intervals is then the
difference of the two intervals divided by their sum. At all other normal stresses of the
experiments, all intervals are equal.

The stochastic model of the paper adds white noise to shear stress and to effective normal stress,
and this noise does not change the slip rate immediately. At a given slip rate, stress can change
only if the state variable changes. The noise therefore also acts on the state variable. In scenes
of rsfstudy with noise in the stress, the slip rate responds to the noise immediately. These scenes
therefore differ from the stochastic model of the paper.

Gualandi et al. denote the unknowns by :math:`x = \ln(V/V_0)`, :math:`y = (\tau - \mu_0 \sigma)/(a
\sigma)`, :math:`z = (\varphi - \varphi_0)/(\lambda \beta \sigma)` and :math:`u = -p/(\lambda
\sigma)` with :math:`\lambda = a/\mu_0`. Their normal stress :math:`\sigma` includes the pore
pressure, which is the atmospheric pressure :math:`p_0` in steady sliding. Stresses of a scene are
normalised by the effective normal stress of steady sliding, so :math:`\sigma_* = \sigma - p_0`.
With this normalisation, the two models are equal, and the unknowns are related by

.. math::

    f = \frac{a \sigma y + \mu_0 p_0}{\sigma_*}, \quad
    \frac{\varphi - \varphi_0}{\beta \sigma_*} = \frac{\lambda \sigma}{\sigma_*} z, \quad
    P = -\frac{\lambda \sigma u + p_0}{\sigma_*}.
"""

import math

from rsfstudy import Rig, Scene

#: Papers with the model, and with the pore fluid.
REFERENCES = [
    "Gualandi, Faranda, Marone, Cocco and Mengaldo (2023), Earth Planet. Sci. Lett. 604, 117995",
    "Segall and Rice (1995), J. Geophys. Res. 100, 22155-22171",
]

# The constants below have the values of the Julia program that accompanies the paper. The comments
# contain the symbols of the program.

#: Normal stresses of the 12 experiments in MPa (sigma_n0).
NORMAL_STRESSES = (
    13.6, 14.0, 14.408, 15.001, 15.4, 16.389, 17.003, 20.002, 21.985, 23.012, 24.017, 24.976,
)  # fmt: skip
#: Direct effect (a), ratio of evolution effect to direct effect (beta_1), and friction coefficient
#: of steady sliding (mu_0).
DIRECT_EFFECT, B_OVER_A, FRICTION = 0.01, 1.2, 0.64
#: Slip distance of friction (L_1), load point velocity and reference velocity (v_0 for both), and
#: stiffness (k).
SLIP_DISTANCE, VELOCITY, STIFFNESS = "3 um", "10 um/s", "14.8 GPa/m"
#: Slip distance of porosity. The program contains the ratio rho = 0.1 of L_1 to this slip distance.
POROSITY_LENGTH = "30 um"
#: Rate at which pore pressure returns to the atmospheric pressure (c_0), and atmospheric pressure
#: in Pa (p_0).
DRAINAGE, ATMOSPHERIC_PRESSURE = "0.1 1/s", 1.01325e5
#: Dilatancy epsilon. The value is negative, because pores close when the slip rate increases.
DILATANCY = -0.017e-3
#: Compressibility of pore fluid and pores in 1/Pa, beta = phi_0 (beta_a + beta_m).
COMPRESSIBILITY = 0.075 * (1e-9 + 1e-11)
#: Shear modulus in Pa (G) and density in kg/m^3 (rho_v) of quartz.
SHEAR_MODULUS, DENSITY = 31e9, 2.65e3
#: Amplitude of the noise of shear stress in Pa per square root of L_1/v_0 (half of epsilon_0 tau).
STRESS_NOISE = 0.5 * 0.004e6
#: Ratio of the damping coefficient (eta) to that of plane waves in quartz, G/(2 c_s).
DAMPING_FACTOR = 20.0


def build_gualandi_rig(normal_stress: float) -> Rig:
    """Return the rig of an experiment.

    Parameters
    ----------
    normal_stress : float
        Applied normal stress in MPa, including the atmospheric pressure in the pores.

    Returns
    -------
    Rig
        Rig whose normal stress is the effective normal stress of steady sliding.
    """
    return Rig(
        normal_stress=1e6 * normal_stress - ATMOSPHERIC_PRESSURE,
        slip_distance=SLIP_DISTANCE,
        reference_velocity=VELOCITY,
        stiffness=STIFFNESS,
    )


def build_gualandi_scene(normal_stress: float) -> Scene:
    """Return the scene of the deterministic model.

    Parameters
    ----------
    normal_stress : float
        Applied normal stress in MPa, including the atmospheric pressure in the pores.

    Returns
    -------
    Scene
        Scene with steady loading. A small initial stress starts the motion away from steady
        sliding.
    """
    # The shear wave velocity is c_s = sqrt(G/rho_v), so G/(2 c_s) = sqrt(G rho_v)/2. A plain number
    # for a field with the units of stress is a stress in Pa.
    impedance = DAMPING_FACTOR * 0.5 * math.sqrt(SHEAR_MODULUS * DENSITY)
    rig = build_gualandi_rig(normal_stress)
    return rig.scene(
        law="slip",
        normal_stress="constant",
        fluid="dilatant",
        a=DIRECT_EFFECT,
        b_over_a=B_OVER_A,
        mu_star=FRICTION,
        radiation_damping=impedance * rig.reference_velocity,
        dilatancy=DILATANCY / COMPRESSIBILITY,
        drainage=DRAINAGE,
        porosity_length=POROSITY_LENGTH,
        load_velocity_ratio=1.0,
        initial_stress=1e-3 * rig.normal_stress,
    )
