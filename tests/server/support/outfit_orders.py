"""Orders of several garments at once."""

from pathlib import Path

from tryon_server.app import BUILT_IN_PATTERNS
from tryon_server.runtime.order import DrapeOrder, GarmentOrder


def overshirt_over_tshirt(wardrobe: Path) -> DrapeOrder:
    """The demo's T-shirt, and its overshirt of another fabric over that, of few triangles."""
    over = GarmentOrder(worn_as="outer", pattern=BUILT_IN_PATTERNS / "overshirt.json", fabric="denim")
    return DrapeOrder(
        pattern=BUILT_IN_PATTERNS / "tshirt.json",
        fabric="cotton_jersey",
        preset="draft",
        device="cpu",
        edge_length=0.06,
        wardrobe=wardrobe,
        worn_as="inner",
        over=(over,),
    )
