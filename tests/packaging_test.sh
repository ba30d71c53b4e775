#!/usr/bin/env bash
# What packaging/ holds is what its readers accept: systemd its units, systemd-tmpfiles and sysctl their settings; each
# unit gives what real time needs, and starts a command that there is; and every file stands in the README's table.
# usage: packaging_test.sh PONS
set -euo pipefail
cd "$(dirname "$0")/../packaging"
pons=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
die() { printf 'packaging: %s\n' "$*" >&2; exit 1; }
has() { grep -qxF -- "$2" "systemd/$1" || die "systemd/$1 lacks $2"; }

# The units as they are, but for where the program lies.
cp -r systemd "$work/units"
sed -i "s#/usr/local/bin/pons#$pons#" "$work"/units/*.service
said=$(systemd-analyze verify "$work"/units/*.service "$work"/units/*.slice 2>&1) || die "$said"
[ -z "$said" ] || die "$said"

for unit in pons@:run pons-body@:body pons-bridge@:bridge; do
  command=${unit#*:} unit=${unit%:*}.service
  grep -q "^ExecStart=$pons $command %i " "$work/units/$unit" || die "$unit does not start pons $command"
  help=$("$pons" "$command" --help)
  for option in $(grep ^ExecStart= "systemd/$unit" | grep -o -- '--[a-z]*'); do
    grep -qw -- "$option" <<<"$help" || die "$unit uses $option, which pons $command does not know"
  done
  for setting in LimitRTPRIO=95 LimitMEMLOCK=infinity 'AmbientCapabilities=CAP_SYS_NICE CAP_IPC_LOCK' \
    'DeviceAllow=/dev/cpu_dma_latency rw' Slice=pons.slice StateDirectory=pons SuccessExitStatus=130; do
    has "$unit" "$setting"
  done
done
# Who keeps a journal keeps it where it survives; a run has its own, and all bridges of a run have the same.
grep -q -- ' --journal ${STATE_DIRECTORY}/%i-${INVOCATION_ID}.db ' systemd/pons@.service || die "pons@ keeps no journal"
grep -q -- ' --journal ${STATE_DIRECTORY}/%i-${RUN}.db ' systemd/pons-bridge@.service || die "pons-bridge@ keeps no journal"
for setting in Restart=on-failure StartLimitIntervalSec=0 'RestartPreventExitStatus=2 3' EnvironmentFile=%S/pons/%i.run \
  BindsTo=pons-body@%i.service After=pons-body@%i.service; do
  has pons-bridge@.service "$setting"
done
name_run=$(sed -n "s#^ExecStartPre=/bin/sh -c '\(.*\)'\$#\1#p" systemd/pons-body@.service)
INVOCATION_ID=c0ffee STATE_DIRECTORY=$work sh -c "${name_run//%i/cell}"
[ "$(cat "$work/cell.run")" = RUN=c0ffee ] || die "pons-body@ does not name its run"
# The CPUs are set, and where systemd looks for it: spoilt, it complains.
grep -Eqx 'AllowedCPUs=[0-9]+-[0-9]+' systemd/pons.slice.d/50-cpus.conf || die "no CPUs for pons.slice"
sed -i 's/^AllowedCPUs=.*/AllowedCPUs=none/' "$work/units/pons.slice.d/50-cpus.conf"
said=$(systemd-analyze verify "$work/units/pons@.service" 2>&1) || true
grep -q '50-cpus.conf:.*none' <<<"$said" || die "systemd does not read pons.slice.d/50-cpus.conf"

mkdir -p "$work/root/etc/tmpfiles.d"
cp tmpfiles.d/pons.conf "$work/root/etc/tmpfiles.d/"
said=$(systemd-tmpfiles --root="$work/root" --create pons.conf 2>&1) || die "$said"
grep -Ev '^ *(#|$)' sysctl.d/90-pons.conf | while IFS='= ' read -r key _; do
  [ -e "/proc/sys/${key//.//}" ] || die "no kernel setting $key"
done
for setting in 'vm.swappiness = 10' 'kernel.sched_rt_runtime_us = -1'; do
  grep -qxF "$setting" sysctl.d/90-pons.conf || die "sysctl.d/90-pons.conf lacks $setting"
done
for setting in rtprio\ 95 memlock\ unlimited; do
  sed -E 's/ +/ /g' limits.d/90-pons.conf | grep -qxF "@realtime - $setting" || die "limits.d/90-pons.conf lacks $setting"
done
for setting in enabled\ -\ -\ -\ -\ madvise scaling_governor\ -\ -\ -\ -\ performance; do
  grep -qE "^w!? /sys/.*/$setting\$" tmpfiles.d/pons.conf || die "tmpfiles.d/pons.conf lacks $setting"
done
# Its group may write the device, and it is the group that people and services get.
grep -qxF 'KERNEL=="cpu_dma_latency", GROUP="realtime", MODE="0660"' udev/90-pons.rules || die "udev/90-pons.rules does not give the device"
for file in $(grep -o '^| `.*` |' README.md | grep -o '`[a-z.-]*/[^`]*`' | tr -d '`' | grep -v '^/'); do
  [ -e "$file" ] || die "README.md's table names $file, which there is not"
done
for file in $(find . -mindepth 2 -type f -printf '%P\n'); do
  grep -qF "\`$file\`" README.md || die "$file is not in the table of README.md"
done
echo "packaging: good"
