//! Actions in general: goals, how they fare, and the messages around the parts of each action.

use serde::Serialize;

use super::action_part::{Nothing, Part, Uuid};
use super::geometry::Time;
use super::navigate_to_pose::{Navigated, NavigatingTo};
use crate::cdr::{Cdr, CdrError, CdrFault, Reader, Writer, named};
use crate::interface::Interface;
use crate::limits::GOALS;
use crate::message::Message;
use crate::random::{Random, Rng};

const SEND_GOAL: Interface = Interface::new(
    "nav2_msgs/action/NavigateToPose_SendGoal",
    "RIHS01_a4fcb3bee1bf32e21a0e541a943b221aa0826996e2c98f079b47022b256f48b5",
);
const GET_RESULT: Interface = Interface::new(
    "nav2_msgs/action/NavigateToPose_GetResult",
    "RIHS01_c407920357d566771e8882b4ef4d1f1a84ee922d609920ccd57faa6d6e391dc5",
);
const CANCEL_GOAL: Interface = Interface::new(
    "action_msgs/srv/CancelGoal",
    "RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a",
);
/// Requests and results, with the longest texts.
const SMALL: usize = 8 << 10;
/// One entry for each goal that is known.
const LIST: usize = 64 << 10;

message! {
    /// A goal and since when there is one.
    #[derive(Copy, Eq)]
    GoalInfo;
    {
        /// Its name; all zero stands for every goal.
        goal_id: Uuid,
        /// When it was accepted.
        stamp: Time,
    }
}

message! {
    /// How one goal fares.
    #[derive(Copy, Eq)]
    GoalStatus;
    {
        /// The goal.
        goal_info: GoalInfo,
        /// 1 accepted, 2 executing, 3 canceling, 4 succeeded, 5 canceled, 6 aborted.
        status: i8,
    }
}

message! {
    /// How all goals of one action fare.
    #[derive(Eq)]
    GoalStatusArray = "action_msgs/msg/GoalStatusArray" of Interface::new(
        "action_msgs/msg/GoalStatusArray",
        "RIHS01_6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e",
    ), at most LIST;
    {
        /// One per goal that the server still remembers.
        status_list: Vec<GoalStatus> [GOALS],
    }
}

message! {
    /// Asks to give up a goal. A name of zeros and a stamp of zero mean all goals, a stamp alone all goals up to then.
    #[derive(Copy, Eq)]
    CancelGoalRequest = "action_msgs/srv/CancelGoal_Request" of CANCEL_GOAL, at most SMALL;
    {
        /// The goal.
        goal_info: GoalInfo,
    }
}

message! {
    /// Which goals are given up.
    #[derive(Eq)]
    CancelGoalResponse = "action_msgs/srv/CancelGoal_Response" of CANCEL_GOAL, at most LIST;
    {
        /// 0 if any is, 1 refused, 2 there is no such goal, 3 it has ended.
        return_code: i8,
        /// The goals that will be cancelled.
        goals_canceling: Vec<GoalInfo> [GOALS],
    }
}

message! {
    /// Whether a goal is accepted; of every action, though its key is that of the action.
    #[derive(Copy, Eq)]
    SendGoalResponse = "nav2_msgs/action/NavigateToPose_SendGoal_Response" of SEND_GOAL, at most SMALL;
    {
        /// Whether it is.
        accepted: bool,
        /// Since when.
        stamp: Time,
    }
}

message! {
    /// Asks what has become of a goal, of any action; it is answered when the goal has ended.
    #[derive(Copy, Eq)]
    GetResultRequest = "nav2_msgs/action/NavigateToPose_GetResult_Request" of GET_RESULT, at most SMALL;
    {
        /// The goal.
        goal_id: Uuid,
    }
}

/// Declares a message that has a [`Part`].
macro_rules! with_part {
    ($(#[$attribute:meta])* $name:ident<$part:ident = $default:ty>; {
        $(#[$about:meta])* $first:ident: $ty:ty, $(#[$of:meta])* $second:ident
    }) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Default, PartialEq, Serialize)]
        pub struct $name<$part = $default> {
            $(#[$about])*
            pub $first: $ty,
            $(#[$of])*
            pub $second: $part,
        }

        impl<$part: Part> Cdr for $name<$part> {
            const MIN_BYTES: usize = <$ty>::MIN_BYTES + $part::MIN_BYTES;

            fn write(&self, out: &mut Writer) -> Result<(), CdrFault> {
                self.$first.write(out)?;
                self.$second.write(out)
            }

            fn read(input: &mut Reader<'_>) -> Result<Self, CdrError> {
                Ok(Self {
                    $first: named(stringify!($first), Cdr::read(input))?,
                    $second: named(stringify!($second), Cdr::read(input))?,
                })
            }
        }

        impl<$part: Part> Message for $name<$part> {
            const NAME: &'static str = $part::NAME;
            const INTERFACE: Interface = $part::INTERFACE;
            const MAX_BYTES: usize = $part::MAX_BYTES;
        }

        impl<$part: Random> Random for $name<$part> {
            fn random(rng: &mut Rng) -> Self {
                Self { $first: Random::random(rng), $second: Random::random(rng) }
            }
        }
    };
}

with_part! {
    /// Asks for what an action does.
    SendGoalRequest<G = NavigatingTo>;
    {
        /// Chosen by the client; unique.
        goal_id: Uuid,
        /// What to do.
        goal
    }
}

with_part! {
    /// What has become of a goal.
    GetResultResponse<R = Navigated>;
    {
        /// As of [`GoalStatus`]; 0 for a goal that is not known.
        status: i8,
        /// What has come out of it.
        result
    }
}

with_part! {
    /// How a goal fares.
    FeedbackMessage<F = Nothing>;
    {
        /// The goal.
        goal_id: Uuid,
        /// How far it is.
        feedback
    }
}
