#!/bin/sh
# Starts the simulated PUMA 560 and the servo, no ROS needed; ctrl-C ends both. Arguments go to both nodes:
#   launch_scripts/dq_servo.sh --ros-args -r __ns:=/left --params-file my_arm.yaml
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
program=${DQ_SERVO:-$here/../target/release/dq_servo}
[ -x "$program" ] || program=$(command -v dq_servo) || {
    echo "error: no dq_servo: run 'cargo build --release' first, or set DQ_SERVO" >&2
    exit 2
}
"$program" puma560 --ros-args --enclave /puma560 -- "$@" &
plant=$!
"$program" servo --ros-args --enclave /dq_servo -- "$@" &
servo=$!
# The servo goes first, so that the arm is there to be stopped.
trap 'kill -INT "$servo" 2>/dev/null || :; wait "$servo" || :; kill -INT "$plant" 2>/dev/null || :' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
wait "$servo"
