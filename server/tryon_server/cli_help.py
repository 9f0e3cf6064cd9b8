"""What `tryon --help` says of its commands."""

from __future__ import annotations

SERVE_HELP = """\
Start the server and its web page. Uploaded patterns and the history of sessions are kept in an SQLite file under
./var unless told otherwise. Stop it with Ctrl-C.

Everything else is set by environment variables TRYON_SERVER_..., for example TRYON_SERVER_DATABASE_URL for PostgreSQL
or TRYON_SERVER_MAX_SESSIONS; an unknown one is an error that lists them all. Options win over the environment."""

SERVE_EXAMPLES = """\
examples:
  tryon serve                              on this machine only: http://127.0.0.1:8000/
  tryon serve --host 0.0.0.0 --port 9000   for the whole network
  tryon serve --host 0.0.0.0 --tls         the same with https, for headsets
  tryon serve --device cuda:0              simulate on the first GPU"""

SIMULATE_HELP = """\
Dress a body in a garment, move it, and record the cloth in a file. Dressing, and leading the body from the pose of
dressing into the motion, come before frame 0.

A garment may be a mesh (.obj, .glb) that lies on its body: coincident vertices along seams are welded, l lines of an
OBJ are sewn, and where it touches or crosses the body or itself it is freed first, or refused with its triangles named.
Its rest shape is its texture coordinates where they are a pattern in metres or in the file's unit, else the shape it
comes in; --rest-shape tells. A body may be a moving mesh; a garment that is a mesh must lie on its first frame, a
pattern is put on there or, where it is refused, in a later frame in which the body is held openly, which is told. Units
and the upward axis of mesh files are found from their contents and told; where that can't be, they are asked for.
An option that says nothing of what is given is refused."""

SIMULATE_EXAMPLES = """\
examples:
  tryon simulate --garment shirt.json --out shirt.npz                     a still body
  tryon simulate --garment shirt.json --motion walk.bvh --out walk.npz    a recorded motion, as long as it lasts
  tryon simulate --garment shirt.json --motion walk --seconds 10 --out walk.npz --glb walk.glb
  tryon simulate --garment skirt.obj --motion walk --out walk.npz         a mesh that lies on the default body
  tryon simulate --garment shirt.json --motion a.bvh --motion-units mm --out a.npz
  tryon simulate --garment top.glb --body frames/ --body-fps 24 --out top.npz

the .npz file holds, in metres and seconds:
  cloth        frames x vertices x 3    positions of the cloth
  cloth_faces  triangles x 3            its triangles
  body         frames x vertices x 3    positions of the body's surface as simulated
  body_faces   triangles x 3            its triangles
  dt                                    time between frames
  reports                               JSON text: what the solver reported on the way to each frame but the first
  notes                                 JSON text: units, axes, repairs: what was found in mesh files, and done"""

HEADSET_HELP = """\
Be a headset without a head: open a session on a running server, stream a motion as a body tracker would see it, with
its rate, latency, noise and losses, and say how old the garment's frames are when they are there. The defaults are
those of a headset's body tracking; 0 makes a tracker perfect in that respect."""

HEADSET_EXAMPLES = """\
examples:
  tryon headset-sim                                        a T-shirt on a walk, at http://127.0.0.1:8000
  tryon headset-sim --motion squat --rate 60 --noise-mm 3 --noise-deg 0.5 --seconds 20
  tryon headset-sim --server https://192.168.1.20:8000 --authority var/tls/authority.pem
  tryon headset-sim --url ws://127.0.0.1:8000/api/sessions/ID/stream      in a session that is open already

the ages, in milliseconds, after three seconds of warming up:
  capture to decoded frame     from the capture of the pose on the sender's clock to the frame that shows that moment
  published to decoded frame   the server's part of the way back: sending, network, decoding
  frame to frame               between one frame and the next"""
