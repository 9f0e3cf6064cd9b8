"""What a fabric is: the numbers every material model reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np

from tryon_solver.checks import as_float, check_number, told
from tryon_solver.materials.look import Look


@dataclass(frozen=True)
class Fabric:
    """A woven or knitted fabric.

    `k_warp` and `k_weft` are the stretch stiffnesses along the pattern's u and v, `k_shear` resists in-plane shear and
    must not exceed them (membrane.py says why): sheared by a small angle, cloth resists with k_shear/2 times that, so
    what a shear test measures as G is half of it. `strain_limit` is the largest principal stretch the fabric allows:
    1.1 is ten per cent longer than the pattern. `source` says what the numbers follow, and `drape` what drape
    coefficients were published for such cloth: 0 hangs straight down, 1 stays flat (Cusick 1968; BS 5058).
    """

    name: str
    areal_density: float  # kg/m^2
    thickness: float  # m
    k_warp: float  # N/m
    k_weft: float  # N/m
    k_shear: float  # N/m
    k_bend: float  # N m
    strain_limit: float  # -
    mu_body: float  # - Coulomb coefficient against skin
    mu_self: float  # - Coulomb coefficient against cloth
    look: Look = field(default_factory=Look)  # for display only
    source: str = ""
    drape: tuple[float, float] | None = None  # - least and most published; None: none was found

    def __post_init__(self) -> None:
        for name in ("name", "source"):
            if not isinstance(getattr(self, name), str):
                raise ValueError(f"fabric {told(self.name)}: {name} must be text, not {told(getattr(self, name))}")
        if not isinstance(self.look, Look):
            raise ValueError(f"fabric {self.name!r}: look is {told(self.look)}; give a Look")
        for name in (entry.name for entry in fields(self)):
            if name not in ("name", "look", "source", "drape"):
                check_number(f"fabric {self.name!r}: {name}", getattr(self, name), above=name == "areal_density")
        if self.k_shear > min(self.k_warp, self.k_weft):
            raise ValueError(
                f"fabric {self.name!r}: k_shear {self.k_shear} N/m exceeds the smaller stretch stiffness "
                f"{min(self.k_warp, self.k_weft)} N/m; lower k_shear"
            )
        if self.strain_limit <= 1:
            raise ValueError(f"fabric {self.name!r}: strain_limit must be above 1, the rest length")
        if self.drape is not None:
            two = isinstance(self.drape, tuple) and len(self.drape) == 2
            if not two or not 0 <= as_float(self.drape[0]) <= as_float(self.drape[1]) <= 1:
                raise ValueError(
                    f"fabric {self.name!r}: drape must be two shares of 1, least first, not {told(self.drape)}"
                )


# What is published and what is estimated of each fabric: docs/fabrics.md. A contact's thickness is not below 0.4 mm, so
# the thinnest cloth here lies on itself as if it were somewhat thicker than it is.
FABRICS: dict[str, Fabric] = {
    fabric.name: fabric
    for fabric in (
        Fabric(
            "cotton_jersey",
            areal_density=0.18,
            thickness=0.6e-3,
            k_warp=250.0,
            k_weft=200.0,
            k_shear=60.0,
            k_bend=1.8e-6,
            strain_limit=1.15,
            mu_body=0.3,
            mu_self=0.3,
            look=Look(
                "knit", (0.76, 0.24, 0.20), pitch=(0.9e-3, 0.7e-3), relief=0.45, roughness=0.92, sheen=0.45, nap=0.25
            ),
            source="density and thickness of a T-shirt's single jersey; bending set by its drape",
            drape=(0.18, 0.31),
        ),
        Fabric(
            "cotton_poplin",
            areal_density=0.12,
            thickness=0.4e-3,
            k_warp=600.0,
            k_weft=500.0,
            k_shear=60.0,
            k_bend=1e-5,
            strain_limit=1.061,
            mu_body=0.3,
            mu_self=0.3,
            look=Look(
                "plain", (0.75, 0.80, 0.86), pitch=(0.28e-3, 0.42e-3), relief=0.3, roughness=0.72, sheen=0.2
            ),
            source="strain limit of cotton: Li et al. 2021; density of a shirting; bending set by its drape",
            drape=(0.48, 0.76),
        ),
        Fabric(
            "wool_twill",
            areal_density=0.27,
            thickness=0.6e-3,
            k_warp=500.0,
            k_weft=400.0,
            k_shear=50.0,
            k_bend=4e-5,
            strain_limit=1.085,
            mu_body=0.35,
            mu_self=0.35,
            look=Look(
                "twill",
                (0.075, 0.082, 0.11),
                weft=(0.15, 0.15, 0.165),
                pitch=(0.5e-3, 0.55e-3),
                relief=0.5,
                roughness=0.97,
                sheen=0.8,
                nap=0.55,
                mottle=0.3,
            ),
            source="strain limit of wool: Li et al. 2021; density of a winter suiting; stiffnesses estimated",
            drape=(0.40, 0.85),
        ),
        Fabric(
            "denim",
            areal_density=0.40,
            thickness=0.8e-3,
            k_warp=1000.0,
            k_weft=900.0,
            k_shear=150.0,
            k_bend=1.5e-4,
            strain_limit=1.05,
            mu_body=0.4,
            mu_self=0.4,
            look=Look(
                "twill",
                (0.022, 0.050, 0.135),
                weft=(0.25, 0.26, 0.27),
                pitch=(0.34e-3, 0.52e-3),
                relief=0.6,
                roughness=0.9,
                sheen=0.15,
                unevenness=0.3,
                mottle=0.35,
            ),
            source="density of 12 oz denim; strain limit of a heavy twill; stiffnesses estimated",
            drape=(0.70, 0.90),
        ),
        Fabric(
            "silk_charmeuse",
            areal_density=0.08,
            thickness=0.4e-3,
            k_warp=400.0,
            k_weft=300.0,
            k_shear=25.0,
            k_bend=1.5e-6,
            strain_limit=1.07,
            mu_body=0.2,
            mu_self=0.2,
            look=Look(
                "satin",
                (0.62, 0.50, 0.64),
                pitch=(0.1e-3, 0.2e-3),
                relief=0.1,
                roughness=0.32,
                lustre=0.45,
                sheen=0.2,
                unevenness=0.05,
            ),
            source="density of 19 momme; strain limit of silk: Li et al. 2021; bending set by its drape",
            drape=(0.20, 0.40),
        ),
        Fabric(
            "viscose_jersey",
            areal_density=0.20,
            thickness=0.5e-3,
            k_warp=120.0,
            k_weft=100.0,
            k_shear=20.0,
            k_bend=1e-6,
            strain_limit=1.15,
            mu_body=0.25,
            mu_self=0.25,
            look=Look(
                "knit", (0.055, 0.20, 0.17), pitch=(0.55e-3, 0.45e-3), relief=0.3, roughness=0.6, sheen=0.5, nap=0.05
            ),
            source="density of a dress jersey; stiffnesses set by its drape",
            drape=(0.10, 0.25),
        ),
        Fabric(
            "polyester_satin",
            areal_density=0.13,
            thickness=0.4e-3,
            k_warp=600.0,
            k_weft=500.0,
            k_shear=40.0,
            k_bend=8e-6,
            strain_limit=1.06,
            mu_body=0.2,
            mu_self=0.2,
            look=Look(
                "satin",
                (0.42, 0.015, 0.045),
                pitch=(0.12e-3, 0.25e-3),
                relief=0.12,
                roughness=0.24,
                lustre=0.4,
                sheen=0.05,
                unevenness=0.03,
            ),
            source="density of a dress satin; stiffnesses set by its drape",
            drape=(0.43, 0.70),
        ),
        Fabric(
            "linen",
            areal_density=0.19,
            thickness=0.5e-3,
            k_warp=900.0,
            k_weft=800.0,
            k_shear=60.0,
            k_bend=4e-5,
            strain_limit=1.045,
            mu_body=0.35,
            mu_self=0.35,
            look=Look(
                "plain",
                (0.56, 0.46, 0.32),
                weft=(0.60, 0.52, 0.39),
                pitch=(0.6e-3, 0.6e-3),
                relief=0.6,
                roughness=0.88,
                sheen=0.1,
                unevenness=0.75,
                mottle=0.4,
            ),
            source="density of a suit linen; stiffnesses set by its drape",
            drape=(0.60, 0.85),
        ),
        Fabric(
            "silk_taffeta",
            areal_density=0.09,
            thickness=0.4e-3,
            k_warp=700.0,
            k_weft=600.0,
            k_shear=70.0,
            k_bend=3e-5,
            strain_limit=1.05,
            mu_body=0.25,
            mu_self=0.25,
            look=Look(
                "plain",
                (0.30, 0.21, 0.03),
                weft=(0.62, 0.30, 0.06),
                pitch=(0.16e-3, 0.3e-3),
                relief=0.3,
                roughness=0.38,
                lustre=0.25,
                sheen=0.15,
                unevenness=0.3,
                mottle=0.1,
            ),
            source="density of a dress taffeta; stiffnesses set by its drape",
            drape=(0.75, 0.95),
        ),
        Fabric(
            "cotton_canvas",
            areal_density=0.34,
            thickness=0.7e-3,
            k_warp=1200.0,
            k_weft=1100.0,
            k_shear=200.0,
            k_bend=4e-4,
            strain_limit=1.04,
            mu_body=0.4,
            mu_self=0.4,
            look=Look(
                "plain",
                (0.70, 0.66, 0.56),
                pitch=(0.9e-3, 1.0e-3),
                relief=0.7,
                roughness=0.96,
                sheen=0.05,
                unevenness=0.35,
                mottle=0.2,
            ),
            source="density of 10 oz duck; stiffnesses set by its drape",
            drape=(0.85, 1.0),
        ),
    )
}


def between_fabrics(fabrics: Sequence[Fabric]) -> np.ndarray:
    """(K + 1, K + 1), without unit: between K fabrics and the body, which is last."""
    own = np.array([fabric.mu_self for fabric in fabrics])
    skin = np.array([fabric.mu_body for fabric in fabrics])
    table = np.zeros((len(fabrics) + 1, len(fabrics) + 1))
    table[:-1, :-1] = np.sqrt(np.outer(own, own))
    table[np.diag_indices(len(fabrics))] = own  # a root of a square may be off in its last digit
    table[:-1, -1] = table[-1, :-1] = skin
    return table
