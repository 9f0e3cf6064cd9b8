"""The fabric of a garment without a pattern, as the session tells it."""

from session_driver import Driver

from tryon_protocol import SetFabricMessage, StatusMessage
from tryon_server.sessions.commands import WearFabric
from tryon_server.sessions.events import FabricWorn


def test_a_fabric_that_a_mesh_can_not_be_dressed_of_is_told_no_longer():
    driver = Driver()
    driver.connect(1)
    driver.dressed()
    driver.say(1, SetFabricMessage(fabric="denim"))
    assert driver.ordered(WearFabric) == [WearFabric("denim")]
    assert driver.session.fabric == "denim"
    driver.simulation(FabricWorn("cotton"))
    assert driver.session.fabric == "cotton"
    told = [message for message in driver.sent[1] if isinstance(message, StatusMessage)]
    assert told[-1].fabric == "cotton"
