#!/usr/bin/env bash
# Builds the repository with colcon as a plain CMake package and tries what it installed, away from the checkout.
set -euo pipefail
cd "$(dirname "$0")/.."
say() { printf 'colcon: %s\n' "$*"; }
die() { printf 'colcon: error: %s\n' "$*" >&2; exit 1; }
out=$PWD/build/colcon

command -v colcon >/dev/null || die "colcon is not installed; run tools/setup"
[ "$(colcon --log-base /dev/null list --base-paths . --names-only)" = pons ] || die "colcon does not find one package, pons"
# Builds in build/pons, as deep below the checkout as a preset's: what that compiled, ccache has for this one.
colcon --log-base "$out/log" build --base-paths . --build-base build --install-base "$out/install" \
  --event-handlers console_direct+ --cmake-args -G Ninja -DCMAKE_BUILD_TYPE=Release -DPONS_BUILD_TESTS=OFF

prefix=$out/install/pons
[ -x "$prefix/bin/pons" ] || die "$prefix/bin/pons was not installed"
for name in package.xml worlds/parcel_cell; do
  [ -e "$prefix/share/pons/$name" ] || die "$prefix/share/pons/$name was not installed"
done
missing=$(ldd "$prefix/bin/pons" | grep 'not found' || true)
[ -z "$missing" ] || die "the installed program lacks libraries: $missing"
in_checkout=$(ldd "$prefix/bin/pons" | grep -F "$PWD/.venv" || true)
[ -z "$in_checkout" ] || die "the installed program still needs the checkout: $in_checkout"
worlds=$(cd / && "$prefix/bin/pons" worlds) || die "the installed 'pons worlds' failed"
grep -q parcel_cell <<<"$worlds" || die "the installed 'pons worlds' does not know parcel_cell: $worlds"
say "builds, installs and runs"
