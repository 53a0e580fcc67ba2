#!/bin/sh
# Starts two simulated PUMA 560 in the namespaces left and right and the two-arm servo, no ROS needed; ctrl-C ends them.
# Arguments go to all three: launch_scripts/dq_dual_servo.sh --ros-args --log-level debug
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
program=${DQ_SERVO:-$here/../target/release/dq_servo}
[ -x "$program" ] || program=$(command -v dq_servo) || {
    echo "error: no dq_servo: run 'cargo build --release' first, or set DQ_SERVO" >&2
    exit 2
}
arms="$here/../msg_config/dual.yaml"
"$program" puma560 --ros-args -r __ns:=/left --enclave /left/puma560 --params-file "$arms" -- "$@" &
left=$!
"$program" puma560 --ros-args -r __ns:=/right --enclave /right/puma560 --params-file "$arms" -- "$@" &
right=$!
"$program" dual --ros-args --enclave /dq_dual_servo -- "$@" &
servo=$!
# The servo goes first, so that the arms are there to be stopped.
trap 'kill -INT "$servo" 2>/dev/null || :; wait "$servo" || :; kill -INT "$left" "$right" 2>/dev/null || :' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
wait "$servo"
