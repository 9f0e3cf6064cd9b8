#!/usr/bin/env bash
# Runs the images' own steps where no container engine does: a copy of exactly the files that the images are built from,
# in a new folder, with an empty home and empty caches. Then starts the server as the image does and asks it.
#
#   docker/test_in_clean_root.sh             takes some minutes and 1.5 GB, removes everything at the end
#   KEEP=1 docker/test_in_clean_root.sh      leaves the folder and says where it is
#
# Of the environment only what pip and npm need to find a mirror, a proxy or certificates is handed on.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

echo "== both Dockerfiles run the same steps"
same() { grep -E '^(FROM|RUN|COPY|WORKDIR|USER|VOLUME|EXPOSE|ENTRYPOINT|CMD)' "$1"; }
diff <(same docker/Dockerfile.cpu) <(same docker/Dockerfile.gpu) || fail "the Dockerfiles differ in a step"

root="$(mktemp -d)"
server=""
finish() {
  [ -z "$server" ] || kill "$server" 2>/dev/null || true
  if [ -n "${KEEP:-}" ]; then echo "left at $root"; else rm -rf "$root"; fi
}
trap finish EXIT

mkdir -p "$root/app" "$root/home" "$root/tmp" "$root/data"
sed -n 's/^!//p' .dockerignore | while read -r path; do
  [ -e "$path" ] || fail ".dockerignore lets $path through, but there is no such file"
  git ls-files --cached --others --exclude-standard -- "$path"
done | while read -r file; do
  [ ! -e "$file" ] || printf '%s\n' "$file"
done | tar -c -T - | tar -x -C "$root/app"
echo "== $(find "$root/app" -type f | wc -l) files in the build context"

handed_on=()
while IFS= read -r name; do
  handed_on+=("$name=${!name}")
done < <(compgen -e | grep -iE '^(pip_|npm_config_|uv_|ssl_cert_|node_extra_ca_certs$|requests_ca_bundle$|https?_proxy$|no_proxy$)' || true)

# "${clean[@]}" VARIABLE=VALUE ... COMMAND runs in the clean root, with nothing of this shell's environment
clean=(env -i -C "$root/app" "PATH=$PATH" "HOME=$root/home" "TMPDIR=$root/tmp" LANG=C.UTF-8 "${handed_on[@]}")

stage() {
  echo "== $1"
  local begun=$SECONDS
  "${clean[@]}" WARP_CACHE_PATH="$root/data/kernels" docker/steps.sh "$1" || fail "step $1"
  echo "   $((SECONDS - begun)) s, $(du -sm "$root" | cut -f1) MB in all"
}
stage page
rm -rf "$root/app/node_modules" # the runtime stage of the image takes the page alone
stage solver
stage check

echo "== the server, started as in the image"
address=http://127.0.0.1:18473
"${clean[@]}" PATH="$root/app/.venv/bin:$PATH" WARP_CACHE_PATH="$root/data/kernels" TRYON_SERVER_DATA_DIR="$root/data" \
  TRYON_SERVER_HOST=127.0.0.1 TRYON_SERVER_PORT=18473 TRYON_SERVER_DEVICE=cpu tryon serve &
server=$!
for _ in $(seq 120); do
  kill -0 "$server" 2>/dev/null || fail "the server stopped"
  curl --silent --fail "$address/api/health" && break
  sleep 0.5
done
echo
curl --silent --fail "$address/" | grep '<script' >/dev/null || fail "the page is not served"
curl --silent --fail "$address/api/garments" | grep tshirt >/dev/null || fail "the demo's garments are missing"
kill -TERM "$server"
status=0
wait "$server" || status=$?
server=""
[ "$status" = 0 ] || [ "$status" = 143 ] || fail "the server ended with status $status" # 143: stopped by SIGTERM, as asked
[ -s "$root/data/tryon.sqlite3" ] || fail "there is no database in the data folder"
echo "== all steps of the images work"
