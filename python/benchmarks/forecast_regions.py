"""How often filmed people are where a forecast of constant velocity says that 90 of 100 are.

Prints the table of ``crates/planning/src/forecast/regions.rs``, fitted on the films of ``peds_eth``. Then it prints how
many of the people of other films are within three kinds of regions: those of the profile ``curiosity``, those of the
table, and those of the table that learn from each outcome (adaptive conformal inference: Gibbs and Candes, 2021). A
region that learns is multiplied by a factor for its class of speed and its horizon. The factor grows by
``exp(0.9 gamma)`` whenever a person turns out to have been outside, and shrinks by ``exp(-0.1 gamma)`` whenever one was
inside.

    python -m curionav.datasets peds_eth peds_eth_ucy
    python python/benchmarks/forecast_regions.py --restart 60
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from curionav.datasets import folder

FloatArray = NDArray[np.float64]

TRAINING = {"peds_eth/seq_eth": 15.0, "peds_eth/seq_hotel": 25.0}
"""Films that the table is fitted on, and their annotated frames per second."""
REPORT = {"peds_eth_ucy/students03": 25.0, "peds_eth_ucy/zara01": 25.0}
"""Films that nothing is chosen on."""
PERIOD_S = 0.4
"""Between two positions of a person."""
HORIZONS = PERIOD_S * np.arange(1, 11)
SPEEDS = (0.3, 0.8, 1.3)
"""Where the next class of speed begins, m/s."""
REGION = 0.9
REGION_SIGMAS = float(np.sqrt(-2.0 * np.log(1.0 - REGION)))


@dataclass(frozen=True)
class Predictions:
    """Predictions of one film or more, in order of time.

    Attributes:
        at: When each was made, in periods.
        speed_class: That of the person then.
        errors: Distance of the person from where it was expected, ``[prediction, horizon]``; NaN once it has gone.
    """

    at: NDArray[np.int64]
    speed_class: NDArray[np.int64]
    errors: FloatArray

    @staticmethod
    def joined(parts: Iterable[Predictions]) -> Predictions:
        """All of several films."""
        every = list(parts)
        return Predictions(
            np.concatenate([part.at for part in every]),
            np.concatenate([part.speed_class for part in every]),
            np.concatenate([part.errors for part in every]),
        )


def predictions(film: Path, fps: float) -> Predictions:
    """Constant velocity from every position of every person of a film; the velocity is that of the last period."""
    rows = np.loadtxt(film / "obsmat.txt")
    made: list[tuple[int, float, FloatArray]] = []
    for person in np.unique(rows[:, 1]):
        track = rows[rows[:, 1] == person]
        track = track[np.argsort(track[:, 0])]
        times = track[:, 0] / fps
        grid = PERIOD_S * np.arange(np.ceil(times[0] / PERIOD_S), np.floor(times[-1] / PERIOD_S) + 1)
        if len(grid) < 3:
            continue
        places = np.stack([np.interp(grid, times, track[:, column]) for column in (2, 4)], axis=1)
        velocities = np.diff(places, axis=0) / PERIOD_S
        for now in range(1, len(grid)):
            velocity = velocities[now - 1]
            errors = np.full(len(HORIZONS), np.nan)
            known = places[now + 1 : now + 1 + len(HORIZONS)]
            expected = places[now] + HORIZONS[: len(known), None] * velocity
            errors[: len(known)] = np.linalg.norm(known - expected, axis=1)
            made.append((round(grid[now] / PERIOD_S), float(np.linalg.norm(velocity)), errors))
    made.sort(key=lambda each: each[0])
    speeds = np.array([speed for _, speed, _ in made])
    return Predictions(
        np.array([at for at, _, _ in made]), np.digitize(speeds, SPEEDS), np.array([errors for _, _, errors in made])
    )


def fitted_radii(training: Predictions) -> FloatArray:
    """The 90 % quantile of the errors, metres, ``[class of speed, horizon]``."""
    classes = range(len(SPEEDS) + 1)
    return np.array([np.nanquantile(training.errors[training.speed_class == each], REGION, axis=0) for each in classes])


def held(of: Predictions, radii: FloatArray, gamma: float = 0.0, restart_s: float | None = None) -> FloatArray:
    """Share of people within their regions at each horizon.

    Args:
        of: What is judged.
        radii: What regions begin with, metres, ``[class of speed, horizon]``.
        gamma: How fast they learn; 0: not at all.
        restart_s: After so many seconds all that has been learnt is forgotten, as by a new mission.
    """
    factors = np.zeros_like(radii)
    inside = np.zeros(len(HORIZONS))
    count = np.zeros(len(HORIZONS))
    made_at: dict[int, list[int]] = defaultdict(list)
    for number, at in enumerate(of.at):
        made_at[int(at)].append(number)
    due: dict[int, list[tuple[int, int, bool]]] = defaultdict(list)
    first = int(of.at[0])
    for now in range(first, int(of.at[-1]) + 1):
        if restart_s is not None and (now - first) % round(restart_s / PERIOD_S) == 0:
            factors[:] = 0.0
            due.clear()
        for speed_class, horizon, missed in due.pop(now, []):
            factors[speed_class, horizon] += gamma * (float(missed) - (1.0 - REGION))
        for number in made_at[now]:
            speed_class = int(of.speed_class[number])
            reach = radii[speed_class] * np.exp(factors[speed_class])
            for horizon, error in enumerate(of.errors[number]):
                if np.isnan(error):
                    continue
                missed = bool(error > reach[horizon])
                inside[horizon] += not missed
                count[horizon] += 1
                due[now + horizon + 1].append((speed_class, horizon, missed))
    return inside / count


def print_row(name: str, values: Iterable[float], form: str) -> None:
    """One line of a table."""
    print(f"{name:<44}", " ".join(format(value, form) for value in values))


def main() -> None:
    """Prints the table and the shares."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gamma", type=float, default=0.1, help="how fast regions learn (default: %(default)s)")
    parser.add_argument("--restart", type=float, help="seconds after which what was learnt is forgotten")
    parser.add_argument("--training", action="store_true", help="judge only the films of training, each by the other")
    options = parser.parse_args()
    films = {name: predictions(folder() / name, fps) for name, fps in TRAINING.items()}
    radii = fitted_radii(Predictions.joined(films.values()))
    even = REGION_SIGMAS * np.sqrt(0.1**2 + (0.15 * HORIZONS) ** 2)
    print_row("horizon, s", HORIZONS, "5.1f")
    for number, row in enumerate(radii):
        print_row(f"radius of class {number}, m", row, "5.2f")
    if options.training:
        others = dict(zip(films, reversed(films), strict=True))
        judged = [(name, films[name], fitted_radii(films[others[name]])) for name in films]
    else:
        judged = [(name, predictions(folder() / name, fps), radii) for name, fps in REPORT.items()]
    for name, film, prior in judged:
        print_row(f"{name}: curiosity", held(film, np.tile(even, (len(SPEEDS) + 1, 1))), "5.3f")
        print_row(f"{name}: fitted", held(film, prior), "5.3f")
        print_row(f"{name}: learning", held(film, prior, options.gamma, options.restart), "5.3f")


if __name__ == "__main__":
    main()
