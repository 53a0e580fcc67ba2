#!/usr/bin/env bash
# Starts the simulated PUMA 560 and the servo, no ROS needed. ctrl-C ends both; when one ends, so does the other, and the
# script has its code. Arguments go to both nodes:
#   launch_scripts/dq_servo.sh --ros-args -r __ns:=/left --params-file my_arm.yaml
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.
set -eu
. "$(dirname "$0")/parts.bash"
start puma560 --ros-args --enclave /puma560 -- "$@"
# Last, so that it ends first: the arm is there to be stopped.
start servo --ros-args --enclave /dq_servo -- "$@"
run_parts
