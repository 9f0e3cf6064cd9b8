"""Every frame of an outfit that is played is judged; what crosses is told by its frame, and is in the page."""

import frame_judge
import numpy as np
import pytest
from outfits_page import BEGIN, END, line, write
from outfits_played import OUTFIT, edge_for, played, put_on

from tryon_solver.geometry.panel_mesh import mesh_pattern
from tryon_solver.geometry.pattern import load_pattern


@pytest.fixture(scope="module")
def worn():
    """A T-shirt of few triangles, which does."""
    return put_on(["tshirt"], 0.06, "draft", "cpu")


def test_every_frame_is_judged_and_what_crosses_is_told_by_its_frame(worn, monkeypatch):
    asked = []
    judge = frame_judge.FrameJudge.judge

    def counting(self, cloth, body):
        asked.append(cloth.copy())
        if len(asked) == 3:
            cloth = np.zeros_like(cloth)  # all in a point, in the body
        return judge(self, cloth, body)

    monkeypatch.setattr(frame_judge.FrameJudge, "judge", counting)
    figures = played(worn, "walk", 5, 30.0)
    assert (len(asked), figures["judged"], figures["frames"]) == (5, 5, 5)
    assert figures["crossing"] == [3]
    assert "1 of 5 frames judged, of 5, cross, first in frame 3" in line(figures)
    again = played(worn, "walk", 2, 30.0)
    assert again["crossing"] == []
    assert np.allclose(asked[0], asked[5], atol=2e-4), "each motion begins as it was put on"


def test_as_many_vertices_as_asked_for_in_the_mean():
    patterns = [load_pattern(f"server/tryon_server/demo/patterns/{name}.json") for name in OUTFIT]
    counts = [len(mesh_pattern(pattern, edge_for(1500)).uv) for pattern in patterns]
    assert np.mean(counts) == pytest.approx(1500, rel=0.15)


def test_runs_are_written_between_the_marks_of_a_page(tmp_path):
    def of(garments, crossing, ms):
        counts = {"vertices": [3000] * len(garments), "frames": 90, "judged": 90, "void": 0}
        figures = {"ms": ms, "ms_99": 2 * ms, "cpu_ms": ms, "gap": 3e-4, "lag": 2e-3, "stretch": 1.1}
        return {"motion": "walk", "garments": garments, "crossing": crossing, **counts, **figures}

    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    about = {"machine": "a machine", "commit": "c0ffee", "preset": "draft", "fps": 30.0}
    run = {"about": about, "runs": [of(["tshirt"], [], 100.0), of(["skirt", "tshirt"], [7], 250.0)]}
    assert write(page, [run]) == 1
    text = page.read_text()
    assert text.startswith(f"before\n{BEGIN}\n")
    assert text.endswith(f"{END}\nafter\n")
    assert "old" not in text
    assert "commit c0ffee" in text
    assert "**1 of 180 frames cross.**" in text
    assert "| 2.50 | 2.50 |" in text
    run["runs"][1]["crossing"] = []
    assert write(page, [run]) == 0
    page.write_text("no place")
    with pytest.raises(ValueError, match="there is no place for the runs"):
        write(page, [run])
