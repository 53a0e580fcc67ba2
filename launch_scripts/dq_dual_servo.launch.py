"""Starts two simulated PUMA 560 in the namespaces left and right and the two-arm servo from an installed ROS 2:

    ros2 launch launch_scripts/dq_dual_servo.launch.py params_file:=my_arms.yaml

On real robots without the simulated arms, and with a guard for each, which stops it if the servo is killed: sim:=false guard:=true
"""
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

HERE = Path(__file__).resolve().parent


def generate_launch_description():
    params_file, sim, guard = (LaunchConfiguration(name) for name in ("params_file", "sim", "guard"))

    def include(**arguments):
        source = PythonLaunchDescriptionSource(str(HERE / "dq_servo.launch.py"))
        # Two other arms are described in params_file.
        arguments |= {"params_file": params_file, "arm": ""}
        return IncludeLaunchDescription(source, launch_arguments=arguments.items())

    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file",
                default_value=str(HERE.parent / "msg_config" / "dual.yaml"),
                description="ROS 2 parameter file for all nodes",
            ),
            DeclareLaunchArgument("sim", default_value="true", description="start the simulated arms"),
            DeclareLaunchArgument("guard", default_value="false", description="start a guard for each arm"),
            include(namespace="left", servo="none", sim=sim, guard=guard),
            include(namespace="right", servo="none", sim=sim, guard=guard),
            include(namespace="", servo="dual", sim="false", guard="false"),
        ]
    )
