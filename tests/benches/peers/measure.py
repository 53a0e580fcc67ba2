"""Measures the control step of this program and of other libraries: measure.py FILE NAME=COMMAND..., this program first.

Each library runs as a process on the same core. The processes are measured in turn, task by task in each round, so that other load on the
machine affects all of them equally. Before that, the poses and Jacobians of all libraries must agree with this program's, in one of its
two forms. Prints a table and writes FILE.
"""

import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys

import numpy

ROUNDS, COUNT, TOLERANCE = 40, 1024, 1e-9


class Peer:
    def __init__(self, command, inputs):
        self.process = subprocess.Popen(
            [*command.split(), inputs], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, question):
        self.process.stdin.write(question + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            sys.exit(f"{self.process.args[0]} gave no answer to {question!r}")
        return answer.split()

    def poses_and_jacobians(self):
        return numpy.array([float(number) for number in self.ask("check")]).reshape(COUNT, -1)


def disagreement(theirs, ours):
    """The largest difference. A pose of eight numbers may have the opposite sign, and then its Jacobian has the opposite sign too."""
    if theirs.shape[1] == 56:
        sign = numpy.sign((theirs[:, :4] * ours[:, :4]).sum(axis=1, keepdims=True))
        theirs = theirs * sign
    return numpy.abs(theirs - ours).max()


def main():
    file, commands = pathlib.Path(sys.argv[1]), dict(argument.split("=", 1) for argument in sys.argv[2:])
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    inputs = file.with_suffix(".inputs")
    numpy.savetxt(inputs, numpy.random.default_rng(0).uniform(-numpy.pi, numpy.pi, (COUNT, 12)), fmt="%.17g")
    peers = {name: Peer(command, str(inputs)) for name, command in commands.items()}
    forms = [peers["ours"].poses_and_jacobians(), peers.pop("ours, as twists").poses_and_jacobians()]
    for name, peer in peers.items():
        theirs = peer.poses_and_jacobians()
        apart = [disagreement(theirs, form) for form in forms if form.shape == theirs.shape]
        if not apart or not apart[0] < TOLERANCE:
            sys.exit(f"{name} gives other poses or Jacobians than ours: {apart} apart, of {theirs.shape[1]} numbers")
    tasks = {name: peer.ask("tasks") for name, peer in peers.items()}
    samples = {(name, task): [] for name in peers for task in tasks[name]}
    for _ in range(ROUNDS):
        for task in tasks["ours"]:
            for name in (name for name in peers if task in tasks[name]):
                samples[name, task].append(float(peers[name].ask(task)[0]))
    ns = {name: {task: statistics.median(samples[name, task]) for task in tasks[name]} for name in peers}
    # Round by round, so that a slow phase of the machine affects both.
    quotient = lambda name, task: statistics.median(
        ours / theirs for ours, theirs in zip(samples["ours", task], samples[name, task])
    )
    ratios = {name: {task: round(quotient(name, task), 4) for task in tasks[name]} for name in peers if name != "ours"}
    machine = next(line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name"))
    loads = os.getloadavg()
    versions = json.loads(os.environ["PEER_VERSIONS"])
    result = {"ratios": ratios, "ns": ns, "machine": f"{machine}, {os.cpu_count()} cores, {platform.release()}", "load": loads, "versions": versions}
    file.write_text(json.dumps(result, indent=2) + "\n")
    inputs.unlink()
    print("| ns (ours by theirs) | " + " | ".join(tasks["ours"]) + " |")
    print("|---" * (len(tasks["ours"]) + 1) + "|")
    for name in peers:
        cell = lambda task: f"{ns[name][task]:.0f}" + (f" ({ratios[name][task]:.2f})" if name in ratios else "")
        print(f"| {name} | " + " | ".join(cell(task) if task in tasks[name] else "–" for task in tasks["ours"]) + " |")


if __name__ == "__main__":
    main()
