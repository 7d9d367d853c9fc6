"""State evolution laws, one file each.

The state variable is written so that every law shares

    tau = sigma (mu_* + a ln(V/V_*) + Theta),

which for the slowness law means Theta = b ln(theta/theta_*).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.parts import Function, Numbers, Part, found_in, number

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene


@dataclass(frozen=True, kw_only=True)
class Law(Part):
    """Base of the laws.

    A law states ``evolution(log_rate, state, p)``: the change of its state variable per unit of
    slip in D_c, at constant normal stress. It comes to rest at Theta = -b ln(V/V_*), unless it
    states ``resting(log_rate, shift, p)``: the states Psi of steady sliding, of which stress has
    taken `shift`. At V_* they add up to nothing, because friction is mu_* there.

    A law of several states says how many, and states ``evolutions(log_rate, psis, shift, share,
    p)`` instead, all of them times a share, and `resting`.
    """

    b_over_a: float = number(
        2.0,
        "$b/a$",
        "1",
        "ratio of evolution effect to direct effect",
        rule="must be greater than 0",
    )

    #: How many states the law has.
    states: ClassVar[int] = 1
    #: Whether every orbit closes at critical stiffness, where friction alone acts and stress has no
    #: effect on it: where evolution changes with its own state in proportion to itself.
    orbits_close: ClassVar[bool] = False
    #: ``stress_left(rate, slip)``: the stress in units of b that is left above its steady value
    #: after so much slip at constant ln(V/V_*), at constant normal stress; closed forms only.
    stress_left: ClassVar[Function | None] = None
    evolution: ClassVar[Function | None] = None
    evolutions: ClassVar[Function | None] = None
    resting: ClassVar[Function | None] = None
    #: ``state_effect(friction, ratio, change, p) -> (shift, slope)``: by how much stress lowers the
    #: state variable, and its derivative with respect to friction; none for most laws.
    state_effect: ClassVar[Function | None] = None

    def __init_subclass__(cls) -> None:
        """A law with an evolution of its own does not inherit what is known of another's."""
        super().__init_subclass__()
        if {"evolution", "evolutions"} & vars(cls).keys():
            for name, unknown in (("orbits_close", False), ("stress_left", None)):
                if name not in vars(cls) and getattr(cls, name) != unknown:
                    setattr(cls, name, unknown)

    @classmethod
    def functions(cls) -> tuple[str, ...]:
        return ("evolution",) if cls.states == 1 else ("evolutions", "resting")

    def numbers(self, scene: Scene) -> Numbers:
        """b."""
        return (scene.a * self.b_over_a,)

    def check(self, scene: Scene) -> None:
        """Rate weakening, where the spring is given by its ratio to the critical stiffness."""
        if self.b_over_a <= 1.0 and scene.as_dict()["stiffness"] is None:
            raise InvalidValue(
                "b_over_a",
                self.b_over_a,
                "must exceed 1: without rate weakening there is no critical stiffness",
                remedy="Steady sliding is then stable at every stiffness: give stiffness itself.",
            )


PARTS = found_in(__name__, __path__)
