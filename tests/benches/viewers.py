"""Measures the effect of browsers on the servo: the jitter of its cycle without the page, with the page, and with ten viewers of which
one is frozen.

    unshare -r -n python3 tests/benches/viewers.py PROGRAM [ROUNDS]

Each round measures every case once, so that other load on the machine affects all cases equally.
"""
import base64
import json
import os
import socket
import statistics
import subprocess
import sys
import threading
import time

PROGRAM = sys.argv[1]
ROUNDS = int(sys.argv[2]) if len(sys.argv) > 2 else 5
WINDOW = 8.0
GOALS = ["-0.125 0.2 0.2 0 0 0 1".split(), "0.1 0.4 -0.1 0 0.38268343236509 0 0.92387953251129".split()]
PORT, TOKEN = 8123, "viewers-of-the-benchmark"


def network():
    for command in "ip link set lo up", "ip link set lo multicast on", "ip route add 224.0.0.0/4 dev lo":
        subprocess.run(command.split(), check=True)


def start(*arguments):
    return subprocess.Popen([PROGRAM, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)


class Viewer:
    """A browser that reads everything it receives, or nothing if it is frozen."""

    def __init__(self, frozen=False):
        self.socket = socket.create_connection(("127.0.0.1", PORT))
        if frozen:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            f"GET /session?token={TOKEN} HTTP/1.1\r\nHost: 127.0.0.1:{PORT}\r\nOrigin: http://127.0.0.1:{PORT}\r\nUpgrade: websocket\r\n"
            f"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n".encode()
        )
        self.bytes = 0
        if not frozen:
            threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        # For such a short time pings need no answer.
        while data := self.socket.recv(65536):
            self.bytes += len(data)

    def close(self):
        try:
            self.socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass  # It was dropped already.
        self.socket.close()


def jitter(goal):
    """p99 and maximum lateness of the servo's cycle [µs] during a motion to the goal and the rest of the window."""
    end = time.monotonic() + WINDOW
    subprocess.run([PROGRAM, "goal", *goal], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    time.sleep(max(0.0, end - time.monotonic()))
    output = subprocess.run([PROGRAM, "status", "--json"], stdout=subprocess.PIPE, check=True).stdout
    (servo,) = json.loads(output)
    return servo["cycle_jitter_p99_us"], servo["cycle_jitter_max_us"]


def main():
    network()
    os.environ.update(ROS_DOMAIN_ID="53", DQ_SERVO_VIEW_TOKEN=TOKEN)
    nodes = [start("puma560"), start("servo")]
    time.sleep(2)
    kinds = ["no page", "page", "ten viewers and a frozen one"]
    seen = {kind: [] for kind in kinds}
    try:
        for number in range(ROUNDS):
            for kind in kinds:
                page, viewers = None, []
                if kind != kinds[0]:
                    page = start("view")
                    page.stdout.readline()
                    time.sleep(0.5)
                if kind == kinds[2]:
                    viewers = [Viewer() for _ in range(10)] + [Viewer(frozen=True)]
                seen[kind].append(jitter(GOALS[number % 2]))
                read = [viewer.bytes for viewer in viewers[:10]]
                assert all(count > 50_000 for count in read), f"every viewer is served: {read}"
                for viewer in viewers:
                    viewer.close()
                if page:
                    page.terminate()
                    page.wait()
    finally:
        for node in nodes:
            node.terminate()
            node.wait()
    print("cycle jitter, median of the windows [µs]: p99, worst")
    for kind in kinds:
        p99, worst = zip(*seen[kind])
        print(f"{kind:32} {statistics.median(p99):8.0f} {statistics.median(worst):8.0f}   p99 of each: {[round(value) for value in p99]}")


main()
