#!/usr/bin/env bash
# Starts a simulated arm, by default the PUMA 560, and the servo, without ROS. ctrl-C ends both. If one ends, so does the other, and the
# script returns its code. ROS arguments go to all nodes:
#   launch_scripts/dq_servo.sh --arm ur5e --ros-args -r __ns:=/left
# On a real robot: without the simulated arm, with the guard, which stops the arm if the servo is killed, and with slow motions:
#   launch_scripts/dq_servo.sh sim:=false guard:=true first_motion:=true --ros-args --params-file my_arm.yaml
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.
set -eu
. "$(dirname "$0")/parts.bash"
take_switches "$@"
shift "$switches"
if [ "$first_motion" = true ]; then set -- "$@" --ros-args --params-file "$here/../msg_config/first_motion.yaml"; fi
check servo "${arm[@]}" "$@"
namespace=$(namespace_of "$@")
start_node() { # NAME COMMAND...
    start "${@:2}" "${arm[@]}" --ros-args --enclave "$namespace/$1" -- "${ros_args[@]}"
}
ros_args=("$@")
plant=puma560
[ ${#arm[@]} = 0 ] || plant=arm
if [ "$sim" = true ]; then start_node "$plant" "$plant"; fi
# Started before the servo, so that it runs whenever the servo does.
if [ "$guard" = true ]; then start_node dq_servo_guard guard; fi
# Started last, so that it ends first, while the arm can still be stopped.
start_node dq_servo servo
run_parts
