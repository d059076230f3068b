//! What is known of replicas, and which are kept ready.

use super::*;

const NOW: Duration = Duration::from_secs(7);
const ALL: Wanted<'_> = Wanted { robot: "robot", count: 32 };

fn ready(slots: &[(&str, u32)]) -> Replicas {
    let mut replicas = Replicas::default();
    let alive: Vec<String> = slots.iter().map(|s| s.0.to_owned()).collect();
    replicas.update("cpc", &alive, ALL, NOW);
    assert_eq!(replicas.take_due(NOW).len(), alive.len());
    for (instance, slots) in slots {
        replicas.probed("cpc", instance, Some(*slots), NOW);
    }
    replicas
}

/// Who gets a shard of a large batch, in order.
fn asked(replicas: &mut Replicas) -> Vec<String> {
    replicas.split("cpc", 10_000).into_iter().map(|assignment| assignment.instance).collect()
}

#[test]
fn a_cold_replica_gets_nothing() {
    let mut replicas = Replicas::default();
    replicas.update("cpc", &["a".into()], ALL, NOW);
    assert!(asked(&mut replicas).is_empty() && replicas.spare("cpc", &[]).is_none());
    let probe = Probe { role: "cpc".into(), instance: "a".into() };
    assert_eq!(replicas.take_due(NOW), [probe]);
    assert!(replicas.take_due(NOW).is_empty() && asked(&mut replicas).is_empty());
    replicas.probed("cpc", "a", None, NOW);
    assert_eq!(replicas.next_due(), Some(NOW + FIRST_PAUSE));
    let mut now = NOW;
    for pause in [10, 20, 40, 80, 160, 200, 200] {
        assert!(replicas.take_due(now).is_empty());
        now += Duration::from_millis(pause);
        assert_eq!(replicas.take_due(now).len(), 1);
        replicas.probed("cpc", "a", None, now);
    }
    assert_eq!(replicas.take_due(now + PROBE_PAUSE).len(), 1);
    replicas.probed("cpc", "a", Some(1), NOW);
    assert_eq!(asked(&mut replicas), ["a"]);
}

#[test]
fn a_batch_is_split_evenly_and_every_candidate_is_in_one_shard() {
    let mut replicas = ready(&[("a", 1), ("b", 2), ("c", 1)]);
    // 2 ms are 100 candidates.
    replicas.answered("cpc", "a", 500, Duration::from_millis(10));
    for count in [1, 99, 199, 200, 399, 2000] {
        let shards = replicas.split("cpc", count);
        let all: Vec<usize> = shards.iter().flat_map(|shard| shard.range.clone()).collect();
        assert_eq!(all, (0..count).collect::<Vec<_>>());
        let longest = shards.iter().map(|shard| shard.range.len()).max().unwrap();
        let shortest = shards.iter().map(|shard| shard.range.len()).min().unwrap();
        assert!(longest - shortest <= 1, "{count}: {shards:?}");
        assert_eq!(shards.len(), (count / 100).clamp(1, 4));
    }
    assert!(Replicas::default().split("cpc", 100).is_empty());
}

#[test]
fn every_replica_has_a_shard_before_one_has_a_second() {
    let mut replicas = ready(&[("a", 2), ("b", 1), ("c", 2)]);
    let order = asked(&mut replicas);
    let first: std::collections::BTreeSet<&String> = order[..3].iter().collect();
    assert_eq!((order.len(), first.len()), (5, 3), "{order:?}");
    assert!(!order[3..].contains(&"b".to_owned()), "{order:?}");
}

#[test]
fn small_batches_go_to_one_replica_after_the_other() {
    let mut replicas = ready(&[("a", 1), ("b", 1), ("c", 1)]);
    replicas.answered("cpc", "a", 500, Duration::from_millis(10));
    let mut next = || {
        let shards = replicas.split("cpc", 100);
        assert_eq!(shards.len(), 1);
        shards[0].instance.clone()
    };
    let first: std::collections::BTreeSet<String> = [0; 3].map(|_| next()).into();
    assert_eq!(first.len(), 3);
}

#[test]
fn a_batch_is_split_by_the_fastest_answer_of_late() {
    let mut replicas = ready(&[("a", 1), ("b", 1), ("c", 1), ("d", 1)]);
    // 2 ms are 1000 candidates, also where an answer takes ten times as long now and then.
    replicas.answered("cpc", "a", 1000, Duration::from_millis(2));
    replicas.answered("cpc", "b", 1000, Duration::from_millis(20));
    assert_eq!(replicas.split("cpc", 2000).len(), 2);
    for _ in 0..200 {
        replicas.answered("cpc", "a", 1000, Duration::from_millis(20));
    }
    assert_eq!(replicas.split("cpc", 2000).len(), 4);
}

#[test]
fn only_a_few_questions_are_asked_twice_however_many_are_late() {
    let mut replicas = ready(&[("a", 1)]);
    let mut twice = 0;
    for _ in 0..2000 {
        replicas.count_question("cpc");
        twice += u32::from(replicas.may_ask_twice("cpc"));
    }
    // 8 at once and 2000 / 20 one after the other.
    assert!((100..=108).contains(&twice), "{twice}");
}

#[test]
fn a_failure_ends_the_work_until_a_probe_is_answered() {
    for failure in [Failure::Broken, Failure::Cold] {
        let mut replicas = ready(&[("a", 1)]);
        replicas.failed("cpc", "a", failure, NOW, Clock::Realtime);
        assert!(replicas.ready("cpc").is_empty());
        assert_eq!(replicas.take_due(NOW).len(), 1);
        // What it is blamed for meanwhile is no reason to ask it again.
        replicas.failed("cpc", "a", failure, NOW, Clock::Realtime);
        assert!(replicas.take_due(NOW).is_empty());
        replicas.probed("cpc", "a", Some(1), NOW);
        assert_eq!(replicas.ready("cpc"), ["a"]);
    }
}

#[test]
fn who_answers_probes_and_fails_questions_is_asked_less_and_less_often() {
    let mut replicas = ready(&[("a", 1)]);
    let fail = |replicas: &mut Replicas| {
        replicas.failed("cpc", "a", Failure::Broken, NOW, Clock::Realtime);
        let due = replicas.next_due().unwrap();
        assert_eq!(replicas.take_due(due).len(), 1);
        replicas.probed("cpc", "a", Some(1), due);
        (due - NOW).as_millis()
    };
    assert_eq!([0; 5].map(|_| fail(&mut replicas)), [0, 200, 400, 600, 600]);
    replicas.answered("cpc", "a", 100, Duration::from_millis(10));
    assert_eq!(fail(&mut replicas), 0);
}

#[test]
fn a_replica_that_refuses_again_and_again_is_asked_less_often_until_it_answers() {
    let mut replicas = ready(&[("a", 1)]);
    let rests_for = |replicas: &mut Replicas| {
        replicas.failed("cpc", "a", Failure::Overloaded, NOW, Clock::Realtime);
        // It is still ready, and no probe is needed.
        assert!(replicas.ready("cpc") == ["a"] && replicas.next_due().is_none());
        (0..).step_by(100).find(|&ms| {
            replicas.wake(NOW + Duration::from_millis(ms));
            !asked(replicas).is_empty()
        })
    };
    assert_eq!([0; 5].map(|_| rests_for(&mut replicas)), [0, 200, 200, 200, 200].map(Some));
    replicas.answered("cpc", "a", 100, Duration::from_millis(10));
    assert_eq!(rests_for(&mut replicas), Some(0));
}

#[test]
fn a_preferred_generator_that_has_no_time_for_a_probe_keeps_its_place() {
    let pool: Vec<String> = (0..6).map(|i| format!("generator-{i}")).collect();
    let mut replicas = Replicas::default();
    replicas.update(keys::GENERATOR, &pool, Wanted { robot: "r", count: 2 }, NOW);
    let first = replicas.take_due(NOW);
    first.iter().for_each(|probe| replicas.put_off(&probe.role, &probe.instance, NOW));
    assert!(replicas.take_due(NOW).is_empty(), "another one is asked, and has to prepare");
    assert_eq!(replicas.take_due(NOW + PROBE_PAUSE), first);
}

#[test]
fn a_spare_is_another_and_the_next_in_turn() {
    let mut replicas = ready(&[("a", 1), ("b", 1), ("c", 1)]);
    let order = asked(&mut replicas);
    for turn in 0..3 {
        let first = order[turn].clone();
        let second = replicas.spare("cpc", std::slice::from_ref(&first)).unwrap();
        assert_eq!(second, order[(turn + 1) % 3]);
        let third = replicas.spare("cpc", &[first.clone(), second.clone()]).unwrap();
        assert_eq!(third, order[(turn + 2) % 3]);
        assert_eq!(replicas.spare("cpc", &[first, second, third]), None);
    }
}

/// The generators that each of 100 robots keeps ready, of `pool`.
fn kept_ready(pool: &[String], count: usize) -> Vec<Vec<String>> {
    (0..100)
        .map(|i| {
            let robot = format!("robot-{i}");
            let mut replicas = Replicas::default();
            replicas.update(keys::GENERATOR, pool, Wanted { robot: &robot, count }, NOW);
            for Probe { role, instance } in replicas.take_due(NOW) {
                replicas.probed(&role, &instance, Some(1), NOW);
            }
            assert!(replicas.take_due(NOW).is_empty() && replicas.next_due().is_none());
            replicas.preferred(keys::GENERATOR)
        })
        .collect()
}

#[test]
fn each_generator_sees_the_goals_of_few_robots_and_a_new_one_takes_over_its_share_alone() {
    let pool: Vec<String> = (0..8).map(|i| format!("generator-{i}")).collect();
    let before = kept_ready(&pool, 2);
    assert!(before.iter().all(|kept| kept.len() == 2));
    let sees = |kept: &[Vec<String>], g: &String| kept.iter().filter(|of| of.contains(g)).count();
    let goals: Vec<usize> = pool.iter().map(|g| sees(&before, g)).collect();
    // 25 on average.
    assert!(goals.iter().all(|count| (10..=40).contains(count)), "{goals:?}");
    let mut more = pool.clone();
    more.push("generator-new".into());
    let after = kept_ready(&more, 2);
    for (before, after) in before.iter().zip(&after) {
        let stayed = after.iter().filter(|g| before.contains(g)).count();
        assert!(stayed == 2 || (stayed == 1 && after.contains(&more[8])), "{before:?} {after:?}");
    }
}

#[test]
fn a_preferred_generator_that_comes_back_is_kept_ready_again() {
    let pool: Vec<String> = (0..6).map(|i| format!("generator-{i}")).collect();
    let wanted = Wanted { robot: "r", count: 2 };
    let mut replicas = Replicas::default();
    let ready = |replicas: &mut Replicas, alive: &[String]| {
        replicas.update(keys::GENERATOR, alive, wanted, NOW);
        for Probe { role, instance } in replicas.take_due(NOW) {
            replicas.probed(&role, &instance, Some(1), NOW);
        }
        replicas.preferred(keys::GENERATOR)
    };
    let first = ready(&mut replicas, &pool);
    let without: Vec<String> = pool.iter().filter(|g| **g != first[0]).cloned().collect();
    let meanwhile = ready(&mut replicas, &without);
    assert!(meanwhile.len() == 2 && meanwhile[0] == first[1]);
    assert_eq!(ready(&mut replicas, &pool)[..2], first[..]);
}

#[test]
fn a_generator_that_refuses_comes_after_those_that_refused_before_it() {
    let pool: Vec<String> = (0..6).map(|i| format!("generator-{i}")).collect();
    let mut replicas = Replicas::default();
    replicas.update(keys::GENERATOR, &pool, Wanted { robot: "r", count: 2 }, NOW);
    for Probe { role, instance } in replicas.take_due(NOW) {
        replicas.probed(&role, &instance, Some(1), NOW);
    }
    let own = replicas.preferred(keys::GENERATOR);
    for turn in 0..4 {
        let first = &replicas.preferred(keys::GENERATOR)[0];
        assert_eq!(*first, own[turn % 2]);
        replicas.failed(keys::GENERATOR, first, Failure::Overloaded, NOW, Clock::Lockstep);
        replicas.wake(NOW);
    }
}

#[test]
fn a_replica_that_fails_its_probes_gives_its_place_to_another() {
    let mut replicas = Replicas::default();
    let alive: Vec<String> = (0..100).map(|i| format!("invented-{i}")).chain(["real".into()]).collect();
    replicas.update("cpc", &alive, Wanted { robot: "r", count: 4 }, NOW);
    let mut now = NOW;
    let mut probes = 0;
    while replicas.ready("cpc").is_empty() {
        let due = replicas.take_due(now);
        assert!(due.len() <= 4 && probes < 120, "{probes} probes");
        for Probe { role, instance } in due {
            probes += 1;
            let slots = (instance == "real").then_some(1);
            replicas.probed(&role, &instance, slots, now);
        }
        now += PROBE_PAUSE;
    }
}

#[test]
fn who_is_gone_is_forgotten() {
    let mut replicas = ready(&[("a", 1), ("b", 1)]);
    replicas.update("cpc", &["b".into()], ALL, NOW);
    replicas.probed("cpc", "a", Some(1), NOW);
    assert_eq!((replicas.ready("cpc"), replicas.known()), (vec!["b".to_owned()], 1));
}
