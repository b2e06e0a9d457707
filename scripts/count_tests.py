#!/usr/bin/env python3
"""Counts test cases in JUnit files and ends with one line: N passed, N failed, N skipped. Exits 1 on any failure."""
import argparse
import pathlib
import sys
import xml.etree.ElementTree as ElementTree


def outcome(case):
    if case.find("failure") is not None or case.find("error") is not None:
        return "failed"
    if case.find("skipped") is not None or case.get("result") == "skipped" or case.get("status") == "notrun":
        return "skipped"
    return "passed"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", type=pathlib.Path, help="folder with the JUnit files")
    parser.add_argument("--passed", action="append", default=[], help="a check beside the JUnit files that passed")
    parser.add_argument("--failed", action="append", default=[], help="a check beside the JUnit files that failed")
    arguments = parser.parse_args()

    counts = {"passed": len(arguments.passed), "failed": len(arguments.failed), "skipped": 0}
    bad = list(arguments.failed)
    for path in sorted(arguments.directory.rglob("*.xml")):
        try:
            cases = list(ElementTree.parse(path).getroot().iter("testcase"))
        except ElementTree.ParseError as error:
            counts["failed"] += 1
            bad.append(f"{path.name}: {error}")
            continue
        for case in cases:
            result = outcome(case)
            counts[result] += 1
            if result != "passed":
                print(f"{result.upper()}: {case.get('classname')}.{case.get('name')} ({path.name})")
    if sum(counts.values()) == 0:
        bad.append("no test ran")
    for name in bad:
        print(f"FAILED: {name}")
    print("{passed} passed, {failed} failed, {skipped} skipped".format(**counts))
    return 1 if bad or counts["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
