"""Scene and literature reference that all studies of pore fluids use."""

from rsfstudy import Scene

SEGALL_RICE = "Segall and Rice (1995)"
REFERENCE = f"{SEGALL_RICE}, J. Geophys. Res. 100, 22155-22171"

#: Dilatant fault with a = 0.01, b = 0.015 and mu_* = 0.5. The effect of dilatancy on friction, E =
#: mu_* eps/(beta sigma_*), is therefore half of the field ``dilatancy``.
DILATANT_FAULT = Scene(
    a=0.01, b_over_a=1.5, mu_star=0.5, normal_stress="constant", fluid="dilatant", drainage=1.0
)
