"""What a fabric is: the numbers every material model reads."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Fabric:
    """A woven or knitted fabric.

    `k_warp` and `k_weft` are the stretch stiffnesses along the pattern's u and v, `k_shear` resists in-plane shear and
    must not exceed them (membrane.py says why). `strain_limit` is the largest principal stretch the fabric allows: 1.1
    is ten per cent longer than the pattern.
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
    colour: tuple[float, float, float] = (0.8, 0.8, 0.8)  # linear RGB, for display only

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in ("name", "colour"):
                continue
            if not (isinstance(value, (int, float)) and 0 <= value < float("inf")):
                raise ValueError(f"fabric {self.name!r}: {field.name} must be a finite number >= 0, not {value!r}")
        if not self.areal_density > 0:
            raise ValueError(f"fabric {self.name!r}: areal_density must be above 0 kg/m^2")
        if self.k_shear > min(self.k_warp, self.k_weft):
            raise ValueError(
                f"fabric {self.name!r}: k_shear {self.k_shear} N/m exceeds the smaller stretch stiffness "
                f"{min(self.k_warp, self.k_weft)} N/m; lower k_shear"
            )
        if self.strain_limit <= 1:
            raise ValueError(f"fabric {self.name!r}: strain_limit must be above 1, the rest length")


# Densities and thicknesses follow common shop fabrics; stretch limits of the wovens follow the measured values used by
# Codimensional IPC (Li et al. 2021, table of fabrics). Stiffnesses are of the order used for garments there and in
# Newton's Style3D solver. They set how the demo looks and are no laboratory measurement.
FABRICS: dict[str, Fabric] = {
    fabric.name: fabric
    for fabric in (
        Fabric("cotton_jersey", 0.18, 0.6e-3, 250.0, 200.0, 60.0, 6e-6, 1.15, 0.3, 0.3, (0.76, 0.24, 0.20)),
        Fabric("cotton_poplin", 0.12, 0.4e-3, 600.0, 500.0, 60.0, 2e-5, 1.061, 0.3, 0.3, (0.75, 0.80, 0.86)),
        Fabric("wool_twill", 0.27, 0.6e-3, 500.0, 400.0, 50.0, 4e-5, 1.085, 0.35, 0.35, (0.22, 0.23, 0.28)),
        Fabric("denim", 0.40, 0.8e-3, 1000.0, 900.0, 150.0, 1.5e-4, 1.05, 0.4, 0.4, (0.10, 0.18, 0.36)),
        Fabric("silk_charmeuse", 0.08, 0.4e-3, 400.0, 300.0, 25.0, 3e-6, 1.07, 0.2, 0.2, (0.62, 0.50, 0.64)),
    )
}
