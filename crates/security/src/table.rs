//! The table of rights. What is not in it is denied.
//!
//! Keys are written without `curionav/@v1/` and with names in braces, which a certificate's name gives: `driver.r1` may
//! put `robot/r1/cmd`. `{self}` is the whole name, so that none commands under the name of another; `{robots}` is
//! each robot that the certificate lists.

pub use crate::right::{ROBOTS, Right, Row, Space, Verb};

/// Every service's rights.
pub const OF_SERVICES: &[Right] =
    &[may(Verb::Serve, &["status/{role}/{instance}"]), may(Verb::Hold, &["live/{role}/{instance}"])];

/// The role of a row that stands for every evaluator.
pub const ANY_TERM: &str = "{term}";

/// The role of a row that stands for every planner of one's own.
pub const ANY_PLANNER: &str = "own-{planner}";

const fn may(verb: Verb, keys: &'static [&'static str]) -> Right {
    Right { verb, keys, space: Space::Deployment }
}

/// The status of routers.
const ROUTERS: Right = Right { verb: Verb::Ask, keys: &["status/router/*"], space: Space::Router };

const fn service(
    role: &'static str,
    names: &'static [&'static str],
    about: &'static str,
    rights: &'static [Right],
) -> Row {
    Row { role, names, about, rights, is_service: true }
}

const fn client(
    role: &'static str,
    names: &'static [&'static str],
    about: &'static str,
    rights: &'static [Right],
) -> Row {
    Row { role, names, about, rights, is_service: false }
}

/// What is published about each robot.
const STREAMS: &[&str] = &[
    "robot/*/scan",
    "robot/*/scan/*",
    "robot/*/odom",
    "robot/*/people",
    "robot/*/belief",
    "robot/*/particles",
    "robot/*/mission",
    "robot/*/decision",
    "robot/*/cmd",
    "robot/*/report",
    "robot/*/memory",
];

/// What is published about the robots that a certificate lists.
const STREAMS_OF_LISTED: &[&str] = &[
    "robot/{robots}/scan",
    "robot/{robots}/scan/*",
    "robot/{robots}/odom",
    "robot/{robots}/people",
    "robot/{robots}/belief",
    "robot/{robots}/particles",
    "robot/{robots}/mission",
    "robot/{robots}/decision",
    "robot/{robots}/cmd",
    "robot/{robots}/report",
    "robot/{robots}/memory",
];

/// What the base of a robot measures.
const OF_SENSORS: &[&str] =
    &["robot/{robot}/scan", "robot/{robot}/scan/*", "robot/{robot}/odom", "robot/{robot}/people"];

/// What the base of a robot answers: which driver it obeys, wishes to drive, and pauses.
const OF_BASES: &[&str] = &["robot/{robot}/lease", "robot/{robot}/lease/request/*", "robot/{robot}/pause/*"];

/// What replicas are asked for, and maps.
const POOLS: &[&str] = &["generate/*/*", "evaluate/*/*/*", "map/*"];

/// What is asked between routers.
const LINKED: &[&str] = &["generate/*/*", "evaluate/*/*/*", "map/*", "status/*/*"];

/// The rights of all kinds of programs.
pub const TABLE: &[Row] = &[
    service(
        "driver",
        &["robot", "instance"],
        "a robot's driver, which owns its mission",
        &[
            may(Verb::Put, &["robot/{robot}/cmd", "robot/{robot}/mission"]),
            may(
                Verb::Subscribe,
                &[
                    "robot/{robot}/odom",
                    "robot/{robot}/belief",
                    "robot/{robot}/scan",
                    "robot/{robot}/scan/*",
                    "robot/{robot}/decision",
                ],
            ),
            may(Verb::Ask, &["robot/{robot}/lease/request/{self}", "map/*"]),
            may(
                Verb::Serve,
                &[
                    "robot/{robot}/mission",
                    "robot/{robot}/mission/command/*",
                    "robot/{robot}/mission/ready",
                    "robot/{robot}/pause/*",
                    "robot/{robot}/decision",
                ],
            ),
        ],
    ),
    service(
        "localizer",
        &["robot", "instance"],
        "a robot's localizer",
        &[
            may(Verb::Put, &["robot/{robot}/belief", "robot/{robot}/particles"]),
            may(
                Verb::Subscribe,
                &[
                    "robot/{robot}/mission",
                    "robot/{robot}/scan",
                    "robot/{robot}/odom",
                    "robot/{robot}/belief",
                ],
            ),
            may(Verb::Notice, &["robot/{robot}/particles"]),
            may(Verb::Ask, &["robot/{robot}/mission", "robot/{robot}/mission/ready", "map/*"]),
        ],
    ),
    service(
        "tracker",
        &["robot", "instance"],
        "a robot's tracker of people",
        &[
            may(Verb::Put, &["robot/{robot}/people"]),
            may(
                Verb::Subscribe,
                &[
                    "robot/{robot}/scan",
                    "robot/{robot}/odom",
                    "robot/{robot}/belief",
                    "robot/{robot}/mission",
                ],
            ),
            may(Verb::Ask, &["robot/{robot}/mission", "robot/{robot}/mission/ready", "map/*"]),
        ],
    ),
    service(
        "arbiter",
        &["robot", "instance"],
        "a robot's arbiter",
        &[
            may(Verb::Put, &["robot/{robot}/decision", "robot/{robot}/report", "robot/{robot}/memory"]),
            may(
                Verb::Subscribe,
                &[
                    "robot/{robot}/mission",
                    "robot/{robot}/scan",
                    "robot/{robot}/scan/*",
                    "robot/{robot}/odom",
                    "robot/{robot}/belief",
                    "robot/{robot}/people",
                    "robot/{robot}/cmd",
                ],
            ),
            may(Verb::Notice, &["robot/{robot}/report", "robot/{robot}/memory"]),
            may(
                Verb::Ask,
                &[
                    "robot/{robot}/mission",
                    "robot/{robot}/mission/ready",
                    "robot/{robot}/decision",
                    "generate/*/{robot}",
                    "evaluate/*/*/{robot}",
                    "map/*",
                ],
            ),
            may(Verb::Watch, &["live/*/*"]),
        ],
    ),
    client(
        "base",
        &["robot"],
        "the program that reads a robot's sensors and drives its motors",
        &[
            may(Verb::Put, OF_SENSORS),
            may(Verb::Subscribe, &["robot/{robot}/cmd"]),
            may(Verb::Serve, OF_BASES),
            may(Verb::Serve, &["map/*"]),
        ],
    ),
    service(
        "ros2-gateway",
        &["robot", "instance"],
        "the gateway to a robot of ROS 2, which plays its base and sends it about",
        &[
            may(Verb::Put, OF_SENSORS),
            may(Verb::Put, &["robot/{robot}/belief"]),
            may(
                Verb::Subscribe,
                &[
                    "robot/{robot}/mission",
                    "robot/{robot}/belief",
                    "robot/{robot}/decision",
                    "robot/{robot}/cmd",
                    "robot/{robot}/report",
                ],
            ),
            may(
                Verb::Ask,
                &[
                    "robot/{robot}/mission",
                    "robot/{robot}/mission/command/{self}",
                    "robot/{robot}/pause/{self}",
                ],
            ),
            may(Verb::Serve, OF_BASES),
            may(Verb::Serve, &["map/*"]),
        ],
    ),
    service(
        "generator",
        &["instance"],
        "a replica that generates trajectories",
        &[may(Verb::Ask, &["map/*"]), may(Verb::Serve, &["generate/{instance}/*"])],
    ),
    service(
        ANY_TERM,
        &["instance"],
        "a replica that evaluates a term, such as `cpc.a`",
        &[may(Verb::Ask, &["map/*"]), may(Verb::Serve, &["evaluate/{role}/{instance}/*"])],
    ),
    service(
        ANY_PLANNER,
        &["instance"],
        "a planner of one's own, such as `own-mine.a`",
        &[
            may(Verb::Subscribe, &["robot/*/scan"]),
            may(Verb::Ask, &["map/*"]),
            may(Verb::Serve, &["evaluate/{role}/{instance}/*"]),
        ],
    ),
    service(
        "simulator",
        &["world", "robot", "instance"],
        "a simulated world with a robot in it",
        &[
            may(
                Verb::Put,
                &[
                    "robot/{robot}/scan",
                    "robot/{robot}/odom",
                    "robot/{robot}/people",
                    "world/{world}/robot",
                    "world/{world}/run",
                ],
            ),
            may(
                Verb::Subscribe,
                &[
                    "robot/{robot}/mission",
                    "robot/{robot}/belief",
                    "robot/{robot}/decision",
                    "robot/{robot}/cmd",
                    "robot/{robot}/people",
                    "world/{world}/people",
                ],
            ),
            may(Verb::Ask, &["robot/{robot}/mission/command/{self}"]),
            may(Verb::Serve, OF_BASES),
            may(
                Verb::Serve,
                &["world/{world}/scenario", "world/{world}/check", "world/{world}/run", "map/*"],
            ),
        ],
    ),
    client(
        "echo",
        &["instance"],
        "answers bare questions, which `curionav scale` measures against",
        &[may(Verb::Serve, &["echo/{instance}"])],
    ),
    client(
        "crowd",
        &["world"],
        "a program that plays the crowd of a world",
        &[may(Verb::Put, &["world/{world}/people"]), may(Verb::Subscribe, &["world/{world}/robot"])],
    ),
    client(
        "viewer",
        &[],
        "a person or program that only looks",
        &[
            may(Verb::Subscribe, STREAMS),
            may(Verb::Subscribe, &["world/*/run"]),
            may(Verb::Ask, &["robot/*/mission", "robot/*/lease", "world/*/run", "map/*", "status/*/*"]),
            ROUTERS,
            may(Verb::Watch, &["live/*/*"]),
        ],
    ),
    client(
        "operator",
        &[],
        "a person who sends robots about, and looks for faults",
        &[
            may(Verb::Subscribe, STREAMS),
            may(Verb::Subscribe, &["world/*/run"]),
            may(
                Verb::Ask,
                &[
                    "robot/*/mission",
                    "robot/*/mission/command/{self}",
                    "robot/*/lease",
                    "robot/*/pause/{self}",
                    "world/*/run",
                    "status/*/*",
                    "echo/*",
                ],
            ),
            may(Verb::Ask, POOLS),
            ROUTERS,
            may(Verb::Serve, &["echo/*"]),
            may(Verb::Watch, &["live/*/*"]),
        ],
    ),
    client(
        "viewer",
        &[ROBOTS],
        "one who only looks at the robot ROBOTS, or at those that the certificate lists",
        &[
            may(Verb::Subscribe, STREAMS_OF_LISTED),
            may(Verb::Ask, &["robot/{robots}/mission", "robot/{robots}/lease", "map/*", "status/*/*"]),
            ROUTERS,
            may(Verb::Watch, &["live/*/*"]),
        ],
    ),
    client(
        "operator",
        &[ROBOTS],
        "one who sends about the robot ROBOTS, or those that the certificate lists, and no other",
        &[
            may(Verb::Subscribe, STREAMS_OF_LISTED),
            may(
                Verb::Ask,
                &[
                    "robot/{robots}/mission",
                    "robot/{robots}/mission/command/{self}",
                    "robot/{robots}/lease",
                    "robot/{robots}/pause/{self}",
                    "generate/*/{robots}",
                    "evaluate/*/*/{robots}",
                    "map/*",
                    "status/*/*",
                    "echo/*",
                ],
            ),
            ROUTERS,
            may(Verb::Serve, &["echo/*"]),
            may(Verb::Watch, &["live/*/*"]),
        ],
    ),
    client(
        "experimenter",
        &[],
        "a person who runs scenarios in simulated worlds; do not issue it for real robots",
        &[
            may(Verb::Put, &["world/*/people"]),
            may(Verb::Subscribe, STREAMS),
            may(Verb::Subscribe, &["world/*/run", "world/*/robot"]),
            may(
                Verb::Ask,
                &[
                    "robot/*/mission",
                    "robot/*/mission/command/{self}",
                    "robot/*/lease",
                    "robot/*/pause/{self}",
                    "world/*/scenario",
                    "world/*/check",
                    "world/*/run",
                    "map/*",
                    "status/*/*",
                ],
            ),
            ROUTERS,
            may(Verb::Watch, &["live/*/*"]),
        ],
    ),
    client(
        "router",
        &["robot"],
        "the router on a robot, at a router of pools: nothing of `robot/` passes",
        &[
            may(Verb::Ask, &["generate/*/{robot}", "evaluate/*/*/{robot}", "map/*", "status/*/*"]),
            may(Verb::Serve, &["map/*"]),
            may(Verb::Find, LINKED),
            may(Verb::Hold, &["live/*/*"]),
            may(Verb::Watch, &["live/*/*"]),
        ],
    ),
    client(
        "router",
        &[],
        "a router of pools, at another router",
        &[
            may(Verb::Ask, LINKED),
            may(Verb::Serve, LINKED),
            may(Verb::Find, LINKED),
            may(Verb::Hold, &["live/*/*"]),
            may(Verb::Watch, &["live/*/*"]),
        ],
    ),
];
