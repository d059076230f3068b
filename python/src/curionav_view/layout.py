"""How it is arranged: what happens around the robot, where it is in the hall, why it does so, and how it fares."""

from __future__ import annotations

import math

import rerun as rr
import rerun.blueprint as rrb

from curionav.messages import OccupancyGrid

from . import colours

TIMELINE = "robot_time"
"""Seconds of the robot's clock."""
CYCLES = "cycle"
"""Number of the planning cycle."""

_AROUND = [
    "+ /map/**", "+ /robot/**", "+ /people/**", "+ /plan/**", "+ /belief/**", "+ /truth/**",
    "- /robot/marker",
]  # fmt: skip
_HALL = [
    "+ /map/**", "- /map/density", "+ /robot/body", "+ /robot/marker", "+ /people/bodies", "+ /plan/chosen",
    "+ /plan/goal", "+ /belief/**", "+ /truth/**",
]  # fmt: skip


def default(grid: OccupancyGrid | None = None) -> rrb.Blueprint:
    """The layout; with a map the eye is over its middle."""
    around = rrb.Spatial3DView(
        name="Around the robot: candidates (bright is cheap), people, their density",
        # Moves with the robot and does not turn with it: north stays up.
        origin="/eye",
        contents=_AROUND,
        # Over the candidates by their cost: for who wants to see it.
        overrides={"/plan/beyond": rrb.EntityBehavior(visible=False)},
        background=colours.UNKNOWN,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=[0.0, -9.0, 13.0],
            look_target=[0.0, 0.3, 0.0],
            eye_up=[0.0, 0.0, 1.0],
        ),
    )
    hall = rrb.Spatial3DView(
        name="The hall, and what the laser would tell where",
        origin="/",
        contents=_HALL,
        background=colours.UNKNOWN,
        line_grid=False,
        eye_controls=_above(grid),
    )
    plots = [
        _plot("Uncertainty (m² + rad²), true error (m)", "/plots/uncertainty"),
        _plot("Nearest person (m)", "/plots/person", (0.0, 10.0)),
        _plot("Speed (m/s)", "/plots/speed", (-0.1, 1.2), rrb.Corner2D.RightBottom),
        _plot("Time of a cycle (ms)", "/plots/cycle"),
    ]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                around,
                rrb.StateTimelineView(name="Modes", origin="/modes"),
                row_shares=[5, 1.35],
            ),
            rrb.Vertical(
                hall,
                rrb.Tabs(
                    rrb.TextDocumentView(name="Decision", origin="/decision"),
                    rrb.TextLogView(name="Events", origin="/events"),
                ),
                row_shares=[1, 1],
            ),
            rrb.Vertical(*plots),
            column_shares=[5, 3.2, 2.8],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following"),
        auto_views=False,
    )


def _above(grid: OccupancyGrid | None) -> rrb.EyeControls3D:
    """High over the middle of the map, north upwards."""
    x, y, side = 0.0, 0.0, 20.0
    if grid is not None:
        width, height = grid.width * grid.resolution, grid.height * grid.resolution
        c, s = math.cos(grid.origin.heading), math.sin(grid.origin.heading)
        x = grid.origin.x + (c * width - s * height) / 2
        y = grid.origin.y + (s * width + c * height) / 2
        side = max(width, height)
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        # A little to the south: straight down leaves open which way is up.
        position=[x, y - 0.02 * side, 1.1 * side],
        look_target=[x, y, 0.0],
        eye_up=[0.0, 0.0, 1.0],
    )


def _plot(
    name: str, origin: str, span: tuple[float, float] | None = None, legend: rrb.Corner2D = rrb.Corner2D.RightTop
) -> rrb.TimeSeriesView:
    everything = rrb.VisibleTimeRange(
        TIMELINE, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.infinite()
    )
    return rrb.TimeSeriesView(
        name=name,
        origin=origin,
        axis_y=rrb.ScalarAxis(range=span, zoom_lock=False),
        plot_legend=rrb.PlotLegend(legend),
        time_ranges=[everything],
    )


def series(name: str, colour: tuple[int, int, int, int], width: float = 2.0) -> rr.SeriesLines:
    """How one line of a plot looks."""
    return rr.SeriesLines(names=[name], colors=[colour], widths=[width])
