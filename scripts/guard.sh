#!/usr/bin/env bash
# Runs a command with a time limit. The limit or Ctrl-C ends all of its processes, so that a driver that hangs does not block
# the run. Usage: guard.sh SECONDS COMMAND...
set -euo pipefail
# `timeout` starts its own process group, which does not get the terminal's Ctrl-C; therefore the traps.
timeout --kill-after=10 "$@" &
job=$!
trap 'kill -TERM $job 2>/dev/null; wait $job || true; exit 130' INT TERM
status=0
wait $job || status=$?
if [ $status -eq 124 ] || [ $status -eq 137 ]; then
  echo "guard: stopped after $1 seconds: ${*:2}" >&2
fi
exit $status
