"""Live sessions on the network: websockets, outgoing buffers, and the event loop around the session machines."""
