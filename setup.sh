#!/usr/bin/env bash
# Makes .venv with the versions of requirements.lock; with --dev also what the tests need. Safe to run again.
#   PYTHON           the Python 3.11 to use (default: python3.11)
#   TORCH_INDEX_URL  where pip takes torch from, for example PyTorch's index of CPU builds (default: pip's own)
set -euo pipefail
cd "$(dirname "$0")"

python=${PYTHON:-python3.11}
venv=.venv
fail() { printf 'setup: %s\n' "$1" >&2; exit 2; }

case "${1:-}" in
    "") dev=false ;;
    --dev) dev=true ;;
    *) fail "takes --dev or nothing, not '$1'" ;;
esac

command -v "$python" >/dev/null || fail "needs Python 3.11 ('$python' not found): on Debian 12 run: sudo apt-get install -y python3.11-venv, or set PYTHON"
"$python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || fail "'$python' is not Python 3.11, the only one that bpy 4.2.0 has wheels for: set PYTHON"

locks=(requirements.lock)
$dev && locks+=(requirements-dev.lock)
stamp="$(cat "${locks[@]}" pyproject.toml | sha256sum | cut -d' ' -f1) ${TORCH_INDEX_URL:-}"
for installed in $venv/.installed-dev $venv/.installed; do
    [ -f "$installed" ] && [ "$(cat "$installed")" = "$stamp" ] && exit 0
done

[ -x $venv/bin/pip ] || "$python" -m venv --clear $venv || fail "cannot make a virtual environment: on Debian or Ubuntu run: sudo apt-get install -y python3.11-venv"
pip=($venv/bin/python -m pip install --disable-pip-version-check)
[ -t 1 ] || pip+=(--quiet)  # somebody who watches gigabytes arrive wants pip's progress

echo "setup: installing pinned packages into $venv (about 4 GB, more with CUDA)"
for lock in "${locks[@]}"; do
    grep -v '^torch==' "$lock" | "${pip[@]}" --no-deps --requirement /dev/stdin
done
"${pip[@]}" ${TORCH_INDEX_URL:+--index-url "$TORCH_INDEX_URL"} --constraint requirements.lock "$(grep '^torch==' requirements.lock)"
"${pip[@]}" --no-deps --no-build-isolation --editable .

$venv/bin/perpetua doctor || fail "the machine lacks something that Perpetua needs: see the table above"
$dev && echo "$stamp" > $venv/.installed-dev || echo "$stamp" > $venv/.installed
