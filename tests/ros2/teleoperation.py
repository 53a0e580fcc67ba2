"""Devices for teleoperation. Usage: teleoperation.py DEVICE ROUNDS. Each round holds the device still, moves it and lets go, and checks
that the arm moves and stops. Prints the latency from the device's first movement to the first joint command, and the time to stop."""

import contextlib
import json
import math
import os
import socket
import ssl
import struct
import sys
import threading
import time
from statistics import median

# A process with threads may not fork. numpy would start some.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped, TwistStamped
from sensor_msgs.msg import Joy
from std_msgs.msg import Float64MultiArray

RATE = 50
# Joint speeds below this are those of an arm at rest [rad/s].
REST = 1e-3
# What the servo said.
STATES = []


class Stick:
    """Publishes what teleop_twist_joy does."""

    def __init__(self, node):
        self.node, self.twists = node, node.create_publisher(TwistStamped, "dq_servo/target_twist", 1)

    def hold(self, moved):
        if moved:
            self.publish(math.copysign(0.05, moved))

    def publish(self, speed):
        twist = TwistStamped()
        twist.header.stamp, twist.twist.linear.y = self.node.get_clock().now().to_msg(), speed
        self.twists.publish(twist)

    def let_go(self):
        self.publish(0.0)

    def rest(self):
        pass


class Unplugged(Stick):
    """A stick that sends no twist of zero."""

    def let_go(self):
        pass


class Hand:
    """Publishes what a VR controller does."""

    def __init__(self, node):
        self.node, self.y = node, 0.0
        self.poses, self.buttons = node.create_publisher(PoseStamped, "hand_pose", 1), node.create_publisher(Joy, "joy", 1)

    def publish(self, pressed):
        pose = PoseStamped()
        pose.header.stamp, pose.pose.position.y = self.node.get_clock().now().to_msg(), self.y
        self.buttons.publish(Joy(buttons=[pressed]))
        self.poses.publish(pose)

    def hold(self, moved):
        self.y += moved
        self.publish(1)

    def rest(self):
        self.publish(0)

    let_go = rest


class Phone:
    """Sends what teleop's page sends."""

    def __init__(self, _):
        self.x, self.connection = 0.0, None

    def send(self, move):
        position, orientation = {"x": self.x, "y": 0, "z": 0}, {"w": 1, "x": 0, "y": 0, "z": 0}
        pose = {"move": move, "position": position, "orientation": orientation}
        self.connection.send(json.dumps({"type": "pose", "data": pose}))

    def hold(self, moved):
        self.x -= moved
        self.send(True)

    def rest(self):
        import websocket

        while self.connection is None or not self.connection.connected:
            try:
                self.connection = websocket.create_connection("wss://127.0.0.1:4443/ws", sslopt={"cert_reqs": ssl.CERT_NONE})
                threading.Thread(target=self.answer_pings, daemon=True).start()
            except OSError:
                time.sleep(0.1)
        self.send(False)

    def answer_pings(self):
        """Reads, as a browser does. Without an answer to its pings the server ends the connection after 40 s."""
        with contextlib.suppress(Exception):
            self.connection.recv()

    let_go = rest


class ClosedPhone(Phone):
    """A phone whose page is closed for 1.8 s."""

    closed_at = 0.0

    def rest(self):
        if time.monotonic() > self.closed_at + 1.8:
            super().rest()

    def let_go(self):
        self.connection.close()
        self.closed_at = time.monotonic()


class SpaceMouse:
    """Sends the reports of a SpaceMouse to stand_ins/easyhid.py."""

    def __init__(self, _):
        self.reports = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)

    def send(self, deflection):
        report = struct.pack("<B6h", 1, int(-350 * deflection), 0, 0, 0, 0, 0)
        self.reports.sendto(report, os.environ["SPACEMOUSE"])

    def hold(self, moved):
        if moved:
            self.send(math.copysign(0.5, moved))

    def let_go(self):
        self.send(0.0)

    def rest(self):
        pass


DEVICES = {"stick": Stick, "unplugged": Unplugged, "hand": Hand, "phone": Phone, "closed_phone": ClosedPhone, "spacemouse": SpaceMouse}


def play(seconds, step):
    """Calls `step` at the device's rate."""
    begin = time.monotonic()
    for number in range(int(seconds * RATE)):
        time.sleep(max(0.0, begin + number / RATE - time.monotonic()))
        step()


def listen():
    """Returns a node that spins in a thread, and its list of commands: when each arrived, and its fastest joint."""
    rclpy.init()
    node, commands = rclpy.create_node("watcher"), []
    take = lambda message: commands.append((time.monotonic(), max(map(abs, message.data))))
    node.create_subscription(Float64MultiArray, "forward_velocity_controller/commands", take, 10)
    node.create_subscription(DiagnosticStatus, "dq_servo/status", STATES.append, 10)
    return node, commands


def speed(commands, begin, end):
    return max((speed for at, speed in commands if begin < at < end), default=0.0)


def words():
    """Yields the status of the servo."""
    for status in STATES[-1:]:
        yield "state", status.message
        yield from ((pair.key, pair.value) for pair in status.values if "revoked" in pair.key or "reject" in pair.key)


def use(device, rounds):
    node, commands = listen()
    device = DEVICES[device](node)
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    time.sleep(2.0)
    latencies, stops = [], []
    for number in range(rounds):
        play(1.0, device.rest)
        play(0.7, lambda: device.hold(0.0))
        # The rounds differ from a whole number of cycles.
        time.sleep(0.0007 * (number % 3))
        begin, way = time.monotonic(), 1 if number % 2 == 0 else -1
        device.hold(way * 0.02)
        time.sleep(1.0 / RATE)
        play(0.5, lambda: device.hold(way * 0.001))
        end = time.monotonic()
        device.let_go()
        play(1.7, device.rest)
        now = time.monotonic()
        seen = [speed(commands, *span) for span in [(begin - 0.3, begin), (begin + 0.3, end), (now - 0.2, now)]]
        why = f"round {number}, the arm while the device is still, moves, and rests: {seen} rad/s; {dict(words())}"
        assert seen[0] < REST and seen[1] > 0.02 and seen[2] < REST, why
        latencies.append(next(at for at, speed in commands if at > begin and speed > REST) - begin)
        stops.append(max(at for at, speed in commands if speed > REST) - end)
        commands.clear()
    latency, stop = 1e3 * median(latencies), 1e3 * median(stops)
    print(f"latency {latency:.1f} ms, at most {1e3 * max(latencies):.1f}; at rest after {stop:.0f} ms, at most {1e3 * max(stops):.0f}")


def watch(presses):
    """Checks that the arm moves while the button of launch_scripts/simulated_device.py is pressed, and not otherwise."""
    node, commands = listen()
    pressed = []
    node.create_subscription(Joy, "joy", lambda message: pressed.append((time.monotonic(), message.buttons[0])), 10)
    edges = []
    while len(edges) < 2 * presses + 1:
        rclpy.spin_once(node, timeout_sec=1.0)
        edges = [after for before, after in zip(pressed, pressed[1:]) if before[1] != after[1]]
    for (begin, is_pressed), (end, _) in zip(edges, edges[1:]):
        # The first press may come before discovery.
        if is_pressed and begin > edges[1][0]:
            moving = speed(commands, begin + 0.3, end)
            assert moving > 0.02, f"the button is pressed, and the arm moves with {moving} rad/s only; {dict(words())}"
        elif not is_pressed:
            late = [(at - begin, speed) for at, speed in commands if begin + 0.7 < at < end and speed > REST]
            assert not late, f"the button is released, and the arm moves: {len(late)} commands from {late[0]} to {late[-1]}"


if __name__ == "__main__":
    device, rounds = sys.argv[1], int(sys.argv[2])
    watch(rounds) if device == "watch" else use(device, rounds)
    os._exit(0)
