"""Literature reference of the paper, and normal stress cases that several studies use."""

PAPER = "doi:10.1007/s11589-014-0098-4"
REFERENCE = (
    "Effect of varying normal stress on stability and dynamic motion of a spring-slider system "
    f"with rate- and state-dependent friction, Earthquake Science (2014), {PAPER}"
)
GU_ET_AL = "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196"

CONSTANT_NORMAL_STRESS, WEAK_NORMAL_STRESS_EFFECT, STRONG_NORMAL_STRESS_EFFECT = (
    "constant normal stress",
    "alpha = 0.25",
    "alpha = 0.56",
)
NORMAL_STRESS_CASES: dict[str, dict[str, str | float]] = {
    CONSTANT_NORMAL_STRESS: {"normal_stress": "constant"},
    WEAK_NORMAL_STRESS_EFFECT: {"normal_stress": "variable", "alpha": 0.25},
    STRONG_NORMAL_STRESS_EFFECT: {"normal_stress": "variable", "alpha": 0.56},
}
