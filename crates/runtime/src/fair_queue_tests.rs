//! The queue by itself, and many robots at one replica that is too slow for them.

use super::*;

const NOW: Duration = Duration::from_secs(7);

#[test]
fn robots_are_served_in_turn_each_in_its_own_order() {
    let mut queue = FairQueue::new(1, 16, 1000);
    for (robot, item) in [("a", 1), ("a", 2), ("a", 3), ("b", 4), ("c", 5), ("b", 6)] {
        assert!(queue.push(robot, 1, NOW, item).is_empty());
    }
    let served: Vec<i32> = std::iter::from_fn(|| queue.pop()).collect();
    assert_eq!(served, [1, 4, 5, 2, 6, 3]);
    assert!(queue.waiting() == 0 && queue.lines.is_empty());
}

#[test]
fn a_full_queue_refuses_the_robot_that_has_more_than_a_share() {
    let mut queue = FairQueue::new(1, 4, 1000);
    for item in 0..4 {
        assert!(queue.push("greedy", 1, NOW, item).is_empty());
    }
    assert_eq!(queue.push("greedy", 1, NOW, 4), [4]);
    assert_eq!(queue.push("modest", 1, NOW, 5), [3]);
    assert_eq!(queue.push("modest", 1, NOW, 6), [2]);
    // Two each: the next is refused, whichever sends it.
    assert_eq!(queue.push("modest", 1, NOW, 7), [7]);
    assert_eq!(queue.push("greedy", 1, NOW, 8), [8]);
    assert_eq!(queue.push("third", 1, NOW, 9), [1]);
    assert_eq!(queue.waiting(), 4);
}

#[test]
fn the_line_of_a_robot_that_is_served_for_good_takes_no_room() {
    let mut queue = FairQueue::new(1, 2, 1000);
    for robot in 0..3000 {
        queue.push(&format!("robot-{robot}"), 1, NOW, robot);
        queue.pop();
    }
    assert!(queue.lines.is_empty() && queue.order.is_empty() && queue.pop().is_none());
    assert_eq!(queue.robots.len(), ROBOTS_MAX);
}

#[test]
fn a_queue_that_is_full_of_bytes_refuses_the_robot_that_has_most_of_them() {
    let mut queue = FairQueue::new(1, 100, 100);
    assert!(queue.push("large", 40, NOW, 1).is_empty());
    assert!(queue.push("large", 40, NOW, 2).is_empty());
    assert!(queue.push("small", 10, NOW, 3).is_empty());
    // No room for 90 more, and nothing that would make it.
    assert_eq!(queue.push("other", 90, NOW, 4), [4]);
    assert_eq!(queue.push("small", 20, NOW, 5), [2]);
    assert_eq!(queue.push("large", 1000, NOW, 6), [6]);
    let left: Vec<i32> = std::iter::from_fn(|| queue.pop()).collect();
    assert_eq!((left, queue.bytes), (vec![1, 3, 5], 0));
}

#[test]
fn many_items_must_go_for_a_large_one_of_a_robot_that_has_little() {
    let mut queue = FairQueue::new(1, 100, 100);
    (0..10).for_each(|item| assert!(queue.push("greedy", 10, NOW, item).is_empty()));
    assert_eq!(queue.push("modest", 25, NOW, 10), [9, 8, 7]);
    assert_eq!(queue.waiting(), 8);
}

const MS: Duration = Duration::from_millis(1);
/// Between two questions of a robot.
const PERIOD: Duration = Duration::from_millis(100);
/// What it gives for the answer.
const BUDGET: Duration = Duration::from_millis(40);

/// What came of the questions.
struct Outcome {
    /// Answers in time, by robot.
    answered: Vec<f64>,
    late: u32,
}

/// So many robots ask a replica of two slots in every period, always in the same order; each answer takes `takes`.
fn ask_in_every_period(robots: u32, takes: Duration) -> Outcome {
    let mut queue = FairQueue::new(2, 16, 1000);
    let slots = 2;
    let periods = 100;
    let mut outcome = Outcome { answered: vec![0.0; robots as usize], late: 0 };
    // When each at work is done, whose it is and when it came.
    let mut at_work: Vec<(Duration, usize, Duration)> = Vec::new();
    for step in 0..periods * 100 {
        let now = MS * step;
        at_work.retain(|&(done, robot, came)| {
            if done <= now {
                queue.done(&robot.to_string(), Some(takes), Some(BUDGET));
                let is_late = done > came + BUDGET;
                outcome.late += u32::from(is_late);
                outcome.answered[robot] += f64::from(u32::from(!is_late));
            }
            done > now
        });
        let due = |robot: &u32| step % 100 == robot * 100 / robots;
        for robot in (0..robots).filter(due) {
            queue.push(&robot.to_string(), 1, now, (robot as usize, now));
        }
        while at_work.len() < slots {
            let Some((robot, came)) = queue.pop() else { break };
            at_work.push((now + takes, robot, came));
        }
    }
    outcome
}

fn jain(shares: &[f64]) -> f64 {
    let (sum, squares): (f64, f64) = (shares.iter().sum(), shares.iter().map(|x| x * x).sum());
    sum * sum / (shares.len() as f64 * squares)
}

#[test]
fn robots_that_always_ask_in_the_same_order_get_the_same_share_and_nothing_is_done_in_vain() {
    // Two slots answer 20 questions of 10 ms per period.
    for robots in [10, 19, 30, 40, 100] {
        let Outcome { answered, late } = ask_in_every_period(robots, 10 * MS);
        let share = answered.iter().sum::<f64>() / 100.0;
        let most = f64::from(robots.min(20));
        println!(
            "{robots} robots: {share:.1} of {most} answers per period, {late} late, {:.4}",
            jain(&answered)
        );
        assert!(share > 0.95 * most, "{robots} robots: {share:.1} of {most}");
        assert!(jain(&answered) > 0.98, "{robots} robots: {answered:?}");
        // Before a robot's first answer nothing is known of the time that it gives.
        assert!(late <= robots, "{robots} robots: {late}");
    }
}

#[test]
fn a_replica_that_was_slow_once_is_found_to_be_fast_again() {
    let mut queue = FairQueue::new(1, 16, 1000);
    queue.push("a", 1, NOW, 0);
    queue.pop();
    // A second instead of some milliseconds.
    queue.done("a", Some(Duration::from_secs(1)), Some(BUDGET));
    for round in 1..100 {
        let now = NOW + PERIOD * round;
        assert!(queue.push("a", 1, now, round).is_empty(), "what nothing is in the way of is refused");
        assert_eq!(queue.pop(), Some(round));
        queue.done("a", Some(MS), Some(BUDGET));
    }
    queue.push("a", 1, NOW, 0);
    assert!(queue.push("a", 1, NOW, 0).is_empty() && queue.waiting() == 2);
}

#[test]
fn a_robot_that_gives_much_time_is_not_refused_for_those_that_give_little() {
    let mut queue = FairQueue::new(1, 16, 1000);
    for (robot, budget) in [("patient", Duration::from_secs(4)), ("hasty", BUDGET)] {
        queue.push(robot, 1, NOW, robot);
        queue.pop();
        queue.done(robot, Some(30 * MS), Some(budget));
    }
    // One at work, and each waits behind it.
    queue.push("other", 1, NOW, "other");
    queue.pop();
    assert!(queue.push("patient", 1, NOW, "patient").is_empty());
    assert_eq!(queue.push("hasty", 1, NOW, "hasty"), ["hasty"]);
}

#[test]
fn questions_that_gave_little_time_do_not_shut_their_robot_out_where_others_give_more() {
    // How often a robot is refused that asks a busy replica, after questions that gave these times.
    let refused = |budgets: [Duration; 2]| {
        let mut queue = FairQueue::new(1, 16, 1000);
        let others = [("b", BUDGET); 20].into_iter();
        for (robot, budget) in others.chain(budgets.map(|budget| ("a", budget))) {
            queue.push(robot, 1, NOW, 0);
            queue.pop();
            queue.done(robot, Some(10 * MS), Some(budget));
        }
        queue.push("b", 1, NOW, 0);
        queue.pop();
        (0..1000).find(|_| queue.push("a", 1, NOW, 0).is_empty()).unwrap()
    };
    assert_eq!(refused([BUDGET, 2 * MS]), 0);
    // 10 ms behind one that is half done are 15 ms: 2 ms times 1.05^42.
    assert_eq!(refused([2 * MS, 2 * MS]), 42);
}
