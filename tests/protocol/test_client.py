"""The Python client against a small server of its own, on a real socket."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator, Awaitable, Callable

import msgpack
import numpy as np
import pytest
import websockets
from websockets.asyncio.server import ServerConnection, serve

from tryon_client import Recording, connect, record
from tryon_client.__main__ import main
from tryon_protocol import (
    GRID,
    SUBPROTOCOL,
    AckMessage,
    ClientMessage,
    DecodedFrame,
    ErrorMessage,
    FrameEncoder,
    GoodbyeMessage,
    HelloMessage,
    KeyframeRequestMessage,
    PingMessage,
    PlayMessage,
    PongMessage,
    PoseMessage,
    ProtocolError,
    SetMotionMessage,
    StatusMessage,
    Topology,
    ViewerWindow,
    WelcomeMessage,
    decode_client,
    encode,
    validate_pose,
)
from tryon_protocol.vector_content import topology as golden_topology

WELCOME = WelcomeMessage(
    version=1,
    session="s",
    epoch="e",
    server="test",
    clock=0.0,
    credit=2,
    topology_id=1,
    subjects=("wearer",),
    motions=("walk",),
    fabrics=("cotton",),
    resume_token="again",
)
STATUS = StatusMessage(state="running", detail="", motion="walk", fabric="cotton", playing=True)
Script = Callable[[ServerConnection], Awaitable[None]]


@contextlib.asynccontextmanager
async def serving(script: Script) -> AsyncIterator[str]:
    """Run one script per connection; its failure fails the test."""
    failures: list[BaseException] = []

    async def handle(connection: ServerConnection) -> None:
        try:
            await script(connection)
        except websockets.ConnectionClosed:
            pass
        except BaseException as exc:
            failures.append(exc)
            raise

    async with serve(handle, "127.0.0.1", 0, subprotocols=[websockets.Subprotocol(SUBPROTOCOL)]) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        yield f"ws://127.0.0.1:{port}"
    assert failures == []


async def take(connection: ServerConnection) -> ClientMessage:
    data = await connection.recv()
    assert isinstance(data, bytes)
    return decode_client(data)


async def greet(connection: ServerConnection, topology: Topology | None = None) -> HelloMessage:
    hello = await take(connection)
    assert isinstance(hello, HelloMessage)
    await connection.send(encode(WELCOME))
    await connection.send(encode(STATUS))
    if topology is not None:
        await connection.send(encode(topology.to_message()))
    return hello


@pytest.fixture
def streaming(topology, make_state):
    """streaming(count): a script that sends so many frames as credit allows, then says goodbye."""

    def with_count(count: int) -> Script:
        async def script(connection: ServerConnection) -> None:
            await greet(connection, topology)
            encoder, window = FrameEncoder(topology), ViewerWindow()
            for step in range(count):
                while not window.may_send:
                    message = await take(connection)
                    assert isinstance(message, AckMessage)
                    window.acknowledge(message.seq)
                frame = make_state(step).encode(encoder, step / 64)
                window.sent(frame)
                await connection.send(frame.data)
            await connection.send(encode(GoodbyeMessage(reason="that was all")))

        return script

    return with_count


def test_frames_arrive_decoded_and_are_acknowledged(topology, make_state, streaming) -> None:
    async def run() -> None:
        async with serving(streaming(9)) as url, connect(url) as stream:
            assert stream.welcome == WELCOME
            frames = [frame async for frame in stream.frames()]
        assert [frame.seq for frame in frames] == list(range(1, 10))
        for step, frame in enumerate(frames):
            state = make_state(step)
            assert np.abs(frame.cloth - state.cloth).max() <= GRID / 2 + 1e-9
            assert np.abs(frame.body - state.body).max() <= GRID / 2 + 1e-9
        assert stream.topology is not None
        assert stream.topology.cloth_vertex_count == topology.cloth_vertex_count
        assert stream.status == STATUS
        assert stream.goodbye is not None
        assert stream.goodbye.reason == "that was all"

    asyncio.run(run())


def test_poses_pass_validation_and_are_counted(topology) -> None:
    received: list[PoseMessage] = []

    async def script(connection: ServerConnection) -> None:
        await greet(connection)
        for _ in range(2):
            message = await take(connection)
            assert isinstance(message, PoseMessage)
            validate_pose(message, topology.body.joint_names, WELCOME.subjects)
            received.append(message)
        await connection.send(encode(GoodbyeMessage(reason="")))

    async def run() -> None:
        async with serving(script) as url, connect(url) as stream:
            rotations = np.tile([0.0, 0.0, 0.0, 1.0], (5, 1))
            assert await stream.send_pose(np.array([1.0, 2.0, 3.0]), rotations, 10.5) == 1
            assert await stream.send_pose((1.0, 2.0, 4.0), rotations, 10.6, subject="wearer") == 2
            async for _ in stream:
                pass

    asyncio.run(run())
    assert [(pose.seq, pose.t, pose.root) for pose in received] == [(1, 10.5, (1, 2, 3)), (2, 10.6, (1, 2, 4))]


def test_a_lost_base_is_asked_for_once_and_frames_go_on(topology, make_state) -> None:
    asked: list[ClientMessage] = []

    async def script(connection: ServerConnection) -> None:
        await greet(connection, topology)
        encoder = FrameEncoder(topology)
        frames = [make_state(step).encode(encoder, step / 64) for step in range(5)]
        for frame in (frames[0], frames[2], frames[3]):  # frame 2 is lost
            await connection.send(frame.data)
        asked.extend([await take(connection), await take(connection)])
        await connection.send(encoder.standalone().data)
        asked.append(await take(connection))
        await connection.send(encode(GoodbyeMessage(reason="")))

    async def run() -> None:
        async with serving(script) as url, connect(url) as stream:
            assert [frame.seq async for frame in stream.frames()] == [1, 5]

    asyncio.run(run())
    assert asked == [AckMessage(seq=1), KeyframeRequestMessage(reason="missing_base"), AckMessage(seq=5)]


def test_events_carry_what_is_no_frame_and_unknown_types_are_ignored() -> None:
    fault = ErrorMessage(code="unknown_motion", place="$.motion", message="m", remedy="r", request=7)

    async def script(connection: ServerConnection) -> None:
        await greet(connection)
        assert await take(connection) == SetMotionMessage(motion="fly", request=7)
        assert await take(connection) == PingMessage(t=5.0)
        await connection.send(msgpack.packb({"type": "fireworks", "colour": "red"}))
        await connection.send(encode(fault))
        await connection.send(encode(PongMessage(t=5.0, clock=9.0)))
        await connection.send(encode(GoodbyeMessage(reason="")))

    async def run() -> None:
        async with serving(script) as url, connect(url) as stream:
            await stream.send(SetMotionMessage(motion="fly", request=7))
            await stream.send(PingMessage(t=5.0))
            events = [event async for event in stream]
            assert events == [STATUS, fault, PongMessage(t=5.0, clock=9.0), GoodbyeMessage(reason="")]
            assert stream.errors == [fault]

    asyncio.run(run())


@pytest.mark.parametrize("after_welcome", [False, True])
def test_a_fatal_error_is_raised_with_its_code(after_welcome: bool) -> None:
    async def script(connection: ServerConnection) -> None:
        if after_welcome:
            await greet(connection)
        await connection.send(
            encode(ErrorMessage(code="unsupported_version", place="$.versions", message="m", remedy="r", fatal=True))
        )
        await connection.close(4400)

    async def run() -> None:
        async with serving(script) as url, connect(url) as stream:
            async for _ in stream:
                pass

    with pytest.raises(ProtocolError) as caught:
        asyncio.run(run())
    assert (caught.value.code, caught.value.remedy) == ("unsupported_version", "r")


@pytest.mark.parametrize("nonsense", [b"\xff\xff", b"\xc1\x01", b"\x81\xa1x", "text", msgpack.packb({"type": "pong"})])
def test_nonsense_from_a_server_is_a_protocol_error(nonsense: bytes | str) -> None:
    async def script(connection: ServerConnection) -> None:
        await greet(connection)
        await connection.send(nonsense)
        await connection.wait_closed()

    async def run() -> None:
        async with serving(script) as url, connect(url) as stream:
            async for _ in stream:
                pass

    with pytest.raises(ProtocolError):
        asyncio.run(run())


def test_a_broken_connection_is_an_error_not_an_end() -> None:
    async def script(connection: ServerConnection) -> None:
        await greet(connection)
        await connection.close(1011)

    async def run() -> None:
        async with serving(script) as url, connect(url) as stream:
            async for _ in stream:
                pass

    with pytest.raises(websockets.ConnectionClosedError):
        asyncio.run(run())


def test_a_recording_holds_what_the_judge_reads(tmp_path, topology, make_state, streaming) -> None:
    seen: list[DecodedFrame] = []

    async def run() -> Recording:
        async with serving(streaming(9)) as url, connect(url) as stream:
            return await record(stream, frame_count=4, progress=seen.append)

    recording = asyncio.run(run())
    recording.save(tmp_path / "frames.npz")
    with np.load(tmp_path / "frames.npz") as saved:
        arrays = dict(saved)
    assert arrays["cloth"].shape == (4, topology.cloth_vertex_count, 3)
    assert arrays["body"].shape == (4, len(topology.body.rest_vertices), 3)
    np.testing.assert_array_equal(arrays["cloth_faces"], topology.faces)
    np.testing.assert_array_equal(arrays["body_faces"], topology.body.faces)
    np.testing.assert_array_equal(arrays["t"], np.arange(4) / 64)
    np.testing.assert_array_equal(arrays["seq"], [1, 2, 3, 4])
    np.testing.assert_array_equal(arrays["cloth"], [frame.cloth for frame in seen])
    np.testing.assert_array_equal(arrays["body"], [frame.body for frame in seen])
    assert np.abs(arrays["body"][2] - make_state(2).body).max() <= GRID / 2 + 1e-9


def test_a_recording_can_end_by_the_clock(streaming) -> None:
    times = iter(range(100))

    async def run() -> Recording:
        async with serving(streaming(9)) as url, connect(url) as stream:
            return await record(stream, seconds=3.0, clock=lambda: float(next(times)))

    assert len(asyncio.run(run()).frames) == 3


def test_a_recording_without_end_or_frames_is_an_error(topology, tmp_path, streaming) -> None:
    async def run(count: int, limit: int | None) -> None:
        async with serving(streaming(count)) as url, connect(url) as stream:
            await record(stream, frame_count=limit)

    with pytest.raises(ValueError, match="needs an end"):
        asyncio.run(run(1, None))
    with pytest.raises(ValueError, match="that was all"):
        asyncio.run(run(0, 5))
    with pytest.raises(ValueError, match="no frame"):
        Recording(topology).save(tmp_path / "none.npz")


def test_a_recording_refuses_frames_of_another_topology(make_state) -> None:
    other = golden_topology(2)

    async def script(connection: ServerConnection) -> None:
        await greet(connection, golden_topology(1))
        encoder = FrameEncoder(golden_topology(1))
        await connection.send(make_state(0).encode(encoder, 0.0).data)
        encoder.set_topology(other)
        await connection.send(encode(other.to_message()))
        await connection.send(make_state(1).encode(encoder, 0.1).data)
        await connection.wait_closed()

    async def run() -> None:
        async with serving(script) as url, connect(url) as stream:
            await record(stream, frame_count=3)

    with pytest.raises(ProtocolError, match="begin another") as caught:
        asyncio.run(run())
    assert caught.value.code == "unknown_topology"


def test_the_command_line_records_and_reports_errors(tmp_path, topology, make_state, capsys) -> None:
    """The server accepts the motion "walk" and refuses "fly", as a session would."""

    async def script(connection: ServerConnection) -> None:
        await greet(connection, topology)
        motion = await take(connection)
        assert isinstance(motion, SetMotionMessage)
        assert await take(connection) == PlayMessage()
        if motion.motion != "walk":
            await connection.send(
                encode(ErrorMessage(code="unknown_motion", place="$.motion", message="m", remedy="r"))
            )
        encoder = FrameEncoder(topology)
        for step in range(2):
            await connection.send(make_state(step).encode(encoder, step / 64).data)
        await connection.wait_closed()

    async def run(motion: str) -> int:
        async with serving(script) as url:
            arguments = [url, "--frames", "2", "--motion", motion, "--out", str(tmp_path / f"{motion}.npz")]
            return await asyncio.to_thread(main, arguments)

    assert asyncio.run(run("walk")) == 0
    assert "2 frames of topology 1" in capsys.readouterr().out
    assert (tmp_path / "walk.npz").exists()
    assert asyncio.run(run("fly")) == 1
    assert "$.motion" in capsys.readouterr().err
    assert not (tmp_path / "fly.npz").exists()


def test_the_command_line_says_when_nobody_listens(tmp_path, capsys) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
        assert main([f"ws://127.0.0.1:{port}", "--out", str(tmp_path / "x.npz")]) == 1
    assert capsys.readouterr().err.startswith("error: ")
