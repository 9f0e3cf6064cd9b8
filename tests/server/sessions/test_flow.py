"""Frames: credit, drop before encode, and that whatever happens every client can decode all that it gets."""

from collections import deque

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from session_driver import Driver

from tryon_protocol import BodySurface, FrameDecoder, FrameEncoder, KeyframeRequestMessage, Topology
from tryon_server.sessions.commands import AllowFrame
from tryon_server.sessions.events import FrameReady, PhaseChanged, TopologyReady

VERTICES = 5


def topology(number: int) -> Topology:
    body = BodySurface(
        rest_vertices=np.zeros((3, 3), np.float32),
        faces=np.array([[0, 1, 2]], np.uint32),
        joint_names=("hips",),
        parents=np.array([-1], np.int32),
        rest_joints=np.zeros((1, 3), np.float32),
        skin_joints=np.zeros((3, 1), np.uint16),
        skin_weights=np.ones((3, 1), np.float32),
    )
    faces = np.array([[0, 1, 2], [2, 3, 4]], np.uint32)
    return Topology(topology_id=number, cloth_vertex_count=VERTICES, faces=faces, body=body)


class Simulated:
    """Publishes as a simulation does: only when allowed, and a state once unless somebody lacks it."""

    def __init__(self, driver: Driver) -> None:
        self.driver = driver
        self.topology_id = 1
        self.encoder = FrameEncoder(topology(1), keyframe_interval=20.0)
        self.state = 0
        self.fresh = True
        self.handed_over = 0
        self.told = self.topology_ready()

    def topology_ready(self) -> Topology:
        self.driver.simulation(TopologyReady(self.topology_id, b"topology", b"plain", ("hips",)))
        self.driver.simulation(PhaseChanged("ready", "Dressed"))
        return self.encoder.topology

    def dress_anew(self) -> None:
        self.topology_id += 1
        self.encoder.set_topology(topology(self.topology_id))
        self.fresh = True
        self.topology_ready()

    def solve(self) -> None:
        self.state += 1
        self.fresh = True

    def cloth(self) -> np.ndarray:
        return np.outer(np.arange(VERTICES), [0.01, 0.02, 0.03]) + self.state**1.5 / 1000

    def publish(self) -> bool:
        allowed = self.driver.ordered(AllowFrame)[-1] if self.driver.ordered(AllowFrame) else None
        if allowed is None or self.handed_over >= allowed.total or not (self.fresh or allowed.again):
            return False
        if allowed.keyframe:
            self.encoder.request_keyframe()
        identity = np.array([[0.0, 0.0, 0.0, 1.0]])
        shared = self.encoder.encode(
            self.cloth(), np.zeros((3, 3)), np.zeros(3), identity, t_sim=0.1 * self.state, t_published=0.1 * self.state
        )
        self.handed_over += 1
        self.fresh = False
        self.driver.simulation(
            FrameReady(
                self.topology_id,
                shared,
                self.encoder.standalone() if allowed.standalone else None,
                self.encoder.standalone(compressed=False) if allowed.plain else None,
            )
        )
        return True


class Client:
    """Decodes at its own pace, and acknowledges what it has decoded."""

    def __init__(self, simulated: Simulated, number: int, plain: bool) -> None:
        self.simulated, self.driver, self.number = simulated, simulated.driver, number
        self.decoder = FrameDecoder()
        self.topology_id = 0
        self.in_flight: deque[bytes] = deque()
        self.taken = 0
        self.acknowledged = 0
        self.newest = -1.0
        self.driver.connect(number, codecs=() if plain else ("zstd",))

    def fetch(self) -> None:
        arrived = self.driver.frames[self.number][self.taken :]
        self.taken += len(arrived)
        self.in_flight.extend(arrived)
        assert len(self.in_flight) <= 2

    def lose(self) -> None:
        """Something went wrong in the client: what is on its way can't be decoded any more."""
        self.fetch()
        self.in_flight.clear()
        self.decoder, self.topology_id = FrameDecoder(), 0
        self.driver.say(self.number, KeyframeRequestMessage())

    def decode_one(self) -> None:
        self.fetch()
        if not self.in_flight:
            return
        data = self.in_flight.popleft()
        number = int.from_bytes(data[4:8], "little")
        if number != self.topology_id:
            self.topology_id = number
            self.decoder.set_topology(topology(number))
        frame = self.decoder.decode(data)
        self.newest = round(frame.t_sim / 0.1)
        expected = np.outer(np.arange(VERTICES), [0.01, 0.02, 0.03]) + self.newest**1.5 / 1000
        np.testing.assert_allclose(frame.cloth, expected, atol=1 / 16000)
        self.driver.ack(self.number, frame.seq)


def test_single_slow_client_gets_an_unbroken_chain_of_differences():
    driver = Driver()
    simulated = Simulated(driver)
    client = Client(simulated, 1, plain=False)
    for _ in range(40):
        for _ in range(3):  # three states are solved while one frame travels
            simulated.solve()
            simulated.publish()
        client.decode_one()
    codecs = [frame[2] for frame in driver.frames[1]]
    assert codecs[0] == 1
    assert codecs[1] == 2
    assert set(codecs[2:]) == {3}
    assert simulated.handed_over == len(driver.frames[1]) == 41


def test_nothing_is_encoded_without_credit():
    driver = Driver()
    simulated = Simulated(driver)
    Client(simulated, 1, plain=False)
    published = []
    for _ in range(10):
        simulated.solve()
        published.append(simulated.publish())
    assert published == [True, True] + [False] * 8


def test_nothing_is_encoded_without_clients():
    driver = Driver()
    simulated = Simulated(driver)
    assert not simulated.publish()
    client = Client(simulated, 1, plain=False)
    assert simulated.publish()
    client.decode_one()
    driver.leave(1)
    simulated.solve()
    simulated.publish()  # it had been allowed before the client left
    simulated.solve()
    assert not simulated.publish()


def test_slow_client_does_not_slow_a_quick_one():
    driver = Driver()
    simulated = Simulated(driver)
    quick, slow = Client(simulated, 1, plain=False), Client(simulated, 2, plain=False)
    for step in range(100):
        simulated.solve()
        assert simulated.publish()
        quick.decode_one()
        if step % 10 == 0:
            slow.decode_one()
        driver.now += 0.1
    assert quick.newest == 100
    assert len(driver.frames[1]) == 100
    assert len(driver.frames[2]) == 12
    assert {frame[2] for frame in driver.frames[1][2:]} >= {3}


def test_client_that_joins_while_the_simulation_holds_still_gets_the_state_as_it_stands():
    driver = Driver()
    simulated = Simulated(driver)
    first = Client(simulated, 1, plain=False)
    simulated.solve()
    simulated.publish()
    first.decode_one()
    assert not simulated.publish()
    second = Client(simulated, 2, plain=False)
    assert simulated.publish()
    second.decode_one()
    assert second.newest == 1
    first.decode_one()
    assert not simulated.publish(), "a state that everybody has is not published for ever"


def test_requested_keyframe_stands_alone():
    driver = Driver()
    simulated = Simulated(driver)
    client = Client(simulated, 1, plain=False)
    for _ in range(4):
        simulated.solve()
        simulated.publish()
        client.decode_one()
    assert driver.frames[1][-1][2] == 3
    driver.say(1, KeyframeRequestMessage())
    assert simulated.publish()
    assert driver.frames[1][-1][2] == 1


def test_acknowledging_a_frame_that_was_never_sent_is_an_error():
    driver = Driver()
    simulated = Simulated(driver)
    Client(simulated, 1, plain=False)
    simulated.publish()
    driver.ack(1, 7)
    assert driver.errors(1) == ["invalid_ack"]


STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("solve"), st.integers(1, 3)),
        st.tuples(st.just("decode"), st.integers(0, 2)),
        st.tuples(st.just("join"), st.booleans()),
        st.tuples(st.just("leave"), st.integers(0, 2)),
        st.tuples(st.just("lost"), st.integers(0, 2)),
        st.tuples(st.just("dress"), st.none()),
        st.tuples(st.just("hold"), st.none()),
    ),
    max_size=80,
)


@given(STEPS)
@settings(max_examples=150)
def test_every_client_decodes_all_it_gets_and_ends_with_the_newest_state(steps):
    driver = Driver()
    simulated = Simulated(driver)
    clients: list[Client] = []
    joined = 0
    for what, value in steps:
        match what:
            case "solve":
                for _ in range(value):
                    simulated.solve()
                    simulated.publish()
            case "decode" if value < len(clients):
                clients[value].decode_one()
            case "join" if len(clients) < 3:
                joined += 1
                clients.append(Client(simulated, joined, plain=value))
            case "leave" if value < len(clients):
                driver.leave(clients.pop(value).number)
            case "lost" if value < len(clients):
                clients[value].lose()
            case "dress":
                simulated.dress_anew()
            case "hold":
                simulated.publish()
        driver.now += 0.5
    for _ in range(12):
        simulated.publish()
        for client in clients:
            client.decode_one()
    assert all(client.newest == simulated.state for client in clients)
    assert not simulated.publish()
    assert not any(errors for number in range(joined + 1) if (errors := driver.errors(number)))
