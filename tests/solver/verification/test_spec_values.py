"""What no step could do anything with is refused when a spec is made, by name: whatever is put into whichever field."""

import re
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from small_scenes import fabric, sheet

from tryon_solver import scene
from tryon_solver.materials.fabric import FABRICS, Fabric
from tryon_solver.materials.look import Look
from tryon_solver.scene import (
    Adhesion,
    AirDrag,
    Attached,
    Creases,
    Elastic,
    ElasticLine,
    FabricDamping,
    Fasteners,
    Friction,
    Gas,
    Gravity,
    Gusts,
    Pins,
    Pressure,
    Scene,
    SelfContact,
    Sewing,
    Sleep,
    StrainLimit,
    StretchCurves,
    Wind,
)
from tryon_solver.simulation import build

NAN, INF = float("nan"), float("inf")


def ints(*shape):
    return np.zeros(shape, np.int32)


# Of every kind of field, what it does not take.
NO_NUMBER = ("a", "1", True, NAN, INF, -INF, (1.0,), [1.0], np.ones(1), np.float32(NAN), 1e39, 10**400, 1j, b"1", int)
SIGNED = (None, *NO_NUMBER)
OPEN = (*NO_NUMBER, -1.0, np.float32(-1.0))  # where None stands for something
NUMBER = (None, *OPEN)
ABOVE = (*NUMBER, 0.0, 0, 1e-50)
SHARE = (*NUMBER, 1.1)
WHOLE = (None, "a", True, 1.5, 2.0, -1, np.int64(-1), NAN, (1,))
FLAG = (None, "body", 1, 0.0, ())
TRIPLE = (0.0, 1.0, 0.0)
VECTOR = (
    None, 1.0, "north", (), (0.0, 1.0), (0.0, 1.0, 0.0, 0.0), [0.0, 1.0, 0.0], np.array(TRIPLE), ((0.0, 1.0, 0.0),),
    *((0.0, part, 0.0) for part in (NAN, INF, "1", None, True, 1e39)),
)  # fmt: skip
NO_INDICES = ("a", 3, 1.5, True, [0, 1], (0, 1), ["a"], ints(), ints(1, 1, 1), ints(1, 5), np.array(None))
INDICES = (None, *NO_INDICES, np.zeros(1), np.zeros(1, bool), np.zeros(1, np.uint64), np.array(["a"]), ints(1, 2))
PAIRS = (None, *NO_INDICES, np.zeros((1, 2)), np.ones((1, 2), bool), np.array([["0", "1"]]), ints(2), [[0, 1]])
PANELS = (None, "0", 0, [0], ints(1), ("0",), (0.0,), (True,), (-1,), (None,), ((0,),))
TABLE = ("a", 0.3, True, [[0.3, 0.3], [0.3, 0.3]], np.full((2, 2), "a"), np.ones((2, 2), bool), np.ones(2),
         np.ones((2, 3)), np.full((2, 2), NAN), np.full((2, 2), INF), np.full((2, 2), -1.0))  # fmt: skip
CURVE = (None, "a", 1.0, [(0.1, 5.0)], ("ab",), (0.1, 5.0), ((0.1,),), ((0.1, 5.0, 1.0),), ([0.1, 5.0],), ((NAN, 5.0),),
         ((0.1, INF),), (("0.1", 5.0),), ((0.1, None),), ((0.1, True),), ((-0.1, 5.0),), ((0.1, -5.0),),
         ((0.2, 5.0), (0.1, 6.0)), ((0.1, 5.0), (0.2, 4.0)))  # fmt: skip

EDGES = np.array([[0, 1], [1, 2]], np.int32)
LINE = ElasticLine(EDGES, 0.8, 20.0)
ONTO, THIRDS = np.array([[1, 2, 3]], np.int32), np.full((1, 3), 1 / 3)
HALVES = np.full((2, 2), 0.5)

REFUSED = {
    Gravity: ("gravity: ", Gravity(), {"acceleration": VECTOR}),
    Friction: (
        "friction: ",
        Friction(1e-4, HALVES, HALVES),
        {"presliding": ABOVE, "static": TABLE, "kinetic": TABLE},
    ),
    StrainLimit: ("strain limit: ", StrainLimit(), {"stiffness": NUMBER}),
    StretchCurves: ("stretch curves: ", StretchCurves(((0.1, 5.0),)), {"warp": CURVE, "weft": CURVE}),
    AirDrag: ("air drag: ", AirDrag(), {"coefficient": NUMBER}),
    Gusts: ("wind: gusts.", Gusts(), {"intensity": SHARE, "length": ABOVE, "seed": WHOLE}),
    Wind: (
        "wind: ",
        Wind(TRIPLE, Gusts(), 0.5),
        {
            "velocity": VECTOR,
            "gusts": (0.3, "a", True, (), (0.2, 5.0), Gusts, Gravity()),
            "shelter": SHARE,
            "shelter_length": ABOVE,
            "density": NUMBER,
            "broadside": NUMBER,
            "along": NUMBER,
        },
    ),
    FabricDamping: ("fabric damping: ", FabricDamping(), {"time": NUMBER}),
    Sewing: ("sewing: ", Sewing(EDGES, 1e3), {"stitches": (*PAIRS, np.array([[0, 1], [4, 4]])), "stiffness": NUMBER}),
    Attached: (
        "attached: ",
        Attached(ints(1), ONTO, THIRDS, 1e3),
        {
            "vertices": INDICES,
            "onto": (*PAIRS, ints(1, 2), ints(2, 3), ONTO.astype(float)),
            "weights": (
                None, "a", 1.0, THIRDS.tolist(), THIRDS[0], np.full((2, 3), 1 / 3), np.full((1, 2), 1 / 2), THIRDS > 0,
                THIRDS.astype(str), THIRDS * NAN, THIRDS * INF, 2.0 * THIRDS, 0.0 * THIRDS, THIRDS.astype(complex),
                np.array([[500.0, -499.0, 0.0]]),
            ),
            "stiffness": NUMBER,
        },
    ),
    Pins: ("pins: ", Pins(ints(1)), {"vertices": INDICES, "stiffness": NUMBER, "led": FLAG}),
    Fasteners: (
        "fasteners: ",
        Fasteners(EDGES),
        {"pairs": (*PAIRS, np.array([[0, 1], [4, 4]])), "stiffness": NUMBER, "speed": ABOVE},
    ),
    Pressure: ("pressure: ", Pressure(10.0), {"pressure": SIGNED, "panels": PANELS}),
    Gas: ("gas: ", Gas(), {"volume": (*OPEN, 0.0, 0), "ambient": ABOVE, "panels": PANELS}),
    ElasticLine: ("elastic: ", LINE, {"edges": PAIRS, "ratio": ABOVE, "stiffness": NUMBER}),
    Elastic: (
        "elastic: ",
        Elastic((LINE,)),
        {"lines": (None, "a", LINE, [LINE], EDGES, (EDGES,), (ElasticLine,), (LINE, None), 3)},
    ),
    Creases: (
        "creases: ",
        Creases(EDGES, np.ones(2)),
        {
            "edges": PAIRS,
            "angles": (
                None, "a", 1.0, [1.0, 1.0], (1.0, 1.0), np.ones((2, 1)), np.array(1.0), np.ones(2, bool),
                np.array(["a", "b"]), np.array([NAN, 1.0]), np.array([1.0, INF]), np.array([None, 1.0]),
            ),
        },
    ),
    Adhesion: (
        "adhesion: ",
        Adhesion(10.0, 1e-3),
        {
            "strength": NUMBER,
            "work": NUMBER,
            "vertices": INDICES[1:],
            "shear": OPEN,
            "presliding": ABOVE,
        },
    ),
    Sleep: ("sleep: ", Sleep(), {"speed": NUMBER, "fastest": NUMBER, "time": NUMBER, "shift": NUMBER}),
}  # fmt: skip
GARMENT, X = sheet(4, 4, 0.1, 0.1)
FAR = X + [0.0, 1e9, 0.0]
OF_FABRIC = {field.name: NUMBER for field in fields(Fabric)}
OF_FABRIC |= {"areal_density": ABOVE, "name": (None, 3, b"a"), "source": (None, 3), "look": (None, "knit", Look)}
OF_FABRIC |= {"strain_limit": (*NUMBER, 1.0)}
OF_FABRIC |= {"drape": (0.3, "ab", (0.2,), (0.2, 0.3, 0.4), (0.5, 0.4), (NAN, 1.0), [0.4, 0.5], ("a", "b"))}
COLOUR = ("red", 0.5, (0.5, 0.5), [0.5, 0.5, 0.5], (0.5, 0.5, 1.5), (0.5, 0.5, NAN), ("a", 0.5, 0.5), (True, 0.5, 0.5))
OF_LOOK = {field.name: SHARE for field in fields(Look)}
OF_LOOK |= {"weave": (None, "felt", 3), "colour": (None, *COLOUR), "weft": COLOUR}
OF_LOOK |= {"pitch": (None, 1e-3, "ab", (1e-3,), (1e-3, 0.0), (1e-3, NAN), (1e-3, INF), [1e-3, 1e-3], (1e-3, "a"))}
REFUSED |= {
    Fabric: ("fabric [^:]*: ", FABRICS["denim"], OF_FABRIC),
    Look: ("look: ", Look(), OF_LOOK),
    Scene: (
        "",
        Scene(GARMENT, X, effects=()),
        {
            "garment": (None, "tshirt", X, type(GARMENT)),
            "x_start": (
                None, "a", X.tolist(), X[:-1], X[:, :2], X.ravel(), X.astype(str), X.astype(object), X.astype(complex),
                X * NAN, X + INF, X > 0, FAR, -FAR, X + [0.0, 0.0, 2.0**14],
            ),
            "body": ("a", 3, X),
            "fabric": (None, "denim", FABRICS, Fabric),
            "effects": (
                None, Gravity(), [Gravity()], {Gravity(): 1}, "wind", ("wind",), (Gravity,), (Gravity(), None), (LINE,),
            ),
            "panel_fabrics": (None, "denim", FABRICS["denim"], [FABRICS["denim"]], ("denim",), (None,), (Fabric,)),
        },
    ),
}  # fmt: skip


def said_of(make):
    """The kind and the words of what it raises."""
    try:
        make()
    except Exception as error:  # whatever it is: what is no ValueError is a finding
        return f"{type(error).__name__}: {error}"
    return "taken"


@pytest.mark.parametrize("kind", REFUSED, ids=lambda kind: kind.__name__)
def test_every_field_refuses_by_name_what_it_does_not_take(kind):
    """With a single field changed, so that nothing else can be what is refused."""
    name, valid, bad = REFUSED[kind]
    wrong = []
    for field, value in ((field, value) for field, values in bad.items() for value in values):
        said = said_of(lambda: replace(valid, **{field: value}))  # noqa: B023
        if not re.match(f"ValueError: {name}{field}\\b", said):
            wrong.append(f"{field} = {value!r}: {said}")
    assert not wrong, "\n".join(wrong)


def test_no_field_of_a_spec_takes_whatever_it_is_given():
    kinds = [k for k in vars(scene).values() if is_dataclass(k) and k.__module__.endswith("_specs")]
    assert len(kinds) > 15
    for kind in (*kinds, Fabric, Look, Scene):
        bad = REFUSED[kind][2] if kind in REFUSED else {}
        assert {field.name for field in fields(kind)} == set(bad), kind
        assert all(len(values) > 1 for values in bad.values()), kind


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: AirDrag(-5.0), "air drag: coefficient must be a finite number of at least 0, not -5.0$"),
        (lambda: AirDrag("a"), "air drag: coefficient must be a finite number of at least 0, not 'a'$"),
        (lambda: AirDrag(1e39), "of at least 0, not 1e[+]39, which float32 does not hold$"),
        (lambda: Friction(1e-50), "above 0, not 1e-50, which float32 does not hold$"),
        (lambda: Gusts(1e6), "wind: gusts.intensity 1000000.0 is the speed's standard deviation over its mean"),
        (lambda: Gusts(seed=-1), "wind: gusts.seed must be a whole number of at least 0, not -1$"),
        (lambda: Wind(shelter="a"), "wind: shelter must be a share from 0 to 1, not 'a'$"),
        (lambda: Wind(TRIPLE, 0.3), r"wind: gusts is 0.3; give Gusts\(0.2\) for 20 %, or None for none"),
        (lambda: Wind("north"), "velocity must be a tuple of three finite numbers, along x, y and z, not 'north'"),
        (lambda: StretchCurves(((0.1, INF),)), r"warp\[0\] is \(0.1, inf\); give a strain and a tension"),
        (lambda: Pins([0]), r"pins: vertices is \[0\]; give an integer numpy array, as of int32, of shape \(K,\)"),
        (lambda: Sewing(np.zeros((1, 2)), 1.0), r"stitches is an array of float64 of shape \(1, 2\); give an integer"),
        (lambda: Sewing(np.array([[0, 1], [4, 4]]), 1.0), "sewing: stitches: stitch 1 is vertex 4 twice; name two"),
        (lambda: Attached(ints(1), ONTO, np.array([[0.5, NAN, 0.5]]), 1.0), r"weights is nan at \[0, 1\]; give finite"),
        (lambda: Attached(ints(1), ONTO, 0.5 * THIRDS, 1.0), "weights of row 0 sum to 0.5; give shares that sum to 1"),
        (lambda: Attached(ints(1), ONTO - 1, THIRDS, 1.0), "onto of row 0 names vertex 0 itself; name the"),
        (lambda: FabricDamping(1e9), "fabric damping: time is 1000000000.0 s; give 100000 s at most, a day, with"),
        (lambda: Pressure(1.0, "0"), r"pressure: panels is '0'; give a tuple of whole numbers, as \(0,\)"),
        (lambda: Elastic(LINE), r"elastic: lines is ElasticLine.*; give a tuple, as \(ElasticLine\(edges, ratio"),
        (lambda: Scene(GARMENT, X, effects=(Gravity,)), r"effects\[0\] is the class Gravity.*; give one as Gravity"),
        (lambda: Scene(GARMENT, FAR), "vertex 0 is 1e[+]09 m from the origin.*put garment and body within 16384"),
    ],
)
def test_what_is_refused_is_told_with_what_to_give(made, message):
    with pytest.raises(ValueError, match=message):
        made()


def test_a_scene_at_ten_kilometres_is_taken():
    """Where the hard case at_10km is: contact still holds there."""
    Scene(GARMENT, X + [10_000.0, 0.0, -10_000.0], effects=())


@pytest.mark.parametrize(
    ("effect", "field"),
    [
        (Sewing(np.array([[0, 999]], np.int32), 1.0), "sewing: stitches"),
        (Attached(np.array([999], np.int32), ONTO, THIRDS, 1.0), "attached: vertices"),
        (Attached(ints(1), ONTO + 997, THIRDS, 1.0), "attached: onto"),
        (Pins(np.array([999], np.int32)), "pins: vertices"),
        (Fasteners(np.array([[0, 999]], np.int32)), "fasteners: pairs"),
        (Adhesion(100.0, 0.05, np.array([999], np.int32)), "adhesion: vertices"),
        # Their keys, 0 * 16 + 999 and so on, are those of other edges.
        (Elastic((replace(LINE, edges=np.array([[0, 999], [0, 16 + 2]], np.int32)),)), "elastic: line 0: edges"),
        (Creases(np.array([[0, 999]], np.int32), np.ones(1)), "creases: edges"),
    ],
)
def test_a_vertex_that_there_is_not_is_refused_by_its_field_and_number(effect, field):
    with pytest.raises(ValueError, match=rf"^{field}: there is no vertex 99\d; use 0 to 15"):
        build(Scene(GARMENT, X, None, effects=(SelfContact(), effect)))


def test_an_edge_beyond_the_garment_is_not_taken_for_another_one():
    """1-6 is an edge of this sheet of 16, and 0-22 none: there is no vertex 22, though 0 x 16 + 22 = 1 x 16 + 6."""
    near, far = (np.array([edge], np.int32) for edge in ([1, 6], [0, 22]))
    for effect in (lambda edge: Elastic((ElasticLine(edge, 0.8, 20.0),)), lambda edge: Creases(edge, np.ones(1))):
        Scene(GARMENT, X, effects=(effect(near),))
        with pytest.raises(ValueError, match="there is no vertex 22; use 0 to 15"):
            Scene(GARMENT, X, effects=(effect(far),))


def of_numpy(value, number, integer):
    """The same of numpy's numbers and integers of these types, whatever is in it."""
    if isinstance(value, bool | str | Look | None):
        return value
    if isinstance(value, int):
        return integer(value)
    if isinstance(value, float):
        return number(value)
    if isinstance(value, tuple):
        return tuple(of_numpy(part, number, integer) for part in value)
    if isinstance(value, np.ndarray):
        return value.astype(integer if value.dtype.kind == "i" else number)
    inside = {field.name: of_numpy(getattr(value, field.name), number, integer) for field in fields(value)}
    return replace(value, **inside)


@pytest.mark.parametrize("integer", [np.int64, np.int32, np.int16, np.uint8, np.uint32], ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("number", [np.float64, np.float32, np.longdouble], ids=lambda kind: kind.__name__)
def test_numpys_numbers_and_integers_of_any_width_are_taken(number, integer):
    for kind, (_, valid, _) in REFUSED.items():
        if kind is not Scene:
            of_numpy(valid, number, integer)


def test_what_is_made_of_numpys_numbers_steps_as_what_is_made_of_pythons():
    """All effects that suit a sheet alone, in numbers that float32 holds exactly; whole numbers stand for floats."""
    held = np.array([0, 3], np.int32)
    effects = (
        Gravity((0.0, -8.0, 0.0)), SelfContact(), Friction(2.0**-13, np.full((2, 2), 0.5), np.full((2, 2), 0.25)),
        StrainLimit(16384.0), StretchCurves(((0.125, 32.0), (0.25, 96.0))), Wind((0.0, 0.0, 2.0), Gusts(0.25, 4.0, 1)),
        FabricDamping(2.0**-8), Sewing(np.array([[4, 8]], np.int32), 64.0), Pins(held, 1024.0), Pressure(2.0, (0,)),
        Attached(np.array([5], np.int32), np.array([[6, 9, 10]], np.int32), np.array([[0.5, 0.25, 0.25]]), 64.0),
        Fasteners(np.array([[12, 15]], np.int32), 64.0, 0.5), Elastic((ElasticLine(EDGES, 0.75, 16.0),)),
        Creases(np.array([[5, 6]], np.int32), np.array([0.5])), Adhesion(64.0, 2.0**-5, held, 32.0, 2.0**-13),
    )  # fmt: skip
    numpys = tuple(of_numpy(effect, np.float32, np.uint32) for effect in effects)
    ends = []
    for each in (effects, numpys):
        sim = build(Scene(GARMENT, X, None, fabric(), each))
        assert not sim.plan.idle
        for k in range(2):
            sim.advance(None, (k + 1) / 60)
        ends.append(sim.cloth_positions())
    assert np.abs(ends[0] - X).max() > 1e-4
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-6)


def test_nothing_to_do_is_told_with_what_is_missing():
    """No curve, and adhesion that has no strength or takes no work to part, whatever it may resist sideways."""
    for effect, why in (
        (StretchCurves(), "there is no curve: give points of warp or weft"),
        (Adhesion(100.0, 0.0), "nothing sticks at 100 Pa and 0 J/m^2: give more than 0 of both"),
        (Adhesion(0.0, 0.05, shear=50.0), "nothing sticks at 0 Pa and 0.05 J/m^2: give more than 0 of both"),
        (Adhesion(100.0, 0.05, ints(0)), "no vertex is sticky"),
    ):
        plan = build(Scene(GARMENT, X, effects=(SelfContact(), effect))).plan
        assert [said for _, said in plan.idle] == [why]
        assert "self_contact" in [contribution.name for contribution in plan.contributions]


def test_any_finite_quantity_is_taken_and_what_steps_can_not_follow_is_told():
    """1e6 Pa on a sheet of jersey, which is over a kilometre away after the first step, by the reports of two steps;
    nothing that is not a number comes of it."""
    sim = build(Scene(GARMENT, X, None, effects=(Pressure(1e6),)))
    told = False
    for k in range(2):
        report = sim.advance(None, (k + 1) / 60)
        assert np.isfinite(sim.cloth_positions()).all()
        told = told or report.max_stretch > 2.0 or report.retries > 0
    assert told
