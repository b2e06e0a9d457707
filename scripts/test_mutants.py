#!/usr/bin/env python3
"""Applies each patch of test/mutants, one at a time, to a copy of the package and sees whether a test notices.

The copy and its own catkin workspace lie in .catkin_ws/mutants and are kept: later runs build only what has changed. The
tests of the file that is changed run first, then those of its room, then all others, the quick ones before the slow ones,
until one fails. A patch that changes nothing a test could see is named with the reason in test/mutants/README.md.
Exit code 1 when another one survives, does not apply or does not compile.

With --check nothing is built: does each patch still apply to the sources as they are?
"""
import argparse
import fnmatch
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PATCHES = ROOT / "test" / "mutants"
WORK = ROOT / ".catkin_ws" / "mutants"
PACKAGE, WORKSPACE = WORK / "package", WORK / "workspace"
BUILD, BINARIES = WORKSPACE / "build", WORKSPACE / "devel" / "lib" / "stereo_descriptor_vo"
JOBS = os.environ.get("JOBS", str(os.cpu_count()))
SLOW = 10  # times as long as without a mutant, and a test counts as failed: it hangs


class NotBuilt(Exception):
    pass


def run(command, log, timeout=None, **keywords):
    """Whether the command succeeds in time; its output goes to a file."""
    with open(log, "w") as file:
        try:
            return subprocess.run(command, stdout=file, stderr=subprocess.STDOUT, timeout=timeout, **keywords).returncode == 0
        except subprocess.TimeoutExpired:
            return False


def copy_package():
    """What git knows of the package and what it does not ignore; unchanged files keep their time and are not built."""
    listing = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True,
                             stdout=subprocess.PIPE).stdout.decode()
    files = {name for name in listing.split("\0") if name and (ROOT / name).is_file()}
    for old in [f for f in PACKAGE.rglob("*") if f.is_file()]:
        if str(old.relative_to(PACKAGE)) not in files:
            old.unlink()
    for name in files:
        source, target = ROOT / name, PACKAGE / name
        if target.exists() and source.read_bytes() == target.read_bytes():
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target)


def configure():
    """Tests are linked to shared libraries: they need not be linked again when only a library has changed."""
    return run([PACKAGE / "scripts" / "build", "-DCMAKE_LINK_DEPENDS_NO_SHARED=ON", "--force-cmake", "stereo_descriptor_vo_core"],
               WORK / "build.log", env=dict(os.environ, WORKSPACE=str(WORKSPACE)))


def make(target, log):
    if not run(["make", "-j", JOBS, target], log, cwd=BUILD):
        raise NotBuilt


def matches(name, patterns):
    return any(fnmatch.fnmatch(name, pattern) for pattern in patterns)


def gtest_names():
    listing = subprocess.run(["make", "help"], cwd=BUILD, check=True, stdout=subprocess.PIPE).stdout.decode()
    return sorted(set(re.findall(r"^\.\.\. (test_\w+)$", listing, re.MULTILINE)))


def run_gtest(name, timeout=None):
    return run([BINARIES / name], WORK / "test.log", timeout=timeout, cwd=WORK)


def run_rostest(file):
    command = f'set +u; . "{WORKSPACE}/devel/setup.sh"; exec rostest "{file}"'
    return run(["bash", "-c", command], WORK / "test.log")


def measure(gtests):
    """Seconds that each gtest takes as things are; none may fail."""
    seconds = {}
    for name in gtests:
        make(name, WORK / "build.log")
        begin = time.monotonic()
        if not run_gtest(name):
            sys.exit(f"error: {name} fails without any mutant, see {WORK / 'test.log'}")
        seconds[name] = time.monotonic() - begin
    return seconds


def changed_file(patch):
    return Path(re.search(r"^\+\+\+ b/(\S+)", patch.read_text(), re.MULTILINE)[1])


def tests_by_interest(file, seconds):
    room = file.parent.name
    of_room = {f.stem for f in (ROOT / "test" / room).glob("test_*.cpp")}
    return sorted(seconds, key=lambda t: (t != f"test_{file.stem}", t not in of_room, seconds[t]))


def who_notices(file, seconds, with_rostests):
    """The test that fails, or None."""
    for name in tests_by_interest(file, seconds):
        make(name, WORK / "make.log")  # with the libraries that it needs
        if not run_gtest(name, timeout=5 + SLOW * seconds[name]):
            return name
    if with_rostests:
        make("all", WORK / "make.log")  # the nodelets, too
        for test in sorted((PACKAGE / "test" / "ros").glob("*.test")):
            if not run_rostest(test):
                return test.name
    return None


def patched(patch, folder=PACKAGE, arguments=()):
    command = ["patch", "-p1", "--silent", "--no-backup-if-mismatch", *arguments, "-i", str(patch)]
    return subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL).returncode == 0


def check(patches):
    """Names the patches that the code has left behind."""
    stale = [patch.stem for patch in patches if not patched(patch, ROOT, ["--dry-run"])]
    for name in stale:
        print(f"test/mutants/{name}.patch no longer applies: make the same mistake in the code as it is now, or remove it")
    print(f"{len(patches) - len(stale)} of {len(patches)} mutants apply")
    return not stale


def judge(patch, seconds, with_rostests):
    """What becomes of a mutant, and which test noticed it."""
    file = changed_file(patch)
    original = (PACKAGE / file).read_bytes()
    if not patched(patch):
        (PACKAGE / file).write_bytes(original)
        return "does not apply", ""
    try:
        test = who_notices(file, seconds, with_rostests)
    except NotBuilt:
        return "does not compile", ""
    finally:
        (PACKAGE / file).write_bytes(original)
    return ("caught", test) if test else ("survived", "")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("patterns", nargs="*", default=["*"], help="of the patches' names, such as front_end_*")
    parser.add_argument("--gtests", nargs="+", default=["*"], metavar="PATTERN", help="ask these gtests only")
    parser.add_argument("--check", action="store_true", help="only see whether the patches apply")
    parser.add_argument("--rostests", action="store_true", help="show to the ROS tests what the gtests do not notice")
    arguments = parser.parse_args()
    patches = [p for p in sorted(PATCHES.glob("*.patch")) if matches(p.stem, arguments.patterns)]
    if not patches:
        sys.exit(f"error: no patch in {PATCHES} is called {' or '.join(arguments.patterns)}")
    if arguments.check:
        sys.exit(0 if check(patches) else 1)
    harmless = set(re.findall(r"^\| `(\w+)` \|", (PATCHES / "README.md").read_text(), re.MULTILINE))

    WORK.mkdir(parents=True, exist_ok=True)
    copy_package()
    print("Building …", flush=True)
    if not configure():
        sys.exit(f"error: the package does not build, see {WORK / 'build.log'}")
    chosen = [t for t in gtest_names() if matches(t, arguments.gtests)]
    try:
        seconds = measure(chosen)
    except NotBuilt:
        sys.exit(f"error: the tests do not build, see {WORK / 'build.log'}")
    verdicts = {}
    for patch in patches:
        begin = time.monotonic()
        verdict, test = judge(patch, seconds, arguments.rostests)
        if verdict == "survived" and patch.stem in harmless:
            verdict = "changes nothing"
        verdicts[patch.stem] = verdict
        print(f"{verdict:16} {patch.stem}{' by ' + test if test else ''} ({time.monotonic() - begin:.0f} s)", flush=True)

    count = {verdict: list(verdicts.values()).count(verdict) for verdict in sorted(set(verdicts.values()))}
    caught, all_of_them = count.get("caught", 0), len(verdicts)
    print(f"{all_of_them} mutants: " + ", ".join(f"{n} {verdict}" for verdict, n in count.items()) +
          f"; {100 * caught / max(1, all_of_them - count.get('changes nothing', 0)):.0f} % of those that change something are caught")
    sys.exit(0 if set(count) <= {"caught", "changes nothing"} else 1)


if __name__ == "__main__":
    main()
