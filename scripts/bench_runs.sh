#!/usr/bin/env bash
# A run of README.md's table: scripts/bench_runs.sh NAME [OPTION...], into build/bench/NAME. Those in docs/bench/runs were
# played so, some with --longest.
# Options of solver/bench behind the name come last and win: --vertices 300 --seconds 1; DEVICE=cpu is another device.
# To keep what came of it: cp build/bench/NAME/results.json docs/bench/runs/NEW.json, a name that none has there yet, and
# make bench-page.
# CLIPS=FOLDER has the captured clips wash_self_02_10.bvh and cartwheel_49_08.bvh for `minute` and `dress`. `sessions`
# and `sessions-x32` are meant for CUDA's Multi-Process Service (README.md); `peers` needs the packages of [peers] and
# [peers-gpu] in pyproject.toml.
set -euo pipefail
cd "$(dirname "$0")/.."

NAMES="minute dress sizes large sessions sessions-x32 soak start roofline peers"
name=${1:-}
shift || true
motions=(walk jumping_jack)
[ -z "${CLIPS:-}" ] || motions+=("$CLIPS/wash_self_02_10.bvh" "$CLIPS/cartwheel_49_08.bvh")
case $name in
    minute) options=(--motions "${motions[@]}" --vertices 20000 --seconds 60 --every 61) ;;
    dress) options=(--garments dress --motions "${motions[@]}" --vertices 20000 --seconds 60 --every 61) ;;
    sizes) options=(--vertices 50000 10000 2500 --seconds 12 --every 61) ;;
    large) options=(--vertices 220000 --fabric cotton_poplin --seconds 0.5 --every 15) ;;
    sessions) options=(--vertices 10000 --sessions 8 --fps 60 --seconds 6 --every 61) ;;
    sessions-x32) options=(--vertices 10000 --sessions 32 --fps 30 --seconds 3 --every 31) ;;
    soak) options=(--vertices 10000 --seconds 1111.2 --every 100) ;;
    start) options=(--vertices 20000 --seconds 1 --start) ;;
    roofline) options=(--vertices 20000 --seconds 0.5 --every 61 --roofline) ;;
    peers) options=(--garments --peers uipc style3d style3d-4 xpbd vbd --presets draft live --vertices 10000 --seconds 3.2) ;;
    *)
        echo "no run is called '$name'; there are: $NAMES" >&2
        exit 2
        ;;
esac
exec .venv/bin/python solver/bench --out "build/bench/$name" --device "${DEVICE:-cuda:0}" --fps 90 "${options[@]}" "$@"
