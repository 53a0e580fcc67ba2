"""Starts the simulated PUMA 560 and the servo from an installed ROS 2:

    ros2 launch launch_scripts/dq_servo.launch.py namespace:=/left params_file:=my_arm.yaml

On a real robot without the simulated arm, and with the guard, which stops the arm if the servo is killed:

    ros2 launch launch_scripts/dq_servo.launch.py sim:=false guard:=true params_file:=my_arm.yaml
"""
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown, TimerAction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution, PythonExpression

# The checkout, or the package's share folder in a workspace, with the program beside it.
HOME = Path(__file__).resolve().parent.parent
INSTALLED = HOME.parent.parent / "lib" / "dq_servo" / "dq_servo"
PROGRAM = INSTALLED if INSTALLED.exists() else HOME / "target" / "release" / "dq_servo"
FIRST_MOTION = str(HOME / "msg_config" / "first_motion.yaml")

# A part that ends with this code has lost the network. It is started again after a pause [s], which doubles each time.
NETWORK_LOST, FIRST_PAUSE, LONGEST_PAUSE = 4, 1.0, 30.0


def generate_launch_description():
    namespace, params_file, program = (LaunchConfiguration(name) for name in ("namespace", "params_file", "program"))
    # A later file overrides an earlier one.
    chosen = ["'", FIRST_MOTION, "' if '", LaunchConfiguration("first_motion"), "' == 'true' else '", params_file, "'"]
    last_params_file = PythonExpression(chosen)

    def node(command, enclave, condition=None, pause=FIRST_PAUSE):
        ros_args = ["--ros-args", "-r", ["__ns:=", namespace], "--params-file", params_file]
        ros_args += ["--enclave", PathJoinSubstitution([namespace, enclave])]
        ros_args += ["--params-file", last_params_file]

        def ended(event, context):
            # A restarted servo ignores earlier goals, so it can be restarted at any time.
            if event.returncode == NETWORK_LOST and not context.is_shutdown:
                again = node(command, enclave, pause=min(2 * pause, LONGEST_PAUSE))
                return TimerAction(period=pause, actions=[again])
            # If another part ends, so do the others.
            return Shutdown(reason=f"{command} has ended")

        return ExecuteProcess(cmd=[program, command, *ros_args], name=command, output="screen", on_exit=ended, condition=condition)

    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="/", description="namespace of all nodes"),
            DeclareLaunchArgument(
                "params_file",
                default_value=str(HOME / "msg_config" / "puma560.yaml"),
                description="ROS 2 parameter file for all nodes",
            ),
            DeclareLaunchArgument(
                "program",
                default_value=str(PROGRAM),
                description="the dq_servo program",
            ),
            DeclareLaunchArgument("sim", default_value="true", description="start the simulated arm"),
            DeclareLaunchArgument("guard", default_value="false", description="start the guard"),
            DeclareLaunchArgument("first_motion", default_value="false", description="slow, gentle and clear of the arm's own body"),
            node("puma560", "puma560", IfCondition(LaunchConfiguration("sim"))),
            node("guard", "dq_servo_guard", IfCondition(LaunchConfiguration("guard"))),
            node("servo", "dq_servo"),
        ]
    )
