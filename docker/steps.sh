#!/usr/bin/env bash
# What the images run, step by step; docker/test_in_clean_root.sh runs the same steps where there is no engine.
#
#   docker/steps.sh page      the web page, into server/tryon_server/web      needs make and Node 20.19 or newer
#   docker/steps.sh solver    environment, server and body, into .venv and .cache    needs make and Python 3.10 or newer
#   docker/steps.sh check     what was installed answers, and simulates a few frames on the CPU
set -euo pipefail
cd "$(dirname "$0")/.."

page() {
  make --no-print-directory server/tryon_server/web/.built
}

solver() {
  make --no-print-directory .venv/.runtime .cache/tryon/body.npz
  .venv/bin/python -m pip install --quiet --require-hashes -r docker/postgres.requirements.txt
  rm -rf .cache/tryon/downloads # the body is made; the data it was made from is not needed any more
}

check() {
  .venv/bin/tryon devices
  out="$(mktemp -d)"
  trap 'rm -rf "$out"' EXIT
  .venv/bin/tryon simulate --device cpu --edge-length 0.03 --fps 15 --seconds 0.2 \
    --garment server/tryon_server/demo/patterns/tshirt.json --out "$out/frames.npz"
  .venv/bin/python -c 'import numpy, pg8000, sys; assert numpy.isfinite(numpy.load(sys.argv[1])["cloth"]).all()' \
    "$out/frames.npz"
}

case "${1:-}" in
  page | solver | check) "$1" ;;
  *)
    sed -n '4,6s/^# *//p' "$0" >&2
    exit 2
    ;;
esac
