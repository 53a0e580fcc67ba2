"""Faults that a DDS implementation of another vendor can cause, and the required reactions of servo and plant.
Usage: faults.py CASE OUT [ARGUMENT …]. Fails with an exception. Writes to OUT every command that the servo sent in the meantime."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "dds"))
import cases_goals
import cases_joint_states
import cases_malformed
import cases_network
import cases_processes
import cases_topics
from watch import SENT

ROOMS = (cases_goals, cases_joint_states, cases_malformed, cases_network, cases_processes, cases_topics)

if __name__ == "__main__":
    [case] = [vars(room)[f"case_{sys.argv[1]}"] for room in ROOMS if f"case_{sys.argv[1]}" in vars(room)]
    # The record begins with a new servo, as soon as the record has a subscriber; a servo started by a script has no record.
    SENT.wait_for_record(2.0)
    case(*sys.argv[3:])
    SENT.write(sys.argv[2])
