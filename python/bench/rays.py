"""Rays from arrays: dmp_slam beside the caster in Rust, Open3D and Embree, on the files of ``cargo xtask bench rays``.

    rays.py FOLDER --rust PROGRAM [--runs N] [--only NAME]

Every caster is a process of its own (``casters.py``; ``bench rays-serve`` of PROGRAM), which has read the rays and built what it casts
into before anything is timed. They cast in turns; the first cast of each does not count. ``wall`` is by the clock, ``cores`` the time of
the process on all cores, which others on the machine disturb less.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from casters import CASTERS

RUST = "Rust"
#: Ways to cast of each caster, and what it returns. Threads are one and two where it has threads.
WAYS = {
    RUST: {
        "first": "z1, into lists of 32768",
        "measured": "z1 and zn, into lists of 32768",
        "normals": "z1 and normals, into lists of 32768",
    },
    **{name: kind.ways for name, kind in CASTERS.items()},
}
ONE_THREAD = [name for name, kind in CASTERS.items() if kind.one_thread]


class Peer:
    """A caster in a process of its own."""

    def __init__(self, name: str, command: list[str]) -> None:
        self.name = name
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.ask("load")
        before = self.memory("RssAnon")
        self.build_s = float(self.ask("build"))
        self.scene_mib = self.memory("RssAnon") - before

    def ask(self, request: str) -> str:
        self.process.stdin.write(request + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise SystemExit(f"error: {self.name}: it ended with {self.process.wait()} at {request}")
        return answer.strip()

    def memory(self, field: str) -> float:
        """MiB of its memory."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        (kib,) = (line.split()[1] for line in status.splitlines() if line.startswith(f"{field}:"))
        return int(kib) / 1024

    def cast(self, way: str, threads: int) -> tuple[float, float]:
        """Seconds by the clock, and on all cores."""
        # The clock of another process, as the system numbers them.
        clock = (~self.process.pid << 3) | 2
        before = time.clock_gettime(clock)
        wall_s = float(self.ask(f"go {way} {threads}"))
        return wall_s, time.clock_gettime(clock) - before


def started(arguments: argparse.Namespace) -> list[Peer]:
    serve = [sys.executable, str(Path(__file__).with_name("casters.py"))]
    peers = [Peer(RUST, [arguments.rust, "bench", "rays-serve", str(arguments.folder)])]
    for name, kind in CASTERS.items():
        if arguments.only in name:
            try:
                kind.versions()
            except ImportError as error:
                print(f"without {name}: {error}")
                continue
            peers.append(Peer(name, [*serve, name, str(arguments.folder)]))
    return peers


def print_set_up(peers: list[Peer]) -> None:
    print(f"\n{'caster':<18}{'build s':>9}{'scene MiB':>11}{'peak MiB':>10}  casts into")
    for peer in peers:
        into = "the map" if peer.name == RUST else CASTERS[peer.name].into
        print(f"{peer.name:<18}{peer.build_s:>9.2f}{peer.scene_mib:>11.0f}{peer.memory('VmHWM'):>10.0f}  {into}")
    told = {version for peer in peers[1:] for version in CASTERS[peer.name].versions()}
    print("build: until one ray in a thousand is cast; scene: what that adds to the memory; peak: with rays and results")
    print(", ".join(sorted({f"numpy {np.__version__}", *told})))


def print_agreement(peers: list[Peer]) -> None:
    """First ranges beside those of Rust."""
    print(f"\n{'caster':<18}{'both hit':>10}{'same bits':>11}{'median apart':>14}{'> 1 cm':>9}{'extra':>8}{'missing':>9}")
    found = {}
    with tempfile.TemporaryDirectory(dir="/var/tmp") as folder:
        for peer in peers:
            path = Path(folder) / "ranges.npy"
            peer.ask(f"ranges {path}")
            found[peer.name] = np.load(path)
    expected = found.pop(RUST)
    for name, ranges in found.items():
        hits, both = np.isfinite(ranges), np.isfinite(ranges) & np.isfinite(expected)
        apart = np.abs(ranges[both] - expected[both])
        same = np.array_equal(ranges, expected, equal_nan=True)
        rays = len(expected)
        print(
            f"{name:<18}{both.sum():>10}{'all' if same else 'no':>11}{f'{np.median(apart) * 1e6:.1f} µm':>14}"
            f"{(apart > 0.01).mean():>9.2%}{(hits & ~both).sum() / rays:>8.2%}{(np.isfinite(expected) & ~both).sum() / rays:>9.2%}"
        )


def measure(peers: list[Peer], runs: int) -> dict[tuple[str, str, int], list[tuple[float, float]]]:
    ways = [
        (peer, way, threads)
        for threads in (1, 2)
        for way in ("first", "measured", "normals", "ids")
        for peer in peers
        if way in WAYS[peer.name] and (threads == 1 or peer.name not in ONE_THREAD)
    ]
    taken: dict[tuple[str, str, int], list[tuple[float, float]]] = {}
    for turn in range(runs + 1):
        for peer, way, threads in ways:
            seconds = peer.cast(way, threads)
            if turn > 0:
                taken.setdefault((peer.name, way, threads), []).append(seconds)
    return taken


def print_times(taken: dict[tuple[str, str, int], list[tuple[float, float]]], rays: int) -> None:
    print(f"\n{'':<18}{'':>8}{'wall, ns a ray':>15}{'':>18}{'':>9}{'cores':>8}")
    print(f"{'caster':<18}{'threads':>8}{'median':>15}{'least – largest':>18}{'to Rust':>9}{'to Rust':>8}  what comes back")
    for (name, way, threads), seconds in taken.items():
        # Of others it is the first surfel alone that is asked, however they tell it.
        reference = taken[RUST, way if way in WAYS[RUST] else "first", threads]
        wall, cores = (statistics.median(times) for times in zip(*seconds))
        rust_wall, rust_cores = (statistics.median(times) for times in zip(*reference))
        least, largest = (end(times[0] for times in seconds) / rays * 1e9 for end in (min, max))
        print(
            f"{name:<18}{threads:>8}{wall / rays * 1e9:>15.1f}{f'{least:.1f} – {largest:.1f}':>18}"
            f"{wall / rust_wall:>8.2f}x{cores / rust_cores:>7.2f}x  {WAYS[name][way]}"
        )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rust", required=True)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    rays = len(np.load(arguments.folder / "ranges.npy", mmap_mode="r"))
    peers = started(arguments)
    print(f"{rays} rays")
    print_times(measure(peers, arguments.runs), rays)
    print_agreement(peers)
    print_set_up(peers)


if __name__ == "__main__":
    main()
