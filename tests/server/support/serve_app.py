"""A server's process for tests that kill it: `serve_app.py FOLDER PORT MODULE:FUNCTION PATH...`, where the function
makes the application of that folder."""

import asyncio
import sys
from importlib import import_module
from pathlib import Path

if __name__ == "__main__":
    sys.path[:0] = sys.argv[4:]
    from tryon_server.streaming.server import Server, listen

    module, name = sys.argv[3].split(":")
    make_app = getattr(import_module(module), name)
    asyncio.run(Server(make_app(Path(sys.argv[1]))).serve([listen("127.0.0.1", int(sys.argv[2]))]))
