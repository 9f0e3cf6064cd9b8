"""An edit of each kind that the demo's T-shirt can take."""

from tryon_solver.redesign import edits

EDITS = [
    edits.MoveVertex("front", 2, (0.01, -0.02)),
    edits.MoveHandle("front", 2, 1, (0.01, 0.0)),
    edits.Lengthen("front", 0, 0.05),
    edits.TakeIn("front", 1, -0.01),
    edits.ScalePiece("front", (1.1, 0.9)),
    edits.ScaleGarment((1.05, 1.05)),
    edits.Gather("front", 1, 0.8),
    edits.Ease("front", 1),
    edits.OpenSeam("front", 1),
    edits.CloseSeam("front", 4, "back", 5),
    edits.Cut("front", ((-1.0, 0.2), (1.0, 0.2)), True),
    edits.Dart("front", 0, 0.25, 0.03, 0.12),
    edits.Patch("front", (0.0, 0.2), 0.1, 0.08, 15.0),
    edits.Pocket("front", (0.08, 0.4), 0.1, 0.12),
    edits.RemovePiece("left_sleeve_back"),
    edits.ChangeFabric("denim"),
]
