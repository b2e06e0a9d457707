"""Runs of run_sequence over a drive, and their errors."""
import csv
import dataclasses
import json
import pathlib
import tempfile

import numpy

from . import poses, programs


@dataclasses.dataclass
class State:
    """What the odometry says of a pair; covariances are 6x6, m and rad."""
    state: str
    epoch: int
    moved: bool
    motion: numpy.ndarray
    pose: numpy.ndarray
    reason: str

    @property
    def has_pose(self):
        return self.state in ("TRACKING", "DEGRADED")


def read_states(path):
    with open(path) as file:
        rows = list(csv.reader(file))[1:]
    # A reason may have commas in it.
    return [State(row[2], int(row[3]), row[5] == "1", *(numpy.array(row[k:k + 36], float).reshape(6, 6) for k in (6, 42)),
                  ",".join(row[78:])) for row in rows]


@dataclasses.dataclass
class Run:
    """Of one drive: poses, a State and a row of the timing file for each pair, and what run_sequence printed."""
    poses: numpy.ndarray
    states: list
    timing: list
    said: str


def run(directory, *arguments, tools=programs.TOOLS):
    with tempfile.TemporaryDirectory() as work:
        estimate, states, timing = (pathlib.Path(work) / name for name in ("poses.txt", "states.csv", "timing.csv"))
        said = programs.run("run_sequence", directory, "--poses", estimate, "--states", states, "--timing", timing, *arguments,
                            tools=tools)
        with open(timing) as file:
            return Run(poses.read(estimate), read_states(states), list(csv.DictReader(file)), said)


MATTERS = (0.01, 0.03)  # m, and a ratio of the distance: a motion's error that matters
BEYOND = 5  # standard deviations


def motion_errors(run, truth):
    """Of pairs that are TRACKING: the motion's error in standard deviations, and whether it exceeds BEYOND and matters."""
    for i, state in enumerate(run.states[1:], 1):
        if state.moved and state.state == "TRACKING":
            motion, true = (poses.relative(stack[i - 1], stack[i]) for stack in (run.poses, truth))
            error = poses.logarithm(poses.relative(motion, true))
            sigmas = max(poses.sigmas(error, state.motion))
            matters = numpy.linalg.norm(error[:3]) > MATTERS[0] + MATTERS[1] * numpy.linalg.norm(true[:3, 3])
            yield sigmas, bool(matters and sigmas > BEYOND)


def errors(truth, estimate, lengths):
    """What evaluate_trajectory writes of poses, each a file or a stack of them, as a dictionary."""
    with tempfile.TemporaryDirectory() as work:
        def file(given, name):
            if not isinstance(given, numpy.ndarray):
                return given
            poses.write(pathlib.Path(work) / name, given)
            return pathlib.Path(work) / name

        result = pathlib.Path(work) / "errors.json"
        truth, estimate = file(truth, "truth.txt"), file(estimate, "poses.txt")
        programs.run("evaluate_trajectory", "--ground-truth", truth, "--estimate", estimate, "--lengths", lengths, "--json", result)
        return json.loads(result.read_text())
