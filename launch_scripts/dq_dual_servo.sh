#!/usr/bin/env bash
# Starts two simulated PUMA 560 in the namespaces left and right, and the two-arm servo, without ROS. ctrl-C ends them. If one
# ends, so do the others, and the script returns its code. Arguments go to all three:
#   launch_scripts/dq_dual_servo.sh --ros-args --log-level debug
# On real robots: without the simulated arms, and with a guard for each arm, which stops it if the servo is killed:
#   launch_scripts/dq_dual_servo.sh sim:=false guard:=true --ros-args --params-file my_arms.yaml
# The program is $DQ_SERVO, or this checkout's release build, or dq_servo on the PATH.
set -eu
. "$(dirname "$0")/parts.bash"
take_switches "$@"
shift "$switches"
[ ${#arm[@]} = 0 ] || mistake "--arm is for one arm: describe two other arms in a file for --params-file"
if [ "$first_motion" = true ]; then set -- "$@" --ros-args --params-file "$here/../msg_config/first_motion.yaml"; fi
check dual "$@"
arms="$here/../msg_config/dual.yaml"
for side in left right; do
    if [ "$sim" = true ]; then start puma560 --ros-args -r "__ns:=/$side" --enclave "/$side/puma560" --params-file "$arms" -- "$@"; fi
    if [ "$guard" = true ]; then start guard --ros-args -r "__ns:=/$side" --enclave "/$side/dq_servo_guard" --params-file "$arms" -- "$@"; fi
done
# Started last, so that it ends first, while the arms can still be stopped.
start dual --ros-args --enclave /dq_dual_servo -- "$@"
run_parts
