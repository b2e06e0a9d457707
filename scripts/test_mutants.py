#!/usr/bin/env python3
"""Makes small mistakes in a copy of the package, one at a time, and sees whether a test notices.

    scripts/test_mutants.py --changed main             # in the lines that differ from a branch
    scripts/test_mutants.py src/odometry/local_map.cpp # in a file; :120-140 after it: in these lines
    scripts/test_mutants.py --sample 300 --seed 7      # drawn at random over all sources
    scripts/test_mutants.py --semantic                 # the mistakes of thought in test/semantic_mutants.yaml

The operators are those of scripts/mutation_operators.py. The tests that reach the file by what they include are asked until
one fails: first the nearest gtests for all mutants, then the others for those that nobody noticed, several at once, as only
the mutant's library is linked anew. Tests of programs follow one by one, ROS tests for src/ros and test/check_camera_check for
src/check and src/tools; one of these two has to fail twice. A mutant is equivalent where the compiler makes the same code of
it, as of lines for other processors, or by test/equivalent_mutants.yaml, which names changes that no test could see. The copy
and its own catkin workspace lie in .catkin_ws/mutants and are kept. Each time mutants are judged in the order drawn, and
report.md there has the table so far: what a stopped run judged is a random sample.
Exit code 1 when fewer than --least per cent are caught, or any of the semantic ones is not.
"""
import argparse
import collections
import concurrent.futures
import json
import math
import os
import pathlib
import queue
import random
import re
import shlex
import shutil
import subprocess
import sys
import threading
import time

import yaml

from mutation_operators import Mutant, mutants

ROOT = pathlib.Path(__file__).resolve().parent.parent
WORK = ROOT / '.catkin_ws' / 'mutants'
PACKAGE = WORK / 'package'
WORKSPACE = PACKAGE / '.catkin_ws'  # as the package's own: ccache then has the objects of scripts/build
BUILD, BINARIES = WORKSPACE / 'build', WORKSPACE / 'devel' / 'lib' / 'stereo_descriptor_vo'
JOBS = int(os.environ.get('JOBS', str(os.cpu_count())))
SLOW = 10  # times as long as without a mutant, and a test counts as failed: it hangs
BATCH = 1 if JOBS == 1 else 20  # mutants, after which the report is written
NEAR = 2  # steps: the test includes the header that the file implements, or has its name
SLOW_LIMIT = 1800  # s, beyond the time limits in test/ros/*.test, which end the nodes as well

# What a rendered world looks like is a matter of taste: its numbers are no mistakes, and it has a row of its own.
SCENERY = re.compile(r'src/render/(building_site|foliage|gardens|ground_map|houses|street_\w+|texture\w*|trees|vehicles|\w+_world)\.cpp')
# ROS tests and checks, which take minutes: the rooms whose mutants they are asked for, and the sources that they run.
SLOW_TESTS = {
    'ros/nouns.test': (('ros', ), 'test/ros/rostest_*.cpp'),
    'ros/places.test': (('ros', ), 'src/ros/place_recognition_nodelet.cpp'),
    'ros/split.test': (('ros', ), 'src/ros/*_nodelet.cpp'),
    'ros/faults.test': (('ros', ), 'src/ros/*_nodelet.cpp'),
    'ros/live.test': (('ros', ), 'src/ros/*_nodelet.cpp'),
    'check_camera_check': (('check', 'tools'), 'src/tools/check_camera.cpp'),
}
GTESTS = {'test_tools': 'src/tools/*.cpp'}  # sources that a gtest reaches and does not include


class NotBuilt(Exception):
    pass


class Equivalent(Exception):
    pass


def code(path, folder):
    """What an object file has but for the name of its source."""
    stripped = folder / 'stripped.o'
    subprocess.run(['objcopy', '--strip-unneeded', path, stripped], check=True)
    return stripped.read_bytes()


def run(command, log, timeout=None, **keywords):
    """Whether the command succeeds in time; its output goes to a file."""
    with open(log, 'w') as file:
        try:
            return subprocess.run(command, stdout=file, stderr=subprocess.STDOUT, timeout=timeout, **keywords).returncode == 0
        except subprocess.TimeoutExpired:
            return False


def replace(path, text):
    """Writes what differs: an unchanged file is not built again."""
    if path.read_text() != text:
        path.write_text(text)


class Sources:
    """Which sources a test reaches: what it includes, what implements that, and so on."""

    def __init__(self):
        self._files = [path.relative_to(ROOT) for folder in ('include', 'src', 'test', 'examples')
                       for path in (ROOT / folder).rglob('*.[ch]pp')]
        known = set(self._files)
        self._next = {}
        own = collections.defaultdict(set)  # the sources of a header: they have its name or include it first
        for path in self._files:
            included = []
            for name in re.findall(r'^#include [<"]([^>"]+)[>"]', (ROOT / path).read_text(), re.MULTILINE):
                for folder in (pathlib.Path('include'), path.parent, pathlib.Path('src'), pathlib.Path('test')):
                    found = pathlib.Path(os.path.normpath(folder / name))
                    if found in known:
                        included.append(found)
                        break
            self._next[path] = included
            if path.suffix == '.cpp' and path.parts[0] == 'src' and included:
                own[next((header for header in included if header.stem == path.stem), included[0])].add(path)
        for header, sources in own.items():
            self._next[header] = self._next[header] + sorted(sources)

    def distances(self, pattern):
        """Steps from the files of a test to all that it reaches."""
        steps = {path: 0 for path in self._files if path.match(pattern)}
        todo = collections.deque(steps)
        while todo:
            path = todo.popleft()
            for following in self._next[path]:
                if following not in steps:
                    steps[following] = steps[path] + 1
                    todo.append(following)
        return steps


class Workspace:
    """The copy of the package, of which only what the tests need is built, and these."""

    def __init__(self):
        WORK.mkdir(parents=True, exist_ok=True)
        self._copy_package()
        print('Configuring …', flush=True)
        arguments = ['-DCMAKE_LINK_DEPENDS_NO_SHARED=ON', '-DCMAKE_EXPORT_COMPILE_COMMANDS=ON', '--force-cmake',
                     'stereo_descriptor_vo_generate_messages_cpp']
        if shutil.which('ccache'):
            arguments.insert(0, '-DCMAKE_CXX_COMPILER_LAUNCHER=ccache')
        if not run([PACKAGE / 'scripts' / 'build', *arguments], WORK / 'build.log', env=dict(os.environ, WORKSPACE=str(WORKSPACE))):
            sys.exit(f'error: the package cannot be configured, see {WORK / "build.log"}')
        self._commands = {os.path.relpath(os.path.realpath(entry['file']), PACKAGE): entry
                          for entry in json.loads((BUILD / 'compile_commands.json').read_text())}
        self._sources = Sources()
        self._reach = {name: self._sources.distances(GTESTS.get(name, f'test/*/{name}.cpp')) for name in self._targets('test_')}
        self.seconds = {}  # of a test without a mutant; infinite for a slow one that fails then
        self._lock = threading.Lock()

    @staticmethod
    def _copy_package():
        """What git knows of the package and what it does not ignore; unchanged files keep their time and are not built."""
        listing = subprocess.run(['git', 'ls-files', '-z', '--cached', '--others', '--exclude-standard'], cwd=ROOT, check=True,
                                 stdout=subprocess.PIPE).stdout.decode()
        files = {name for name in listing.split('\0') if name and (ROOT / name).is_file()}
        for old in [f for f in PACKAGE.rglob('*') if f.is_file() and WORKSPACE not in f.parents]:
            if str(old.relative_to(PACKAGE)) not in files:
                old.unlink()
        for name in files:
            source, target = ROOT / name, PACKAGE / name
            if target.exists() and source.read_bytes() == target.read_bytes():
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)

    @staticmethod
    def _targets(prefix):
        listing = subprocess.run(['make', 'help'], cwd=BUILD, check=True, stdout=subprocess.PIPE).stdout.decode()
        return sorted(set(re.findall(rf'^\.\.\. ({prefix}\w+)$', listing, re.MULTILINE)))

    def tests(self, file, near):
        """The gtests that reach a file and are near it, or are not; the quickest first."""
        path = pathlib.Path(file)
        reached = {name: steps[path] for name, steps in self._reach.items()
                   if path in steps and (steps[path] <= NEAR or name == f'test_{path.stem}') == near and self._links(name, file)}
        return sorted(reached, key=lambda name: (name not in self.seconds, self.seconds.get(name, 0.0), reached[name], name))

    def measure(self, name):
        """Builds a gtest where it was not asked yet, and notes how long it takes as things are, which it has to pass."""
        with self._lock:
            if name in self.seconds:
                return
            if not run(['make', '-j', str(JOBS), name], WORK / 'build.log', cwd=BUILD):
                sys.exit(f'error: {name} does not build, see {WORK / "build.log"}')
            begin = time.monotonic()
            if not run([BINARIES / name], WORK / 'test.log', cwd=WORK):
                sys.exit(f'error: {name} fails without any mutant, see {WORK / "test.log"}')
            self.seconds[name] = time.monotonic() - begin

    def passes(self, name, folder, environment, program):
        # Each has a home of its own: two mutants at once must not meet in files or under a name of ROS.
        environment = dict(os.environ, GTEST_FAIL_FAST='1', **environment)
        return run([program], folder / 'test.log', timeout=5 + SLOW * self.seconds[name], cwd=folder, env=environment)

    def library_of(self, file):
        """The folder of the target that has the file, and whether that is a 'shared' or a 'static' library, or None."""
        entry = self._commands.get(file)
        if entry is None:
            return None, None
        target = re.search(r'-o (\S*CMakeFiles/(\w+)\.dir)/', entry['command'])
        folder = pathlib.Path(entry['directory']) / target[1]
        link = (folder / 'link.txt').read_text()
        if ' -shared ' in link:
            return folder, None if target[2].endswith(('_nodelets', '_examples')) else 'shared'
        return folder, 'static' if ' qc ' in link else None

    def _links(self, name, file):
        """False where what a gtest includes is in a static library that it does without."""
        target, kind = self.library_of(file)
        if kind != 'static' or name == 'test_tools':
            return True
        return f'lib{target.stem}.a' in (target.with_name(f'{name}.dir') / 'link.txt').read_text()

    def is_beside(self, file, name):
        """Whether a gtest can be asked without a change to the workspace: what test_tools runs has static libraries inside."""
        kind = self.library_of(file)[1]
        return kind == 'shared' or (kind == 'static' and name != 'test_tools')

    def _compile(self, file, text, output):
        """Text in place of a source's, compiled as that is; the workspace stays as it is."""
        entry = self._commands[file]
        # Beside the original, for its includes; no other mutant has this name.
        source = (PACKAGE / file).with_name(f'mutant_{output.parent.name}.cpp')
        source.write_text(text)
        try:
            command = shlex.split(entry['command'])
            command[command.index('-o') + 1] = str(output)
            command[command.index('-c') + 1] = str(source)
            if not run(command, output.with_suffix('.log'), cwd=entry['directory']):
                raise NotBuilt
        finally:
            source.unlink()

    def _original_object(self, file):
        command = shlex.split(self._commands[file]['command'])
        return command[command.index('-o') + 1]

    def _link(self, target, output, changed, folder):
        """What a target's folder links, made elsewhere, by a command that was changed before."""
        link = shlex.split((target / 'link.txt').read_text())
        link[link.index('-o') + 1] = str(output)
        if not run(changed(link), folder / 'make.log', cwd=target.parent.parent):
            raise NotBuilt
        return output

    def _mutated_object(self, mutant, folder):
        self._compile(mutant.file, mutant.applied((PACKAGE / mutant.file).read_text()), folder / 'mutant.o')
        original = pathlib.Path(self._commands[mutant.file]['directory']) / self._original_object(mutant.file)
        if code(folder / 'mutant.o', folder) == code(original, folder):
            raise Equivalent
        return str(folder / 'mutant.o')

    def judge_beside(self, mutant, folder, near):
        """The gtest that notices a mutant of a library, which is loaded or linked before the library's own; or None."""
        target, kind = self.library_of(mutant.file)
        original = self._original_object(mutant.file)
        mutated, environment = None, {}
        for name in self.tests(mutant.file, near):
            if not self.is_beside(mutant.file, name):
                continue
            self.measure(name)  # the first one makes the library's other objects
            if mutated is None:
                mutated = self._mutated_object(mutant, folder)
                if kind == 'shared':
                    library = self._link(target, folder / 'mutated.so', lambda link: [mutated if arg == original else arg for arg in link],
                                         folder)
                    environment = {'LD_PRELOAD': str(library)}
            program = BINARIES / name
            if kind == 'static':
                program = self._link(target.with_name(f'{name}.dir'), folder / name, lambda link: [link[0], mutated] + link[1:], folder)
            if not self.passes(name, folder, environment, program):
                return name
        return None

    def judge_in_place(self, mutant, folder, quick):
        """The test that notices a mutant in the workspace itself, of those that cannot be asked beside it, or None."""
        path = PACKAGE / mutant.file
        original = path.read_text()
        names = self.tests(mutant.file, near=True) + ([] if quick else self.tests(mutant.file, near=False))
        try:
            for name in [name for name in names if not self.is_beside(mutant.file, name)]:
                if name not in self.seconds:
                    replace(path, original)
                    self.measure(name)
                replace(path, mutant.applied(original))
                self._make(name, folder)
                if not self.passes(name, folder, {}, BINARIES / name):
                    return name
            for name in [] if quick else self.slow_tests(mutant.file):
                if name not in self.seconds:
                    replace(path, original)
                    self.measure_slow(name)
                if math.isinf(self.seconds[name]):
                    continue
                replace(path, mutant.applied(original))
                self._make_for_slow(name, folder)
                # Their times depend on what else the machine does: one failure is no proof.
                if not self._passes_slow(name, folder) and not self._passes_slow(name, folder):
                    return name
        finally:
            replace(path, original)
        if mutant.file in self._commands:
            self._compile(mutant.file, original, folder / 'original.o')
            self._compile(mutant.file, mutant.applied(original), folder / 'mutant.o')
            if code(folder / 'original.o', folder) == code(folder / 'mutant.o', folder):
                raise Equivalent
        return None

    def slow_tests(self, file):
        """Those that run a file, the quickest first."""
        reached = [name for name, (rooms, pattern) in SLOW_TESTS.items()
                   if room(file) in rooms and pathlib.Path(file) in self._sources.distances(pattern)]
        return sorted(reached, key=lambda name: self.seconds.get(name, math.inf))

    def measure_slow(self, name):
        """As measure(). One that fails as things are cannot judge and is left out."""
        self._make_for_slow(name, WORK)
        begin = time.monotonic()
        if self._passes_slow(name, WORK):
            self.seconds[name] = time.monotonic() - begin
        else:
            self.seconds[name] = math.inf
            print(f'warning: {name} is left out, as it fails without any mutant, see {WORK / "test.log"}', flush=True)

    def _make_for_slow(self, name, folder):
        needed = ['stereo_descriptor_vo_slow_nodelet', 'stereo_descriptor_vo_street'] if name.startswith('ros/') else []
        for target in ['all'] + needed + (self._targets('rostest_') if name == 'ros/nouns.test' else []):
            self._make(target, folder)

    @staticmethod
    def _passes_slow(name, folder):
        test = shlex.quote(str(PACKAGE / 'test' / name))
        command = f'set +u; . "{WORKSPACE}/devel/setup.sh"; exec {"rostest " if name.endswith(".test") else ""}{test}'
        return run(['bash', '-c', command], folder / 'test.log', timeout=SLOW_LIMIT)

    def _make(self, target, folder):
        if not run(['make', '-j', str(JOBS), target], folder / 'make.log', cwd=BUILD):
            raise NotBuilt


def semantic():
    """The mistakes of thought."""
    found = []
    for entry in yaml.safe_load((ROOT / 'test' / 'semantic_mutants.yaml').read_text()):
        text = (ROOT / entry['file']).read_text()
        if text.count(entry['find']) != 1:
            sys.exit(f'error: {entry["file"]} has not exactly one: {entry["find"]}')
        offset = text.index(entry['find'])
        found.append(Mutant(entry['file'], entry['find'], entry['replace'], offset, text.count('\n', 0, offset) + 1,
                            entry['find'], entry['replace'], entry['why']))
    return found


def sources():
    return sorted(str(path.relative_to(ROOT)) for path in (ROOT / 'src').rglob('*.cpp'))


def of_file(file, lines=None):
    text = (ROOT / file).read_text()
    found = mutants(file, text, lines)
    return [m for m in found if m.why != 'number'] if SCENERY.match(file) else found


def changed_lines(revision):
    """Numbers of the lines that differ from a revision, by file."""
    diff = subprocess.run(['git', 'diff', '-U0', '--no-color', revision, '--', 'src', 'include'], cwd=ROOT, check=True,
                          stdout=subprocess.PIPE).stdout.decode()
    lines, file = {}, None
    for row in diff.splitlines():
        if row.startswith('+++ '):
            file = row[6:] if row.startswith('+++ b/') else None
        hunk = re.match(r'@@ -\S+ \+(\d+)(?:,(\d+))? @@', row)
        if hunk and file and file.endswith(('.cpp', '.hpp')):
            first, count = int(hunk[1]), int(hunk[2] or 1)
            lines.setdefault(file, set()).update(range(first, first + count))
    return lines


def chosen(arguments):
    if arguments.semantic:
        return semantic()
    found = []
    if arguments.changed:
        for file, lines in changed_lines(arguments.changed).items():
            found += of_file(file, lines)
    for name in arguments.files:
        file, _, span = name.partition(':')
        first, _, last = span.partition('-')
        found += of_file(file, range(int(first), int(last or first) + 1) if span else None)
    if not found and not arguments.changed and not arguments.files:
        found = [mutant for file in sources() for mutant in of_file(file)]
    if arguments.sample and arguments.sample < len(found):
        found = random.Random(arguments.seed).sample(found, arguments.sample)
    return found


def equivalents():
    entries = yaml.safe_load((ROOT / 'test' / 'equivalent_mutants.yaml').read_text()) or []
    return {(entry['file'], entry['line'], entry['becomes']) for entry in entries}


def judge_all(workspace, todo, quick):
    """Yields the list of (mutant, verdict, test) so far, in the order drawn; first what can be asked several at once."""
    known, results = equivalents(), {}
    folders = queue.Queue()
    for i in range(JOBS):
        folder = WORK / f'mutant_{i}'
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        folders.put(folder)
    lock = threading.Lock()

    def judge(mutant, judges, scope):
        folder = folders.get()
        begin = time.monotonic()
        try:
            if (mutant.file, mutant.before, mutant.after) in known:
                verdict, test = 'equivalent', ''
            else:
                test = judges(mutant, folder, scope)
                verdict = 'caught' if test else 'survived'
        except (Equivalent, NotBuilt) as exception:
            verdict, test = 'equivalent' if isinstance(exception, Equivalent) else 'not compiled', ''
        finally:
            folders.put(folder)
        with lock:
            results[mutant] = verdict, test
            print(f'{verdict:12} {mutant}{" by " + test if test else ""} ({time.monotonic() - begin:.0f} s)', flush=True)

    def survivors():
        return [mutant for mutant in todo if results.get(mutant, ('survived', ))[0] == 'survived']

    def so_far():
        return [(mutant, *results[mutant]) for mutant in todo if mutant in results]

    for near in [True] if quick else [True, False]:
        waiting = [mutant for mutant in survivors() if workspace.library_of(mutant.file)[1]]
        print(f'{"The nearest" if near else "The other"} gtests, for {len(waiting)} mutants of libraries …', flush=True)
        for i in range(0, len(waiting), BATCH):
            with concurrent.futures.ThreadPoolExecutor(JOBS) as pool:
                list(pool.map(lambda m: judge(m, workspace.judge_beside, near), waiting[i:i + BATCH]))
            yield so_far()
    waiting = survivors()
    print(f'Programs, nodelets and ROS tests, for {len(waiting)} mutants, one by one …', flush=True)
    for mutant in waiting:
        judge(mutant, workspace.judge_in_place, quick)
        yield so_far()


def wilson(successes, trials):
    """Wilson's 95 % interval of a ratio."""
    if not trials:
        return 0.0, 1.0
    z = 1.96
    centre = (successes + z * z / 2) / (trials + z * z)
    half = z / (trials + z * z) * math.sqrt(successes * (trials - successes) / trials + z * z / 4)
    return centre - half, centre + half


def room(file):
    if SCENERY.match(file):
        return 'scenery'
    parts = pathlib.Path(file).parts
    return parts[2] if parts[0] == 'include' else parts[1]


def table(results):
    """Rows by room, a sum, and what survived."""
    rows = ['| room | mutants | caught | survived | equivalent | caught of those that change something |', '| --- | --- | --- | --- | --- | --- |']

    def row(name, verdicts):
        n = collections.Counter(verdicts)
        decided = n['caught'] + n['survived']
        share = f'{100 * n["caught"] / decided:.0f} %' if decided else '–'
        return f'| {name} | {decided + n["equivalent"]} | {n["caught"]} | {n["survived"]} | {n["equivalent"]} | {share} |'

    by_room = collections.defaultdict(list)
    for mutant, verdict, _ in results:
        by_room[room(mutant.file)].append(verdict)
    rows += [row(name, by_room[name]) for name in sorted(by_room)]
    rows.append(row('all', [verdict for _, verdict, _ in results]))
    survivors = [f'* `{mutant}`' for mutant, verdict, _ in results if verdict == 'survived']
    return '\n'.join(rows + ([''] + ['Survived:', ''] + survivors if survivors else [])) + '\n'


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('files', nargs='*', help='sources, with :FIRST-LAST for some lines')
    parser.add_argument('--changed', metavar='REVISION', help='lines of sources that differ from this revision')
    parser.add_argument('--semantic', action='store_true', help='those of test/semantic_mutants.yaml')
    parser.add_argument('--sample', type=int, help='so many of them, drawn at random')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--quick', action='store_true', help='ask the nearest gtests only')
    parser.add_argument('--list', action='store_true', help='only print the mutants')
    parser.add_argument('--least', type=float, default=85.0, help='per cent to be caught (85)')
    arguments = parser.parse_args()
    todo = chosen(arguments)
    if arguments.list or not todo:
        print('\n'.join(map(str, todo)) or 'no mutant: no line of a source was changed')
        return 0
    workspace = Workspace()
    for results in judge_all(workspace, todo, arguments.quick):
        (WORK / 'report.md').write_text(table(results))
    print(table(results))
    count = collections.Counter(verdict for _, verdict, _ in results)
    decided = count['caught'] + count['survived']
    share = 100 * count['caught'] / decided if decided else 100.0
    low, high = (100 * bound for bound in wilson(count['caught'], decided))
    print(f'{len(results)} mutants: ' + ', '.join(f'{n} {verdict}' for verdict, n in sorted(count.items())) +
          f'; {share:.1f} % of those that change something are caught, 95 % interval {low:.1f} to {high:.1f}')
    return 0 if share >= (100.0 if arguments.semantic else arguments.least) else 1


if __name__ == '__main__':
    sys.exit(main())
