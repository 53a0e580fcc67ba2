"""DQ Robotics from PyPI, used from Python: answers the requests of measure.py."""

import sys
import time

import numpy
from dqrobotics import vec8
from dqrobotics.robot_modeling import DQ_SerialManipulatorMDH

HALF_PI = numpy.pi / 2
ARM = DQ_SerialManipulatorMDH(
    numpy.array(
        [
            [0] * 6,
            [0, 0, 0.125, 0.432, 0, 0],
            [0, 0, 0.4318, 0.019, 0, 0],
            [0, -HALF_PI, 0, -HALF_PI, HALF_PI, -HALF_PI],
            [0] * 6,
        ]
    )
)
STARTS = [row[:6].copy() for row in numpy.loadtxt(sys.argv[1])]
TASKS = {"kinematics": ARM.fkm, "pose_jacobian": ARM.pose_jacobian}

for question in sys.stdin:
    question = question.strip()
    if question == "tasks":
        print(*TASKS, flush=True)
    elif question == "check":
        numbers = [[*vec8(ARM.fkm(start)), *ARM.pose_jacobian(start).T.flatten()] for start in STARTS]
        print(*[repr(float(x)) for row in numbers for x in row], flush=True)
    else:
        task, total = TASKS[question], 0
        # Each configuration counts by its shortest time, so that interruptions do not count.
        for start in STARTS:
            times = []
            for _ in range(4):
                begin = time.perf_counter_ns()
                task(start)
                times.append(time.perf_counter_ns() - begin)
            total += min(times)
        print(total / len(STARTS), flush=True)
