"""Starts a simulated arm and the servo from an installed ROS 2:

    ros2 launch launch_scripts/dq_servo.launch.py arm:=ur5e namespace:=/left

On a real robot without the simulated arm, and with the guard, which stops the arm if the servo is killed:

    ros2 launch launch_scripts/dq_servo.launch.py sim:=false guard:=true first_motion:=true params_file:=my_arm.yaml

The parts are ordinary nodes: a launch file that includes this one can use PushRosNamespace, SetParameter, SetUseSimTime and SetRemap.
"""
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown, TimerAction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.utilities import make_namespace_absolute, prefix_namespace

# The checkout, or the package's share folder in a workspace, with the program beside it.
HOME = Path(__file__).resolve().parent.parent
INSTALLED = HOME.parent.parent / "lib" / "dq_servo" / "dq_servo"
PROGRAM = INSTALLED if INSTALLED.exists() else HOME / "target" / "release" / "dq_servo"

# A part that ends with this code has lost the network. It is started again after a pause [s], which doubles each time.
NETWORK_LOST, FIRST_PAUSE, LONGEST_PAUSE = 4, 1.0, 30.0

# Each argument with its default, its values if they are few, and its description.
ARGUMENTS = [
    ("arm", "", None, "a built-in arm, for example ur5e; by default the PUMA 560"),
    ("namespace", "", None, "namespace of all nodes"),
    ("params_file", "", None, "ROS 2 parameter file for all nodes"),
    ("sim", "true", ["true", "false"], "start the simulated arm"),
    ("guard", "false", ["true", "false"], "start the guard"),
    ("servo", "servo", ["servo", "dual", "none"], "the servo of one arm, of two arms, or none"),
    ("first_motion", "false", ["true", "false"], "slow, gentle and clear of the arm's own body"),
    ("use_sim_time", "", ["", "true", "false"], "follow /clock, for arms simulated elsewhere"),
    ("log_level", "info", None, "least severity that is logged"),
    ("program", str(PROGRAM), None, "the dq_servo program"),
]


def parts(context):
    argument = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    arm = ["--arm", argument["arm"]] if argument["arm"] else []
    # A later file overrides an earlier one.
    parameters = [argument["params_file"]] if argument["params_file"] else []
    if argument["first_motion"] == "true":
        parameters.append(str(HOME / "msg_config" / "first_motion.yaml"))
    if argument["use_sim_time"]:
        parameters.append({"use_sim_time": argument["use_sim_time"] == "true"})
    pushed = context.launch_configurations.get("ros_namespace", "")
    namespace = make_namespace_absolute(prefix_namespace(pushed, argument["namespace"]))

    def part(command, name, pause=FIRST_PAUSE):
        def ended(event, context):
            # A restarted servo ignores earlier goals, so it can be restarted at any time.
            if event.returncode == NETWORK_LOST and not context.is_shutdown:
                again = part(command, name, min(2 * pause, LONGEST_PAUSE))
                return TimerAction(period=pause, actions=[again])
            # If another part ends, so do the others.
            return Shutdown(reason=f"{name} has ended")

        return Node(
            executable=argument["program"],
            exec_name=command[0],
            arguments=command,
            namespace=argument["namespace"],
            parameters=parameters,
            ros_arguments=["--enclave", f"{namespace.rstrip('/')}/{name}", "--log-level", argument["log_level"]],
            output="screen",
            on_exit=ended,
        )

    started = []
    if argument["sim"] == "true":
        started.append(part(["arm", *arm], "arm") if arm else part(["puma560"], "puma560"))
    if argument["guard"] == "true":
        started.append(part(["guard", *arm], "dq_servo_guard"))
    if argument["servo"] == "servo":
        started.append(part(["servo", *arm], "dq_servo"))
    if argument["servo"] == "dual":
        started.append(part(["dual", *arm], "dq_dual_servo"))
    return started


def generate_launch_description():
    declared = [
        DeclareLaunchArgument(name, default_value=default, choices=choices, description=description)
        for name, default, choices, description in ARGUMENTS
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=parts)])
