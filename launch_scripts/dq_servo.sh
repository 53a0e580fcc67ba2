#!/usr/bin/env bash
# Starts the simulated PUMA 560 and the servo, without ROS. ctrl-C ends both. If one ends, so does the other, and the script
# returns its code. Arguments go to all nodes:
#   launch_scripts/dq_servo.sh --ros-args -r __ns:=/left --params-file my_arm.yaml
# On a real robot: without the simulated arm, with the guard, which stops the arm if the servo is killed, and with slow motions:
#   launch_scripts/dq_servo.sh sim:=false guard:=true first_motion:=true --ros-args --params-file my_arm.yaml
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.
set -eu
. "$(dirname "$0")/parts.bash"
take_switches "$@"
shift "$switches"
if [ "$first_motion" = true ]; then set -- "$@" --ros-args --params-file "$here/../msg_config/first_motion.yaml"; fi
check servo "$@"
namespace=$(namespace_of "$@")
if [ "$sim" = true ]; then start puma560 --ros-args --enclave "$namespace/puma560" -- "$@"; fi
# Started before the servo, so that it runs whenever the servo does.
if [ "$guard" = true ]; then start guard --ros-args --enclave "$namespace/dq_servo_guard" -- "$@"; fi
# Started last, so that it ends first, while the arm can still be stopped.
start servo --ros-args --enclave "$namespace/dq_servo" -- "$@"
run_parts
