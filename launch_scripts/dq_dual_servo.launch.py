"""Starts two simulated PUMA 560 in the namespaces left and right and the two-arm servo from an installed ROS 2:

    ros2 launch launch_scripts/dq_dual_servo.launch.py params_file:=my_arms.yaml

On real robots without the simulated arms, and with a guard for each, which stops it if the servo is killed: sim:=false guard:=true
"""
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown, TimerAction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PythonExpression

# The checkout, or the package's share folder in a workspace, with the program beside it.
HOME = Path(__file__).resolve().parent.parent
INSTALLED = HOME.parent.parent / "lib" / "dq_servo" / "dq_servo"
PROGRAM = INSTALLED if INSTALLED.exists() else HOME / "target" / "release" / "dq_servo"
FIRST_MOTION = str(HOME / "msg_config" / "first_motion.yaml")

# A part that ends with this code has lost the network. It is started again after a pause [s], which doubles each time.
NETWORK_LOST, FIRST_PAUSE, LONGEST_PAUSE = 4, 1.0, 30.0


def generate_launch_description():
    params_file, program = (LaunchConfiguration(name) for name in ("params_file", "program"))
    # A later file overrides an earlier one.
    chosen = ["'", FIRST_MOTION, "' if '", LaunchConfiguration("first_motion"), "' == 'true' else '", params_file, "'"]
    last_params_file = PythonExpression(chosen)

    def node(command, namespace, enclave, condition=None, pause=FIRST_PAUSE):
        ros_args = ["--ros-args", "-r", f"__ns:={namespace}", "--params-file", params_file, "--enclave", enclave]
        ros_args += ["--params-file", last_params_file]

        def ended(event, context):
            # A restarted servo ignores earlier goals, so it can be restarted at any time.
            if event.returncode == NETWORK_LOST and not context.is_shutdown:
                again = node(command, namespace, enclave, pause=min(2 * pause, LONGEST_PAUSE))
                return TimerAction(period=pause, actions=[again])
            # If another part ends, so do the others.
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
            DeclareLaunchArgument("first_motion", default_value="false", description="slow, gentle and clear of the arms' own bodies"),
            node("puma560", "/left", "/left/puma560", IfCondition(LaunchConfiguration("sim"))),
            node("puma560", "/right", "/right/puma560", IfCondition(LaunchConfiguration("sim"))),
            node("guard", "/left", "/left/dq_servo_guard", IfCondition(LaunchConfiguration("guard"))),
            node("guard", "/right", "/right/dq_servo_guard", IfCondition(LaunchConfiguration("guard"))),
            node("dual", "/", "/dq_dual_servo"),
        ]
    )
