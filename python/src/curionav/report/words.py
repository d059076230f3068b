"""What the planners are and what the measures mean, for a reader who knows neither."""

PLANNERS = {
    "curiosity": (
        "the paper's planner. It weighs the distance to the goal, CPC (how uncertain the robot's position will be "
        "along each candidate way) and CNC (how much the way disturbs people and crowds). Where the paper's text "
        "leaves a choice, docs/methods.md says what was chosen"
    ),
    "cpc-only": "`curiosity` without CNC",
    "cnc-only": "`curiosity` without CPC",
    "distance-only": "`curiosity` without either: the same candidates, judged by the distance to the goal alone",
    "risk-rrt": "Risk-RRT after the authors' package; five of its numbers differ, to its advantage",
    "bi-risk-rrt": "Bi-Risk-RRT after its publication (Ma et al., 2022); how it follows its path is inferred",
    "human-space": (
        "the paper's source [6] (Cai et al., 2022, “Human-aware path planning with improved virtual Doppler "
        "method”): the ideas are the source's, the formulas are inferred"
    ),
    "risk-aware": (
        "the paper's source [15] (Cai et al., 2021, “Risk-aware path planning under uncertainty in dynamic "
        "environments”): formulas inferred; its growing horizon is left out, so it looks as far ahead as most "
        "planners do"
    ),
    "transient-goal": (
        "the paper's source [8] (Narayanan et al., 2018, “Formalizing a transient-goal driven approach for "
        "pedestrian-aware robot navigation”): all of it is inferred from that title"
    ),
    "mppi": "Nav2's MPPI: its numbers; the noise is drawn per 0.7 s, and the critics are inferred",
    "dwa": "the critics of Nav2's DWB on geodesic distances, without RotateToGoal and Oscillation",
    "hrvo-robot": "the robot as one agent of HRVO; people who stand are taken to go on standing",
    "curionav": (
        "this project's own; its settings were found by hand on more layouts for training than the tuning of the "
        "others had, runs of rooms and recorded with an earlier version of it had been looked at, and the final "
        "check of what it drives looks 3 s ahead, that of the others 3.9 s"
    ),
}
"""What a reader must know of a planner to judge its figures."""

KINDS = {
    "void": "halls with nothing to see but their rim, farther off than the laser sees",
    "depot": "a map that a robot made",
    "warehouse": "a map that a robot made",
    "floor3": "a map of a building",
    "floor5": "a map of a building",
}
"""Kinds of scenes whose names do not say what they are."""

MEASURES = {
    "RMSE": "root mean square of the distance between where the robot is and where it believes to be",
    "TCM, NM": (
        "share of the run until the robot was first sure of its place (its own covariance below a bound), and how "
        "often it was no longer so afterwards"
    ),
    "TCE": "time until the true error had stayed below 0.3 m for 2 s",
    "TD": (
        "time nearer than 1.5 m to a person, as a share of the run (%) and in seconds (s). A planner that takes "
        "longer has a smaller share at the same seconds"
    ),
    "NT": "how often the robot came nearer than 1.5 m to a person",
    "MD": "least distance to a person, between the centres",
    "Vel": "mean speed",
    "Length, Time": "of the whole way; only of runs that reached the goal",
    "Length / shortest": "the way over the shortest one of the robot's disc among the walls",
    "frozen": "time in which the robot was slower than 0.05 m/s for 3 s or longer",
    "clearance": "least gap to a wall or a person; 0 or less is a contact",
}
"""The measures as the tables name them."""

SLIPS = {
    "a": (
        "35.00 m in 31.77 s is 1.10 m/s, above the robot's top speed and the printed 0.91 m/s; about 28.9 m would fit"
    ),
    "b": "the printed Length over the printed Time differs from this by more than 5 %",
    "c": "this standard deviation is impossible or a misprint",
    "d": "equal to the Risk-RRT value beside it and out of line with its column: likely a slip of copying",
}
"""Marks on printed values that cannot be right, or hardly (methods 15), and why."""
