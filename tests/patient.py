#!/usr/bin/env python3
"""Runs `cargo test` with these arguments. A busy host lets its guests stand still for tenths of a second, and then what needs real
time fails: the tests that failed while this machine stood still are run again once it goes on, twice at most. What fails on a machine
that goes on is a failure."""

import os
import re
import subprocess
import sys
import threading
import time

# How often the watch wakes [s], and how late it is when the machine has stood still.
STEP, LATE = 0.01, 0.03
# The part of its time, and the least time [s], for which the machine stands still under tests that may be run again.
PART, LEAST = 0.01, 0.1
# For so long [s] it must go on before they are, and for no longer is that waited for.
QUIET, LONGEST_WAIT = 3.0, 600.0
ATTEMPTS = 3


def stolen():
    """For how long [s] the host has kept a core of this machine from running what it wanted to run."""
    with open("/proc/stat") as counts:
        return int(counts.readline().split()[8]) / os.sysconf("SC_CLK_TCK") / os.cpu_count()


class Watch:
    """Wakes all the time, and notes for how long the machine stood still [s], and when it last did."""

    def __init__(self):
        self.stood = self.last = 0.0
        threading.Thread(target=self.run, daemon=True).start()

    def run(self):
        try:
            # Before these tests, which keep the cores busy themselves: what it waits for is the host.
            os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(1))
        except PermissionError:
            pass
        before = time.monotonic()
        while True:
            time.sleep(STEP)
            now = time.monotonic()
            if now - before - STEP > LATE:
                self.stood, self.last = self.stood + now - before - STEP, now
            before = now

    def lost(self):
        """For how long [s] so far it stood still, and for how long by the host's own word, which knows of small pieces too."""
        return self.stood, stolen()

    def wait_until_quiet(self):
        begin = time.monotonic()
        while time.monotonic() < min(begin + LONGEST_WAIT, max(begin, self.last) + QUIET):
            time.sleep(0.1)


class Target:
    """What ran of one of cargo's targets: the tests that failed, and for what part of the time the machine stood still."""

    def __init__(self, watch):
        self.watch, self.begun, self.lost_before = watch, time.monotonic(), watch.lost()
        self.stood, self.failed, self.ended = 0.0, [], False

    def take(self, line):
        if test := re.match(r"test (\S+)(?: - should panic)? \.\.\. FAILED$", line):
            self.failed.append(test[1])
        self.ended |= line.startswith("test result:")
        lost = max(now - before for now, before in zip(self.watch.lost(), self.lost_before))
        self.stood = lost / (time.monotonic() - self.begun) if lost > LEAST else 0.0


def run(watch, arguments, names=()):
    """The exit code of cargo, and its targets that failed."""
    command = ["cargo", "test", *arguments, "--no-fail-fast", *(["--", "--exact", *names] if names else [])]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    targets, target, failed = {}, Target(watch), {}
    for line in process.stdout:
        print(line, end="", flush=True)
        if running := re.match(r"\s+Running (?:unittests src/(lib)\.rs|tests/(\w+)/main\.rs) ", line):
            target = targets["--lib" if running[1] else f"--test {running[2]}"] = Target(watch)
        elif re.match(r"\s+(Running|Doc-tests) ", line):
            target = Target(watch)
        elif named := re.match(r"    `(--[^`]*)`$", line):
            failed[named[1]] = targets.get(named[1])
        target.take(line)
    return process.wait(), failed


def passes_again(watch, arguments, name, target):
    """Whether the tests of a target that failed while the machine stood still pass when it does not."""
    for _ in range(1, ATTEMPTS):
        # One that crashed may have more to report than the tests that it names.
        if target is None or not target.ended or not target.failed or target.stood < PART:
            return False
        print(f"\nin {name} this machine stood still for {target.stood:.0%} of the time: once more {target.failed}\n", flush=True)
        watch.wait_until_quiet()
        only = [] if "--test" in arguments else name.split()
        code, failed = run(watch, [*arguments, *only], target.failed)
        if code == 0:
            return True
        target = failed.get(name)
    return False


def main():
    watch, arguments = Watch(), sys.argv[1:]
    code, failed = run(watch, arguments)
    if failed and all(passes_again(watch, arguments, *each) for each in failed.items()):
        print("all that had failed has passed", flush=True)
        code = 0
    sys.exit(1 if code else 0)


main()
