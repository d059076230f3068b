//! What the planners are and what the measures mean, for a reader who knows neither.

/// What a reader must know of a planner to judge its figures.
pub(super) const PLANNERS: [(&str, &str); 13] = [
    (
        "curiosity",
        "the paper's planner. It weighs the distance to the goal, CPC (how uncertain the robot's position will be along each \
         candidate way) and CNC (how much the way disturbs people and crowds). Where the paper's text leaves a choice, \
         docs/methods.md says what was chosen",
    ),
    ("cpc-only", "`curiosity` without CNC"),
    ("cnc-only", "`curiosity` without CPC"),
    (
        "distance-only",
        "`curiosity` without either: the same candidates, judged by the distance to the goal alone",
    ),
    ("risk-rrt", "Risk-RRT after the authors' package; five of its numbers differ, to its advantage"),
    (
        "bi-risk-rrt",
        "Bi-Risk-RRT after its publication (Ma et al., 2022); how it follows its path is inferred",
    ),
    (
        "human-space",
        "the paper's source [6] (Cai et al., 2022, \u{201c}Human-aware path planning with improved virtual Doppler method\u{201d}): \
         the ideas are the source's, the formulas are inferred",
    ),
    (
        "risk-aware",
        "the paper's source [15] (Cai et al., 2021, \u{201c}Risk-aware path planning under uncertainty in dynamic environments\u{201d}): \
         formulas inferred; its growing horizon is left out, so it looks as far ahead as most planners do",
    ),
    (
        "transient-goal",
        "the paper's source [8] (Narayanan et al., 2018, \u{201c}Formalizing a transient-goal driven approach for pedestrian-aware \
         robot navigation\u{201d}): all of it is inferred from that title",
    ),
    ("mppi", "Nav2's MPPI: its numbers; the noise is drawn per 0.7 s, and the critics are inferred"),
    ("dwa", "the critics of Nav2's DWB on geodesic distances, without RotateToGoal and Oscillation"),
    ("hrvo-robot", "the robot as one agent of HRVO; people who stand are taken to go on standing"),
    (
        "curionav",
        "this project's own; its settings were found by hand on more layouts for training than the tuning of the others \
         had, runs of rooms and recorded with an earlier version of it had been looked at, and the final check of what it \
         drives looks 3 s ahead, that of the others 3.9 s",
    ),
];

/// Kinds of scenes whose names do not say what they are.
pub(super) const KINDS: [(&str, &str); 5] = [
    ("void", "halls with nothing to see but their rim, farther off than the laser sees"),
    ("depot", "a map that a robot made"),
    ("warehouse", "a map that a robot made"),
    ("floor3", "a map of a building"),
    ("floor5", "a map of a building"),
];

/// The measures as the tables name them.
pub(super) const MEASURES: [(&str, &str); 11] = [
    ("RMSE", "root mean square of the distance between where the robot is and where it believes to be"),
    (
        "TCM, NM",
        "share of the run until the robot was first sure of its place (its own covariance below a bound), and how often it \
         was no longer so afterwards",
    ),
    ("TCE", "time until the true error had stayed below 0.3 m for 2 s"),
    (
        "TD",
        "time nearer than 1.5 m to a person, as a share of the run (%) and in seconds (s). A planner that takes longer has a \
         smaller share at the same seconds",
    ),
    ("NT", "how often the robot came nearer than 1.5 m to a person"),
    ("MD", "least distance to a person, between the centres"),
    ("Vel", "mean speed"),
    ("Length, Time", "of the whole way; only of runs that reached the goal"),
    ("Length / shortest", "the way over the shortest one of the robot's disc among the walls"),
    ("frozen", "time in which the robot was slower than 0.05 m/s for 3 s or longer"),
    ("clearance", "least gap to a wall or a person; 0 or less is a contact"),
];
