#!/usr/bin/env python3
"""Lists the tests that passed only after a retry. Usage: retried.py JUNIT_XML"""
import sys
from xml.etree import ElementTree

cases = ElementTree.parse(sys.argv[1]).iter("testcase")
retried = [f"{case.get('classname')} {case.get('name')}" for case in cases if case.find("flakyFailure") is not None]
print(f"passed only when run again: {len(retried)}", *retried, sep="\n")
