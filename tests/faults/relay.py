"""Simulates a bad network between two hosts: passes Ethernet frames from one interface to the other, and loses, delays, duplicates or
reorders some of them. It replaces `tc netem`, which not every kernel has. SIGUSR1 cuts the network, and the next SIGUSR1 restores it.
Usage: relay.py LOSS DELAY JITTER DUPLICATE. LOSS and DUPLICATE are fractions of 1, DELAY and JITTER are in seconds. The interfaces are
to_a and to_b."""
import heapq
import random
import select
import signal
import socket
import sys
import time

ETH_P_ALL = 3
SOL_PACKET, PACKET_VNET_HDR, PACKET_IGNORE_OUTGOING = 263, 15, 23


def port(name):
    end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0)
    # Each frame has a header that tells whether its checksum is still to be computed: the kernel leaves that to the "hardware".
    end.setsockopt(SOL_PACKET, PACKET_VNET_HDR, 1)
    end.setsockopt(SOL_PACKET, PACKET_IGNORE_OUTGOING, 1)
    end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
    end.bind((name, ETH_P_ALL))
    end.setblocking(False)
    return end


LOSS, DELAY, JITTER, DUPLICATE = map(float, sys.argv[1:])
ENDS = [port("to_a"), port("to_b")]
CHANCE, QUEUE = random.Random(4), []
CUT = False


def toggle(*_):
    global CUT
    CUT = not CUT


def accept(source, target):
    while True:
        try:
            frame = source.recv(65536)
        except BlockingIOError:
            return
        for _ in range(2 if CHANCE.random() < DUPLICATE else 1):
            if not CUT and CHANCE.random() >= LOSS:
                due = time.monotonic() + DELAY + CHANCE.uniform(-JITTER, JITTER)
                heapq.heappush(QUEUE, (due, CHANCE.random(), target, frame))


def deliver():
    while QUEUE and QUEUE[0][0] <= time.monotonic():
        _, _, target, frame = heapq.heappop(QUEUE)
        try:
            ENDS[target].send(frame)
        except (BlockingIOError, OSError):
            pass  # A full queue loses frames, as in any network.


signal.signal(signal.SIGUSR1, toggle)
print("up", flush=True)
while True:
    patience = max(0.0, QUEUE[0][0] - time.monotonic()) if QUEUE else 1.0
    ready, _, _ = select.select(ENDS, [], [], patience)
    for end in ready:
        accept(end, 1 - ENDS.index(end))
    deliver()
