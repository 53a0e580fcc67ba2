"""Makes robot descriptions without meshes and masses: the links and joints of the URDF files in example-robot-data 6.0.0 from PyPI.
Run: python3 -m venv v && v/bin/pip install example-robot-data && v/bin/python make.py"""
import sys
import xml.etree.ElementTree as xml
from pathlib import Path

ROBOTS = Path(next(p for p in sys.path if p.endswith("site-packages"))) / "cmeel.prefix/share/example-robot-data/robots"
FILES = {
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "panda": "panda_description/urdf/panda.urdf",
    "xarm7": "xarm_description/urdf/xarm7.urdf",
    "tiago": "tiago_description/robots/tiago_no_hand.urdf",
    "baxter": "baxter_description/urdf/baxter.urdf",
}
KEPT = {"origin", "parent", "child", "axis", "limit", "mimic"}

for name, file in FILES.items():
    robot = xml.parse(ROBOTS / file).getroot()
    for child in list(robot):
        if child.tag not in ("link", "joint"):
            robot.remove(child)
            continue
        for part in list(child):
            if child.tag == "link" or part.tag not in KEPT:
                child.remove(part)
            part.text = part.tail = None
        child.text = child.tail = None
    xml.indent(robot, " ")
    Path(__file__).with_name(f"{name}.urdf").write_text(xml.tostring(robot, encoding="unicode") + "\n")
