"""Starts two simulated PUMA 560 in the namespaces left and right and the two-arm servo from an installed ROS 2:

    ros2 launch launch_scripts/dq_dual_servo.launch.py params_file:=my_arms.yaml

On real robots without the simulated arms, and with a guard for each, which stops it if the servo is killed: sim:=false guard:=true
"""
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown, TimerAction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration

# The checkout, or the package's share folder in a workspace, with the program beside it.
HOME = Path(__file__).resolve().parent.parent
INSTALLED = HOME.parent.parent / "lib" / "dq_servo" / "dq_servo"
PROGRAM = INSTALLED if INSTALLED.exists() else HOME / "target" / "release" / "dq_servo"

# The exit code of a part that is started again, after so long [s].
FAILED, PAUSE = 1, 1.0


def generate_launch_description():
    params_file, program = (LaunchConfiguration(name) for name in ("params_file", "program"))

    def node(command, namespace, enclave, condition=None):
        ros_args = ["--ros-args", "-r", f"__ns:={namespace}", "--params-file", params_file, "--enclave", enclave]

        def ended(event, context):
            # A part that has lost the others ends so. It obeys nothing from before, so it can be started again at any time.
            if event.returncode == FAILED and not context.is_shutdown:
                return TimerAction(period=PAUSE, actions=[node(command, namespace, enclave)])
            # When another part ends, so do the others.
            return Shutdown(reason=f"{command} has ended")

        return ExecuteProcess(cmd=[program, command, *ros_args], name=command, output="screen", on_exit=ended, condition=condition)

    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file",
                default_value=str(HOME / "msg_config" / "dual.yaml"),
                description="ROS 2 parameter file for all three nodes",
            ),
            DeclareLaunchArgument(
                "program",
                default_value=str(PROGRAM),
                description="the dq_servo program",
            ),
            DeclareLaunchArgument("sim", default_value="true", description="start the simulated arms"),
            DeclareLaunchArgument("guard", default_value="false", description="start a guard for each arm"),
            node("puma560", "/left", "/left/puma560", IfCondition(LaunchConfiguration("sim"))),
            node("puma560", "/right", "/right/puma560", IfCondition(LaunchConfiguration("sim"))),
            node("guard", "/left", "/left/dq_servo_guard", IfCondition(LaunchConfiguration("guard"))),
            node("guard", "/right", "/right/dq_servo_guard", IfCondition(LaunchConfiguration("guard"))),
            node("dual", "/", "/dq_dual_servo"),
        ]
    )
