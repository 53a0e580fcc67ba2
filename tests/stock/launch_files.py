"""Evaluates a launch file of this program as `ros2 launch` does, with stand-ins for the packages `launch` and `launch_ros`, which PyPI does
not have. Prints the arguments, and the command line of each node, as JSON. Checks what each node does when it ends.

    launch_files.py FILE [NAME:=VALUE...]
"""

import json
import sys
import types
from pathlib import Path

CONTEXT = types.SimpleNamespace(launch_configurations={}, is_shutdown=False)
ARGUMENTS, NODES = {}, []


class Action:
    """Keeps its arguments."""

    def __init__(self, *values, **named):
        self.values = values
        self.__dict__.update(named)


class DeclareLaunchArgument(Action):
    def run(self):
        [name] = self.values
        value = CONTEXT.launch_configurations.setdefault(name, self.default_value)
        ARGUMENTS.setdefault(name, self.default_value)
        choices = getattr(self, "choices", None)
        if choices and value not in choices:
            sys.exit(f"{name}: {value!r} is not one of {choices}")


class LaunchConfiguration(Action):
    def perform(self, context):
        return context.launch_configurations[self.values[0]]


class OpaqueFunction(Action):
    def run(self):
        for action in self.function(CONTEXT):
            action.run()


class IncludeLaunchDescription(Action):
    def run(self):
        [source] = self.values
        for name, value in self.launch_arguments:
            CONTEXT.launch_configurations[name] = value if isinstance(value, str) else value.perform(CONTEXT)
        run(source.values[0])


class TimerAction(Action):
    pass


class Shutdown(Action):
    pass


class Node(Action):
    def command(self):
        line = [self.executable, *self.arguments, "--ros-args", *self.ros_arguments]
        if self.namespace:
            line += ["-r", f"__ns:=/{self.namespace.lstrip('/')}"]
        for given in self.parameters:
            values = [["-p", f"{name}:={str(value).lower()}"] for name, value in given.items()] if isinstance(given, dict) else []
            line += sum(values, []) if values else ["--params-file", given]
        return line

    def run(self):
        NODES.append(self.command())

        def ends(node, code, context=CONTEXT):
            return node.on_exit(types.SimpleNamespace(returncode=code), context)

        ending = types.SimpleNamespace(is_shutdown=True)
        for code, context in ((0, CONTEXT), (1, CONTEXT), (2, CONTEXT), (-9, CONTEXT), (4, ending)):
            assert isinstance(ends(self, code, context), Shutdown), (self.command(), code)
        pauses, node = [], self
        for _ in range(8):
            timer = ends(node, 4)
            assert isinstance(timer, TimerAction), timer
            [node] = timer.actions
            assert node.command() == self.command()
            pauses.append(timer.period)
        assert pauses == [1, 2, 4, 8, 16, 30, 30, 30], pauses


def prefix_namespace(base, name):
    return name if name.startswith("/") else f"{base}/{name}".rstrip("/")


def run(file):
    code = {"__file__": file, "__name__": "launch_file"}
    exec(compile(Path(file).read_text(), file, "exec"), code)
    for action in code["generate_launch_description"]():
        action.run()


def modules():
    actions = {action.__name__: action for action in (DeclareLaunchArgument, OpaqueFunction, IncludeLaunchDescription, TimerAction, Shutdown)}
    utilities = {"prefix_namespace": prefix_namespace, "make_namespace_absolute": lambda name: "/" + name.lstrip("/")}
    return {
        "launch": {"LaunchDescription": list},
        "launch.actions": actions,
        "launch.launch_description_sources": {"PythonLaunchDescriptionSource": Action},
        "launch.substitutions": {"LaunchConfiguration": LaunchConfiguration},
        "launch_ros": {},
        "launch_ros.actions": {"Node": Node},
        "launch_ros.utilities": utilities,
    }


for name, members in modules().items():
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__dict__.update(members)
CONTEXT.launch_configurations.update(argument.split(":=") for argument in sys.argv[2:])
run(sys.argv[1])
print(json.dumps({"arguments": ARGUMENTS, "nodes": NODES}))
