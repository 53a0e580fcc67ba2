#!/usr/bin/env bash
# Starts two simulated PUMA 560 in the namespaces left and right and the two-arm servo, no ROS needed. ctrl-C ends them; when
# one ends, so do the others, and the script has its code. Arguments go to all three:
#   launch_scripts/dq_dual_servo.sh --ros-args --log-level debug
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.
set -eu
. "$(dirname "$0")/parts.bash"
arms="$here/../msg_config/dual.yaml"
start puma560 --ros-args -r __ns:=/left --enclave /left/puma560 --params-file "$arms" -- "$@"
start puma560 --ros-args -r __ns:=/right --enclave /right/puma560 --params-file "$arms" -- "$@"
# Last, so that it ends first: the arms are there to be stopped.
start dual --ros-args --enclave /dq_dual_servo -- "$@"
run_parts
