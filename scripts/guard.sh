#!/usr/bin/env bash
# Runs a command under a time limit and ends all of its processes when the limit or Ctrl-C comes: a driver that hangs must
# not hang the run. Usage: guard.sh SECONDS COMMAND...
set -euo pipefail
# `timeout` leads a process group of its own, which the terminal's Ctrl-C does not reach; hence the traps.
timeout --kill-after=10 "$@" &
job=$!
trap 'kill -TERM $job 2>/dev/null; wait $job || true; exit 130' INT TERM
status=0
wait $job || status=$?
if [ $status -eq 124 ] || [ $status -eq 137 ]; then
  echo "guard: stopped after $1 seconds: ${*:2}" >&2
fi
exit $status
