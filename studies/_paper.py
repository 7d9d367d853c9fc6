"""Name of the paper, and the cases of normal stress that its studies compare."""

PAPER = "doi:10.1007/s11589-014-0098-4"
REFERENCE = (
    "Effect of varying normal stress on stability and dynamic motion of a spring-slider system "
    f"with rate- and state-dependent friction, Earthquake Science (2014), {PAPER}"
)
GU_ET_AL = "Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196"

CONSTANT, WEAK, STRONG = "constant normal stress", "alpha = 0.25", "alpha = 0.56"
CASES: dict[str, dict[str, str | float]] = {
    CONSTANT: {"normal_stress": "constant"},
    WEAK: {"normal_stress": "variable", "alpha": 0.25},
    STRONG: {"normal_stress": "variable", "alpha": 0.56},
}
