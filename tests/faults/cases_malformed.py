"""Bytes that are not valid messages."""
import os
import random
import struct

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from peer import RELIABLE
from robot import COMMANDS
from watch import *


def spoilt_bytes(good, lengths):
    """Payloads that a decoder must reject: truncated, with huge lengths at the positions `lengths`, in other encodings, or random."""
    chance = random.Random(3)
    for keep in range(8, len(good), max(4, len(good) // 16 // 4 * 4)):
        yield good[:keep]
    for at in lengths:
        for length in (2**32 - 1, 2**31 - 1, 2**31, 2**24):
            yield good[:at] + struct.pack("<I", length) + good[at + 4 :]
    for encapsulation in (b"\x00\x00", b"\x00\x02", b"\x00\x03", b"\x00\x06", b"\x00\x0b", b"\xff\xff"):
        yield encapsulation + good[2:]
    for _ in range(32):
        yield b"\x00\x01\x00\x00" + bytes(chance.randrange(256) for _ in range(4 * chance.randrange(1, 40)))


MALFORMED = {
    # The topic, a valid sample, and the positions of lengths in its bytes after the encapsulation header and the stamp.
    "goal": ("rt/goal_pose", GOAL, [12]),
    "joint_state": ("rt/joint_states", ros.JointState(ros.Header(), ["a"], [1.0], [2.0]), [12, 20, 24, 32]),
    "command": (f"rt/{COMMANDS}", ros.Float64MultiArray(data=[0.0] * 6), [4, 12]),
    "parameters": ("rq/dq_servo/set_parametersRequest", ros.SET_PARAMETERS[0](parameters=[ros.Parameter("a")]), [4, 8]),
    "stop": ("rq/dq_servo/stopRequest", ros.TRIGGER[0](structure_needs_at_least_one_member=0), [4]),
}


def case_malformed():
    """Invalid bytes on every topic and service: no process ends, and the next valid message works."""
    for kind in MALFORMED:
        send_malformed(kind)
    run(1.2)
    assert STATUS.number("rejected") > 40, STATUS.told()
    assert DIAGNOSTICS.number(SERVO, "rejected.malformed") > 20, DIAGNOSTICS.by_name
    assert DIAGNOSTICS.number(PLANT, "rejected") > 10, DIAGNOSTICS.by_name
    set_parameter("controller", type=4, string_value="logc")
    goals = send_goal()
    settled()
    del goals


def send_malformed(kind):
    """Sent by another writer."""
    topic, sample, lengths = MALFORMED[kind]
    stranger = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    # Cyclone inspects what it writes, so the sample is declared as one byte, under the name of the type.
    byte = ros.make_idl_struct("Byte", type(sample).__idl_typename__, {"x": ros.uint8})
    out = DataWriter(stranger, Topic(stranger, topic, byte), qos=RELIABLE)
    wait_matched(out)
    good = bytes(sample.serialize())
    for number, data in enumerate(spoilt_bytes(good, lengths)):
        carrier = byte(0)
        carrier.serialize = lambda *_, data=data, **__: data
        out.write(carrier)
        if number % 8 == 0:
            run(0.01)
