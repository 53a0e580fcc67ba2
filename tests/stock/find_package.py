"""Finds what `ros2 run dq_servo dq_servo --version` and `ros2 launch dq_servo NAME` need, by the index of ament in AMENT_PREFIX_PATH."""

import json
import os
import pathlib
import subprocess
import sys
import xml.etree.ElementTree as xml

LAUNCH_FILES = pathlib.Path(__file__).with_name("launch_files.py")

prefixes = [pathlib.Path(p) for p in os.environ["AMENT_PREFIX_PATH"].split(":")]
[prefix] = [p for p in prefixes if (p / "share/ament_index/resource_index/packages/dq_servo").is_file()]
share = prefix / "share/dq_servo"
manifest = xml.parse(share / "package.xml").getroot()
assert manifest.find("name").text == "dq_servo" and manifest.find("license").text == "Apache-2.0"
program = prefix / "lib/dq_servo/dq_servo"
version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout
assert version.split() == ["dq_servo", manifest.find("version").text], version

# `rviz2 -d $(ros2 pkg prefix --share dq_servo)/rviz/dq_servo.rviz`, and the arms of the box for params_file.
assert (share / "rviz/dq_servo.rviz").is_file()
arms = sorted(file.stem for file in (share / "msg_config/arms").iterdir())
assert "ur5e" in arms and len(arms) == 8, arms

for name in ("dq_servo.launch.py", "dq_dual_servo.launch.py"):
    [file] = [pathlib.Path(folder) / name for folder, _, files in os.walk(share) if name in files]
    launched = subprocess.run([sys.executable, LAUNCH_FILES, file], check=True, capture_output=True, text=True).stdout
    defaults = json.loads(launched)["arguments"]
    assert os.path.samefile(defaults["program"], program), defaults
    params_file = defaults["params_file"]
    assert not params_file or os.path.samefile(params_file, share / "msg_config" / pathlib.Path(params_file).name), defaults
