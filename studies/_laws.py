"""What the studies of state evolution laws share: the laws they compare, and their sources."""

#: The family from slip (eps = 0) to slowness (eps = 1), and laws beside it.
SLIP, MIDDLE, SLOWNESS = "eps = 0 (slip)", "eps = 0.5", "eps = 1 (slowness)"
PERRIN, COMPOSITE, CUT_OFF = "Perrin-Rice-Zheng", "composite", "cut-off"
NAGATA = "slowness, c = 1"
#: V_c/V_* of the composite law and of the cut-off.
HEALS_UP_TO, CUT_AT = 100.0, 1e4


def _family(exponent: float) -> dict[str, str | float]:
    return {"law": "family", "law_exponent": exponent}


LAWS: dict[str, dict[str, str | float]] = {
    SLIP: _family(0.0),
    "eps = 0.25": _family(0.25),
    MIDDLE: _family(0.5),
    "eps = 0.75": _family(0.75),
    SLOWNESS: _family(1.0),
    PERRIN: {"law": "perrin_rice_zheng"},
    COMPOSITE: {"law": "composite", "cutoff_velocity_ratio": HEALS_UP_TO},
    CUT_OFF: {"law": "cut_off", "cutoff_velocity_ratio": CUT_AT},
    NAGATA: {"law": "slowness", "stress_dependence": 1.0},
}

#: w exp(w) = exp(-V_*/V_c): the steady state of the composite law at V_*.
HEALED = 0.56353169695

REFERENCES = [
    "Perrin, Rice and Zheng (1995), J. Mech. Phys. Solids 43, 1461-1495",
    "Kato and Tullis (2001), Geophys. Res. Lett. 28, 1103-1106",
    "Nagata, Nakatani and Yoshida (2012), J. Geophys. Res. 117, B02314",
    "Ciardo and Viesca (2024), arXiv 2407.16846",
]
