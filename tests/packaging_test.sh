#!/usr/bin/env bash
# What packaging/ holds is what its readers accept: systemd its unit, systemd-tmpfiles and sysctl their settings; and every
# file stands in the README's table. usage: packaging_test.sh PONS
set -euo pipefail
cd "$(dirname "$0")/../packaging"
pons=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
die() { printf 'packaging: %s\n' "$*" >&2; exit 1; }

# The unit as it is, but for where the program lies.
sed "s#/usr/local/bin/pons#$pons#" 'systemd/pons@.service' >"$work/pons@.service"
grep -q "ExecStart=$pons run" "$work/pons@.service" || die "the unit does not start pons run"
said=$(systemd-analyze verify "$work/pons@.service" 2>&1) || die "$said"
[ -z "$said" ] || die "$said"
# Its options exist.
help=$("$pons" run --help)
for option in $(grep ^ExecStart 'systemd/pons@.service' | grep -o -- '--[a-z]*'); do
  grep -qw -- "$option" <<<"$help" || die "the unit uses $option, which pons run does not know"
done

mkdir -p "$work/root/etc/tmpfiles.d"
cp tmpfiles.d/pons.conf "$work/root/etc/tmpfiles.d/"
said=$(systemd-tmpfiles --root="$work/root" --create pons.conf 2>&1) || die "$said"
grep -Ev '^ *(#|$)' sysctl.d/90-pons.conf | while IFS='= ' read -r key _; do
  [ -e "/proc/sys/${key//.//}" ] || die "no kernel setting $key"
done
for file in */*; do
  grep -qF "\`$file\`" README.md || die "$file is not in the table of README.md"
done
echo "packaging: good"
