"""A browser on the page of a secured view: `viewer.py PORT TOKEN`. Sends a goal and waits until the arm has settled there. Fails with an
exception."""
import base64
import json
import os
import socket
import sys
import time

PORT, TOKEN = int(sys.argv[1]), sys.argv[2]
GOAL = {"position": [-0.125, 0.2, 0.2], "orientation": [0.0, 0.0, 0.0, 1.0]}
END = time.monotonic() + 60

connection = socket.create_connection(("127.0.0.1", PORT), timeout=20)
connection.sendall(
    f"GET /session?token={TOKEN} HTTP/1.1\r\nHost: 127.0.0.1:{PORT}\r\nOrigin: http://127.0.0.1:{PORT}\r\nUpgrade: websocket\r\n"
    f"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}\r\n\r\n".encode()
)
stream = connection.makefile("rb")
assert b"101" in stream.readline()
while stream.readline().strip():
    pass


def frame():
    """The next text message as JSON. Other messages are skipped."""
    while True:
        assert time.monotonic() < END, "a minute is over"
        kind, length = stream.read(2)
        if length == 126:
            length = int.from_bytes(stream.read(2), "big")
        elif length == 127:
            length = int.from_bytes(stream.read(8), "big")
        data = stream.read(length)
        if kind & 15 == 1:
            return json.loads(data)


def ask(number, what):
    data, mask = json.dumps({"id": number, "ask": what}).encode(), os.urandom(4)
    assert len(data) < 65536
    masked = bytes(byte ^ mask[i % 4] for i, byte in enumerate(data))
    size = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + len(data).to_bytes(2, "big")
    connection.sendall(b"\x81" + size + mask + masked)
    while True:
        answer = frame().get("answer")
        if answer and answer["id"] == number:
            return answer


def until(condition):
    while True:
        now = frame().get("now")
        if now and now["alive"] and condition(now["servo"]):
            return now


until(lambda servo: servo["state"] in ("holding", "tracking", "settled"))
while "not known yet" in (answer := ask(1, {"set": {"name": "gains.logc", "value": [1.0, 2.0]}}))["text"]:
    time.sleep(0.2)
assert answer["ok"], answer
assert ask(2, {"goal": GOAL})["ok"]
there = until(lambda servo: servo["state"] == "settled" and servo["goal"] and abs(servo["goal"][0] + 0.125) < 1e-9)
assert all(abs(a - b) < 2e-3 for a, b in zip(there["tool"], GOAL["position"])), there
assert ask(3, "stop")["ok"] and ask(4, "reset")["ok"]
