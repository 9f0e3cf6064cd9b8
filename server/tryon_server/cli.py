"""The command ``tryon``: serve, devices, simulate, headset-sim."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import datetime
import logging
import os
import ssl
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from tryon_server.cli_help import (
    HEADSET_EXAMPLES,
    HEADSET_HELP,
    SERVE_EXAMPLES,
    SERVE_HELP,
    SIMULATE_EXAMPLES,
    SIMULATE_HELP,
)
from tryon_server.problems import ProblemError, problem_error

if TYPE_CHECKING:  # read when a command needs them: `tryon --help` starts at once
    from tryon_server.certificate import Certificate
    from tryon_server.sessions.commands import MotionReading
    from tryon_server.settings import Settings

BAD_INPUT = 2
UNITS = ("m", "cm", "mm", "in", "ft")
AXES = ("y", "z")
REST_SHAPES = ("pattern", "shape")
BODY_AXES = ("y", "z", "x")
FACINGS = ("x", "-x", "y", "-y", "z", "-z")
BVH_UNITS = ("m", "dm", "asf", "in", "ft", "cm", "mm")  # as the solver's UNITS of BVH files; asf: CMU's
FABRICS = (  # as the solver has them
    "cotton_jersey, cotton_poplin, wool_twill, denim, silk_charmeuse, viscose_jersey, polyester_satin, linen, "
    "silk_taffeta or cotton_canvas"
)
MOTIONS = "walk, jumping_jack, squat or turn"  # as demo/motions has them
PRESETS = "draft, live, fit, reference or auto"


FASTEST_POSES = 1000.0  # a second, of a simulated tracker: over ten times a headset's


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry of the command; its exit status: 0, or 2 for input that can't be used."""
    options = build_parser().parse_args(arguments)
    try:
        return options.run(options)
    except ProblemError as error:
        print(f"tryon: {error.problem.line()}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("tryon: stopped", file=sys.stderr)
        return 130


def build_parser() -> argparse.ArgumentParser:
    """The command's options."""
    parser = argparse.ArgumentParser(
        prog="tryon", description="Garment try-on over the network: penetration-free cloth on a moving body."
    )
    parser.add_argument("--version", action="version", version=f"tryon {version('tryon')}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    _add_serve(commands)
    _add_devices(commands)
    _add_simulate(commands)
    _add_headset_sim(commands)
    return parser


def _add_serve(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    serve = _command(commands, "serve", "start the server and its web page", SERVE_HELP, SERVE_EXAMPLES)
    serve.add_argument("--host", metavar="ADDRESS", help="address to listen on (default 127.0.0.1: this machine only)")
    serve.add_argument("--port", type=int, help="TCP port (default 8000)")
    serve.add_argument(
        "--tls",
        action="store_true",
        default=None,
        help="serve https, which AR needs, with a certificate for development made in DATA_DIR/tls",
    )
    serve.add_argument("--data-dir", metavar="FOLDER", help="where to keep uploads and the database (default var)")
    serve.add_argument("--device", help="what to simulate on: auto, cpu, cuda:0, ... (default auto); see tryon devices")
    serve.add_argument("--preset", help=f"accuracy of sessions that name none: {PRESETS} (default auto)")
    serve.set_defaults(run=run_serve)


def _add_devices(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    text = "List what this machine can simulate on, the best first. Give a name to --device."
    devices = _command(commands, "devices", "list what this machine can simulate on", text, "")
    devices.set_defaults(run=run_devices)


def _add_simulate(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    simulate = _command(commands, "simulate", "record a garment on a moving body", SIMULATE_HELP, SIMULATE_EXAMPLES)
    simulate.add_argument(
        "--garment",
        required=True,
        type=Path,
        metavar="FILE",
        help="sewing pattern (specification JSON of GarmentCode), or a mesh worn by the body (.obj, .glb)",
    )
    simulate.add_argument("--units", choices=UNITS, help="unit of the garment's mesh (default: found, and told)")
    simulate.add_argument("--up", choices=AXES, help="axis that is up in the garment's mesh (default: found, and told)")
    simulate.add_argument(
        "--rest-shape",
        choices=REST_SHAPES,
        help="what the garment's mesh rests in: its texture coordinates as its pattern, or the shape it comes in "
        "(default: found, and told)",
    )
    simulate.add_argument("--fabric", metavar="NAME", help=f"{FABRICS} (default the pattern's own, or else the first)")
    simulate.add_argument(
        "--size",
        type=_size,
        default=1.0,
        metavar="SIZE|fit",
        help="size of a sewing pattern over its own, 0.5 to 2 (default 1); fit: the one that fits the body, by trying",
    )
    simulate.add_argument(
        "--edge-length", type=_positive, metavar="METRES", help="of a sewing pattern's mesh (default the preset's)"
    )
    simulate.add_argument(
        "--body",
        default="default",
        metavar="default|FILE|FOLDER",
        help="body: the default one; a .npz made by scripts/make_body.py, or a folder with its body.npz; a moving mesh "
        "(a folder or .zip of .obj frames, an .npz with vertices (frames x V x 3), faces and fps or dt, or an animated "
        ".glb); "
        "or a mesh (.obj, .ply, .stl, .glb), which stands still: closed, in metres, Y up, or a human's as it comes",
    )
    simulate.add_argument("--body-units", choices=UNITS, help="unit of a body's mesh (default: found, and told)")
    simulate.add_argument("--body-up", choices=BODY_AXES, help="axis that is up in it (default: found, and told)")
    simulate.add_argument(
        "--body-facing",
        choices=FACINGS,
        help="axis that it faces along in its file, --body-facing=-y for one below 0 (default: found, and told)",
    )
    simulate.add_argument("--body-fps", type=_positive, metavar="FPS", help="frames a second (default: told, or 30)")
    simulate.add_argument(
        "--body-animation", metavar="NAME", help="which animation of a .glb with several (default the first, told)"
    )
    simulate.add_argument(
        "--motion",
        metavar="FILE.bvh|NAME",
        help=f"BVH file, or a motion that comes with tryon: {MOTIONS} (default: the body stands still)",
    )
    _add_motion_reading(simulate)
    simulate.add_argument(
        "--seconds", type=_positive, metavar="S", help="how long to record (default the motion's length; it repeats)"
    )
    simulate.add_argument("--fps", type=_positive, default=60.0, help="frames per second (default 60)")
    simulate.add_argument("--device", default="auto", metavar="cpu|cuda:0", help="what to simulate on (default auto)")
    simulate.add_argument("--preset", default="auto", help=f"accuracy: {PRESETS}, by the device (default auto)")
    simulate.add_argument("--out", required=True, type=Path, metavar="OUT", help="file to write: .npz, or .glb")
    simulate.add_argument("--glb", type=Path, metavar="FILE", help="write the last frame as a .glb scene, too")
    simulate.add_argument("--dye", metavar="RRGGBB", help="colour in a .glb (default the fabric's own)")
    simulate.add_argument("--print", type=Path, metavar="FILE", help="picture over the cloth in a .glb: .png or .jpg")
    simulate.add_argument("--print-width", type=_positive, metavar="METRES", help="of it on the cloth")
    simulate.set_defaults(run=run_simulate)


def _add_headset_sim(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    text = "stream a simulated tracker's poses and measure the frames' age"
    headset = _command(commands, "headset-sim", text, HEADSET_HELP, HEADSET_EXAMPLES)
    headset.add_argument("--server", default="http://127.0.0.1:8000", metavar="URL", help="server to open a session on")
    headset.add_argument("--url", metavar="URL", help="stream of a session that is open already, instead")
    headset.add_argument("--authority", type=Path, metavar="FILE", help="certificate to trust, of tryon serve --tls")
    headset.add_argument("--garment", default="tshirt", metavar="ID", help="garment of the session (default tshirt)")
    headset.add_argument("--preset", help=f"accuracy of the session: {PRESETS} (default the server's)")
    headset.add_argument(
        "--motion", default="walk", metavar="FILE.bvh|NAME", help=f"what the wearer does: {MOTIONS} (default walk)"
    )
    _add_motion_reading(headset)
    headset.add_argument("--seconds", type=_positive, default=10.0, metavar="S", help="how long (default 10)")
    headset.add_argument(
        "--convention",
        choices=("webxr", "model-local"),
        default="webxr",
        help="joints of WebXR body tracking, which the server retargets and filters (default), or of its own body",
    )
    headset.add_argument("--rate", type=_pose_rate, default=72.0, metavar="HZ", help="poses a second (default 72)")
    for option, default, what in (
        ("--latency-ms", 45.0, "from a pose's capture to its sending"),
        ("--noise-mm", 3.0, "of each joint's place, standard deviation along each axis"),
        ("--noise-deg", 0.5, "of each joint's turn, standard deviation about each axis"),
        ("--noise-ms", 0.0, "how long an error lasts; 0: another one in each pose"),
        ("--lost-percent", 1.0, "share of poses that never arrive"),
        ("--outages-per-minute", 3.0, "times a minute at which nothing is seen"),
        ("--outage-ms", 200.0, "for how long"),
    ):
        unit = option.rpartition("-")[2].upper()
        headset.add_argument(
            option,
            type=_percent if unit == "PERCENT" else _not_negative,
            default=default,
            metavar=unit,
            help=f"{what} (default {default:g})",
        )
    headset.add_argument("--seed", type=int, default=0, help="of the random numbers (default 0)")
    headset.set_defaults(run=run_headset_sim)


def _add_motion_reading(command: argparse.ArgumentParser) -> None:
    """What tells of a BVH file what it doesn't tell itself."""
    command.add_argument(
        "--motion-units", choices=BVH_UNITS, help="unit of a BVH file's lengths (default: found, and told)"
    )
    command.add_argument(
        "--motion-up",
        choices=FACINGS,
        help="axis that is up in a BVH file, --motion-up=-y for one below 0 (default: found by the poses, and told)",
    )
    command.add_argument(
        "--motion-joint",
        action="append",
        metavar="PART=NAME",
        help="which joint of a BVH file is a part of the body, where names don't tell: pelvis, head, or, with left_ or "
        "right_ before it, upper_arm, forearm, hand, thigh, shin, foot, toes; once for each",
    )
    command.add_argument(
        "--motion-facing",
        choices=FACINGS,
        help="axis of its file that the person faces along in a BVH's first frame (default: found by knees and toes)",
    )


def _command(
    commands: argparse._SubParsersAction[argparse.ArgumentParser], name: str, short: str, text: str, examples: str
) -> argparse.ArgumentParser:
    return commands.add_parser(
        name, help=short, description=text, epilog=examples, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def _size(text: str) -> float | None:
    return None if text == "fit" else _positive(text)


def _not_negative(text: str) -> float:
    value = float(text)
    if not 0 <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a number of 0 or more")
    return value


def _percent(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 100:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 0 to 100")
    return value


def _pose_rate(text: str) -> float:
    value = float(text)
    if not 1 <= value <= FASTEST_POSES:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 1 to {FASTEST_POSES:g}")
    return value


def run_serve(options: argparse.Namespace) -> int:
    """Serve until stopped."""
    from tryon_server.settings import read_settings

    settings = read_settings(
        os.environ,
        host=options.host,
        port=options.port,
        tls=options.tls,
        data_dir=options.data_dir,
        device=options.device,
        preset=options.preset,
    )
    logging.basicConfig(level=logging.WARNING, format="%(asctime)s %(message)s", datefmt="%H:%M:%S")
    logging.getLogger("tryon_server").setLevel(logging.INFO)
    print(f"tryon {version('tryon')} is starting ...", flush=True)

    from tryon_server.runtime import fork_server

    fork_server.started()  # its imports take as long as those that follow, and a session begins sooner
    from tryon_server.app import create_app, prepare
    from tryon_server.runtime.local import local_runtime
    from tryon_server.streaming.server import Server, listen

    listener = listen(settings.host, settings.port)
    runtime = local_runtime(settings)
    prepare(settings)
    certificate = _certificate(settings)
    scheme = "https" if certificate else "http"
    address = address_of(settings.host, listener.getsockname()[1], scheme)
    app = create_app(settings, lambda _: runtime)
    server = Server(
        app,
        on_start=lambda: print(f"Open {address} in a browser. Ctrl-C stops the server.", flush=True),
        certificate=certificate,
    )
    try:
        asyncio.run(server.serve([listener]))
    except KeyboardInterrupt:  # the way to stop it
        print("tryon: stopped", flush=True)
    return 0 if server.started else 1


def _certificate(settings: Settings) -> Certificate | None:
    """The certificate of a server of https, and what to know about it in print; None for one of http."""
    if not settings.tls:
        return None
    from tryon_server.certificate import development_certificate, names_of

    names = names_of(settings.host)
    made = development_certificate(settings.data_dir / "tls", names, datetime.datetime.now(datetime.timezone.utc))
    print(
        f"The certificate is for {', '.join(names)}. Browsers warn of it until they trust {made.authority}", flush=True
    )
    return made


def address_of(host: str, port: int, scheme: str = "http") -> str:
    """The URL to open in a browser on this machine, for a server that listens on ``host``."""
    shown = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(host, f"[{host}]" if ":" in host else host)
    return f"{scheme}://{shown}:{port}/"


def run_devices(_options: argparse.Namespace) -> int:
    """Print a table."""
    from tryon_server.runtime.devices import list_devices

    for device in list_devices():
        memory = f"{device.memory / 2**30:.0f} GiB" if device.memory else "memory not told"
        print(f"{device.name:<8} {device.description}, {memory}")
    return 0


def run_simulate(options: argparse.Namespace) -> int:
    """Simulate and write the files."""
    for path in filter(None, (options.out, options.glb)):
        _check_writable(path)

    from tryon_server.looks.told import told_finish
    from tryon_server.progress_bar import ProgressBar
    from tryon_server.runtime.local import load_catalogue
    from tryon_server.runtime.offline import simulate
    from tryon_server.runtime.order import DrapeOrder, MeshReading
    from tryon_server.runtime.production import own_fabric

    finish = told_finish(options.dye, options.print, options.print_width)
    order = DrapeOrder(
        pattern=options.garment,
        fabric=options.fabric or own_fabric(options.garment) or load_catalogue().fabrics[0].name,
        preset=options.preset,
        device=options.device,
        edge_length=options.edge_length,
        body=None if options.body == "default" else Path(options.body),
        reading=MeshReading(options.units, options.up, rest_shape=options.rest_shape),
        body_reading=MeshReading(
            options.body_units, options.body_up, options.body_fps, options.body_animation, options.body_facing
        ),
        size=options.size,
    )
    with ProgressBar() as bar:
        recording = simulate(
            order,
            options.motion,
            options.seconds,
            options.fps,
            bar.show,
            motion_reading=_motion_reading(options),
            finish=finish,
        )
    for note in recording.notes:
        print(note)
    paths = list(dict.fromkeys(filter(None, (options.out, options.glb))))
    for path in paths:
        if path == options.glb or path.suffix.lower() == ".glb":
            recording.save_glb(path)
        else:
            recording.save(path)
    for line in recording.advice():
        print(line)
    written = " and ".join(map(str, paths))
    print(f"wrote {written}: {len(recording.cloth)} frames, {recording.cloth.shape[1]} vertices")
    return 0


def _motion_reading(options: argparse.Namespace) -> MotionReading:
    """What `_add_motion_reading` was told."""
    from tryon_server.sessions.commands import MotionReading
    from tryon_server.wording import joints_told

    joints = joints_told(options.motion_joint, "--motion-joint")
    return MotionReading(options.motion_units, options.motion_up, options.motion_facing, joints)


def run_headset_sim(options: argparse.Namespace) -> int:
    """Replay a motion as a tracker sees it, and print the ages."""
    import math

    import numpy as np
    import websockets

    from tryon_client.headset_sim import RefusedError, replay, session
    from tryon_client.simulated_tracker import TrackerErrors
    from tryon_protocol import ProtocolError
    from tryon_server.runtime.bodies import load_body
    from tryon_server.runtime.motions import closing_note, read_motion

    errors = TrackerErrors(
        rate=options.rate,
        latency=1e-3 * options.latency_ms,
        place_noise=1e-3 * options.noise_mm,
        turn_noise=math.radians(options.noise_deg),
        noise_seconds=1e-3 * options.noise_ms,
        lost=0.01 * options.lost_percent,
        outages=options.outages_per_minute / 60.0,
        outage_seconds=1e-3 * options.outage_ms,
        seed=options.seed,
    )
    motion, facts = read_motion(options.motion, load_body(None), _motion_reading(options))
    repeats = options.seconds > motion.duration
    for note in (*facts.notes, *filter(None, [closing_note(motion) if repeats else ""])):
        print(f"motion: {note}", flush=True)
    poses = [motion.sample(k / errors.rate, loop=True) for k in range(max(2, round(options.seconds * errors.rate)))]
    roots, rotations = np.array([pose.root for pose in poses]), np.array([pose.rotations for pose in poses])
    trust = _trusted(options.authority)
    try:
        opened = contextlib.nullcontext(options.url)
        with opened if options.url else session(options.server, options.garment, options.preset, trust) as url:
            print(f"{options.motion} at {errors.rate:g} Hz for {options.seconds:g} s into {url}", flush=True)
            outcome = asyncio.run(replay(url, roots, rotations, errors, options.convention, trust))
    except (RefusedError, ProtocolError, OSError, ValueError, websockets.WebSocketException) as error:
        raise problem_error("headset.failed", str(error), "See whether the server runs, and its log") from error
    print(outcome.text())
    return 0 if outcome.ages.count else 1


def _trusted(authority: Path | None) -> ssl.SSLContext | None:
    """What to trust besides: the certificate in that file. Raises ProblemError where there is none."""
    if authority is None:
        return None
    try:
        return ssl.create_default_context(cafile=authority)
    except OSError as error:  # SSLError, of a file that holds no certificate, is one
        what = f"--authority {authority} holds no certificate that can be read ({error.strerror or error})"
        remedy = "Give the authority.pem that `tryon serve --tls` names"
        raise problem_error("headset.authority", what, remedy) from error


def _check_writable(path: Path) -> None:
    """Find out before the simulation, not after it, that a file can't be written."""
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise problem_error(
            "output.unwritable", f"{path} can't be written", "Name a file in a folder that exists", place="--out"
        )
    if path.suffix.lower() not in (".npz", ".glb"):
        raise problem_error(
            "output.format", f"{path} is neither .npz nor .glb", "Choose one of these endings", place="--out"
        )


if __name__ == "__main__":
    sys.exit(main())
