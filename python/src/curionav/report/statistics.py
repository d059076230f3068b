"""The statistics of reports: spreads, Wilson's interval, the bootstrap, the signed-rank test and Holm's correction.

Sums are taken in order, and random numbers are those of the program, so that a figure repeats to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

RESAMPLES = 4000
"""Samples of a bootstrap: each end of a 95 % interval rests on 100 of them."""
TAIL = 0.025
EXACT_UP_TO = 300
"""Differences up to which the law of the rank sum is exact."""
Z = 1.959963984540054

_MASK = (1 << 64) - 1

Floats = NDArray[np.float64]
Clusters = Sequence[Sequence[Sequence[float]]]
"""Values by place, and in a place by scene."""


def total(values: Sequence[float]) -> float:
    """The sum in order; the built-in one compensates its rounding from Python 3.12 on."""
    result = 0.0
    for value in values:
        result += value
    return result


def mean(values: Sequence[float]) -> float | None:
    """The arithmetic mean; none of nothing."""
    return total(values) / len(values) if values else None


def median(values: Sequence[float]) -> float | None:
    """The middle value, or the mean of the two in the middle; none of nothing."""
    if not values:
        return None
    ordered = sorted(values)
    return 0.5 * (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])


def standard_deviation(values: Sequence[float]) -> float | None:
    """That of a sample (n - 1); 0 for a single value, none of nothing."""
    middle = mean(values)
    if middle is None:
        return None
    squares = total([(value - middle) * (value - middle) for value in values])
    return math.sqrt(squares / (max(len(values), 2) - 1))


def share_interval(hits: int, runs: int) -> tuple[float, float] | None:
    """The 95 % interval of a share (Wilson 1927); none of nothing."""
    if runs == 0:
        return None
    share = hits / runs
    middle = share + Z * Z / (2.0 * runs)
    half = Z * math.sqrt(share * (1.0 - share) / runs + Z * Z / (4.0 * runs * runs))
    whole = 1.0 + Z * Z / runs
    return max((middle - half) / whole, 0.0), min((middle + half) / whole, 1.0)


def holm(p: Sequence[float]) -> list[float]:
    """Each p, corrected for the number of tests (Holm 1979).

    >>> [round(p, 3) for p in holm([0.01, 0.04, 0.03, 0.005])]
    [0.03, 0.06, 0.06, 0.02]
    """
    corrected = [0.0] * len(p)
    least = 0.0
    for rank, test in enumerate(sorted(range(len(p)), key=p.__getitem__)):
        least = min(max(least, (len(p) - rank) * p[test]), 1.0)
        corrected[test] = least
    return corrected


def least_p(differences: int) -> float:
    """The least p that so many differences can have: that of all in one direction."""
    return min(math.pow(0.5, differences - 1.0), 1.0)


def signed_rank(differences: Sequence[float]) -> float | None:
    """The two-sided p of Wilcoxon's signed-rank test (1945), exact given the ties; none without differences.

    SciPy has no exact law with ties. Differences of zero are left out.

    >>> signed_rank([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]) == 2 / 1024
    True
    """
    if not differences:
        return None
    nonzero = sorted((value for value in differences if value != 0.0), key=abs)
    ranks = _doubled_ranks(nonzero)
    positive = sum(rank for value, rank in zip(nonzero, ranks, strict=True) if value > 0.0)
    law = _exact if len(nonzero) <= EXACT_UP_TO else _normal
    return min(law(ranks, positive), 1.0)


def _doubled_ranks(ordered: Sequence[float]) -> list[int]:
    """Twice the rank of each value by size: whole numbers also where ties share a mean rank."""
    ranks: list[int] = []
    while len(ranks) < len(ordered):
        start = len(ranks)
        end = start
        while end < len(ordered) and abs(ordered[end]) == abs(ordered[start]):
            end += 1
        ranks.extend([start + end + 1] * (end - start))
    return ranks


def _exact(ranks: Sequence[int], observed: int) -> float:
    """Twice the smaller tail: each rank is positive or not with even chance."""
    whole = sum(ranks)
    law = np.zeros(whole + 1)
    law[0] = 1.0
    for rank in ranks:
        moved = np.zeros_like(law)
        moved[rank:] = law[: whole + 1 - rank]
        law = 0.5 * (law + moved)
    lower = min(observed, whole - observed)
    return min(2.0 * total(law[: lower + 1].tolist()), 1.0)


def _normal(doubled: Sequence[int], observed: int) -> float:
    ranks = [rank / 2.0 for rank in doubled]
    middle = total(ranks) / 2.0
    deviation = math.sqrt(total([rank * rank for rank in ranks]) / 4.0)
    return math.erfc(abs(observed / 2.0 - middle) / deviation / math.sqrt(2.0))


def mean_interval(values: Sequence[float], seed: int) -> tuple[float, float] | None:
    """The 95 % bootstrap interval of a mean; none of nothing."""
    return cluster_interval([[values]], seed)


def cluster_interval(places: Clusters, seed: int) -> tuple[float, float] | None:
    """The 95 % interval of the mean over places of the mean over their scenes of the mean of a scene's values.

    Places are drawn anew, in each its scenes, and in each its values (Davison and Hinkley 1997, section 3.8).
    """
    filled = [[list(values) for values in scenes if values] for scenes in places]
    filled = [scenes for scenes in filled if scenes]
    if not filled:
        return None
    everything = [value for scenes in filled for values in scenes for value in values]
    if all(value == everything[0] for value in everything):
        return everything[0], everything[0]
    is_even = len({len(scenes) for scenes in filled}) == 1
    is_even = is_even and len({len(values) for scenes in filled for values in scenes}) == 1
    means = _even_means(np.array(filled), seed) if is_even else _uneven_means(filled, seed)
    means.sort()
    last = RESAMPLES - 1
    low, high = (means[math.floor(share * last + 0.5)] for share in (TAIL, 1.0 - TAIL))
    return float(low), float(high)


def _even_means(values: Floats, seed: int) -> Floats:
    """Means of the resamples of values by place, scene and run, as many in each."""
    places, scenes, runs = values.shape
    # What is there once is taken and not drawn.
    of_scene = runs if runs > 1 else 0
    of_place = (1 if scenes > 1 else 0) + of_scene
    each = places * ((1 if places > 1 else 0) + scenes * of_place)
    draws = iter(uniforms(seed, RESAMPLES * each).reshape(RESAMPLES, each).T)

    def one_of(count: int) -> NDArray[np.intp]:
        if count == 1:
            return np.zeros(RESAMPLES, dtype=np.intp)
        return np.minimum((next(draws) * count).astype(np.intp), count - 1)

    of_places = np.zeros(RESAMPLES)
    for _ in range(places):
        place = one_of(places)
        of_scenes = np.zeros(RESAMPLES)
        for _ in range(scenes):
            scene = one_of(scenes)
            of_runs = np.zeros(RESAMPLES)
            for _ in range(runs):
                of_runs += values[place, scene, one_of(runs)]
            of_scenes += of_runs / runs
        of_places += of_scenes / scenes
    of_places /= places
    return of_places


def _uneven_means(places: Clusters, seed: int) -> Floats:
    """The same where how many numbers a resample takes depends on what it draws."""
    sizes = [[len(values) for values in scenes] for scenes in places]
    of_place = [1 + sum(1 + count for count in counts) for counts in sizes]
    expected = RESAMPLES * sum(of_place)
    while True:
        try:
            return _resampled(places, sizes, uniforms(seed, expected))
        except IndexError:
            # Rarely so many large scenes are drawn that the numbers do not suffice.
            expected *= 2


def _resampled(places: Clusters, sizes: Sequence[Sequence[int]], draws: Floats) -> Floats:
    visits = _visits(sizes, draws.data)
    means = np.empty(len(visits.scene))
    flat = [values for scenes in places for values in scenes]
    for scene, values in enumerate(flat):
        here = np.flatnonzero(visits.scene == scene)
        total_of = np.zeros(len(here))
        for turn in range(len(values)):
            own = np.zeros(len(here), np.intp)
            if len(values) > 1:
                own = np.minimum((draws[visits.start[here] + turn] * len(values)).astype(np.intp), len(values) - 1)
            total_of += np.array(values)[own]
        means[here] = total_of / len(values)
    # `bincount` adds in order.
    of_scenes = np.bincount(visits.place, means) / np.bincount(visits.place)
    of_places: Floats = np.bincount(np.arange(len(of_scenes)) // len(places), of_scenes) / len(places)
    return of_places


@dataclass(frozen=True)
class _Visits:
    """Each drawn scene: its number, the draw of its first value, and which drawn place it is in."""

    scene: NDArray[np.intp]
    start: NDArray[np.intp]
    place: NDArray[np.intp]


def _visits(sizes: Sequence[Sequence[int]], draws: memoryview) -> _Visits:
    """The scenes that the resamples draw, where each has so many values."""
    firsts = np.cumsum([0, *map(len, sizes)]).tolist()
    scenes: list[int] = []
    starts: list[int] = []
    counts: list[int] = []
    at = 0
    for _ in range(RESAMPLES * len(sizes)):
        place = 0
        if len(sizes) > 1:
            place = min(int(draws[at] * len(sizes)), len(sizes) - 1)
            at += 1
        of_place = sizes[place]
        first = firsts[place]
        count = len(of_place)
        counts.append(count)
        for _ in range(count):
            scene = 0
            # What is there once is taken and not drawn.
            if count > 1:
                scene = min(int(draws[at] * count), count - 1)
                at += 1
            scenes.append(first + scene)
            starts.append(at)
            values = of_place[scene]
            at += values if values > 1 else 0
    place_of = np.repeat(np.arange(len(counts)), counts)
    return _Visits(np.array(scenes), np.array(starts), place_of)


def uniforms(seed: int, count: int) -> Floats:
    """The first numbers of the program's generator with this seed, in [0, 1).

    It is PCG64 (O'Neill 2014) without an increment.
    """
    generator = np.random.PCG64(0)
    state: Any = {"state": _start(seed), "inc": 0}
    generator.state = {"bit_generator": "PCG64", "state": state, "has_uint32": 0, "uinteger": 0}
    return np.random.Generator(generator).random(count)


def _start(seed: int) -> int:
    """The state of the generator, spread from the seed by SplitMix64 and by PCG32 as rand's `seed_from_u64` does."""
    z = (seed + 0x9E3779B97F4A7C15) & _MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    state = z ^ (z >> 31)
    start = 0
    for part in range(4):
        state = (state * 6364136223846793005 + 11634580027462260723) & _MASK
        shifted = (((state >> 18) ^ state) >> 27) & 0xFFFFFFFF
        turn = state >> 59
        word = ((shifted >> turn) | (shifted << (32 - turn))) & 0xFFFFFFFF
        start |= word << (32 * part)
    return start | 1
