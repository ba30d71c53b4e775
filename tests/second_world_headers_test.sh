#!/usr/bin/env bash
# usage: second_world_headers_test.sh NINJA BUILD_DIR
# Fails if any object of the build was compiled from a header of Debian's Boost, Eigen or tinyxml2: the process holds
# the wheels'. Ninja recorded every header that the compiler read.
set -euo pipefail
ninja=$1 build=$2

dependencies=$("$ninja" -C "$build" -t deps)
objects=$(grep -c '#deps' <<<"$dependencies" || true)
[ "$objects" -gt 0 ] || { echo "$build holds no compiled object"; exit 1; }
# What each object was made from is indented below its name.
if foreign=$(awk '/#deps/ {object = $1} /^ .*\/usr\/include\/(boost|eigen3)\// || /\/usr\/include\/tinyxml2\.h/ {print object, $1}' \
    <<<"$dependencies" | grep .); then
  echo "compiled from a second Boost, Eigen or tinyxml2:"
  head -20 <<<"$foreign"
  exit 1
fi
grep -q "cmeel.prefix/include/eigen3/" <<<"$dependencies" || { echo "no object was compiled from the wheels' Eigen"; exit 1; }
echo "$objects objects, none compiled from a second Boost, Eigen or tinyxml2"
