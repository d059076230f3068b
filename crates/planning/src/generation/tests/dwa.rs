//! Claims about `dwa`: the window of speeds that can be reached, and its critics.

use super::*;

fn dwa(change: impl Fn(&mut GeneratorPart)) -> Generator {
    let mut part = Profile::builtin("dwa").unwrap().generator_part();
    change(&mut part);
    Generator::new("dwa", part)
}

/// A robot that drives north at 0.5 m/s in an open hall, 12 m from its goal, and people at `x, y` who stand.
fn northwards(stand: &[[f64; 2]]) -> (World, Scene) {
    let people: Vec<[f64; 4]> = stand.iter().map(|[x, y]| [*x, *y, 0.0, 0.0]).collect();
    let world = World::new(hall(&[]), Point2::new(15.0, 24.0));
    let north = Pose2::new(15.0, 12.0, std::f64::consts::FRAC_PI_2);
    (world, scene(0, north, Twist { v: 0.5, omega: 0.0 }, &People::walking(0.3, &people)))
}

#[test]
fn each_arc_is_one_command_that_can_be_reached_within_a_step() {
    let (world, scene) = northwards(&[[16.2, 14.0]]);
    let generator = dwa(|_| {});
    let set = generator.generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates;
    let states = set.all_states();
    let dt = set.dt();
    let [faster, turning] = [world.robot.a_max * dt, world.robot.alpha_max * dt];
    let mut speeds = BTreeSet::new();
    for i in 0..set.len() {
        let first = set.range(i).start;
        let v = states.v[first];
        let omega = states.omega[first];
        assert!((v - 0.5).abs() < faster + 1e-9 && omega.abs() < turning + 1e-9, "{v} m/s, {omega} rad/s");
        // An arc of 1.7 s is five states long; one that is driven for a step alone brakes after it.
        if states.v[first + 1] > v - 1e-9 {
            let goes_on =
                (first..first + 5).all(|k| (states.v[k] - v).abs() + (states.omega[k] - omega).abs() < 1e-9);
            assert!(goes_on, "candidate {i} changes its command");
            speeds.insert((v * 1e6) as i64);
        }
    }
    assert!(speeds.len() > 1, "all arcs have one speed");
}

#[test]
fn alone_the_fastest_and_straightest_arc_of_the_window_comes_first() {
    let (world, scene) = northwards(&[]);
    let set = dwa(|_| {}).generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates;
    let first = set.range(0).start;
    let states = set.all_states();
    assert!((states.v[first] - 0.5 - world.robot.a_max * set.dt()).abs() < 1e-9, "{} m/s", states.v[first]);
    // Twenty turn rates from -0.3 to 0.3 rad/s: the least are 0.3 / 19 to either side.
    assert!(
        states.omega[first].abs() < world.robot.alpha_max * set.dt() / 19.0 + 1e-9,
        "{}",
        states.omega[first]
    );
}

#[test]
fn the_critic_for_obstacles_keeps_off_and_the_one_for_the_way_holds_against_it() {
    let (world, scene) = northwards(&[[16.4, 13.8]]);
    let aside = |path: f64, obstacle: f64| {
        let generator = dwa(|part| {
            let dwa = &mut part.generation.dwa;
            (dwa.path, dwa.obstacle) = (path, obstacle);
        });
        let set = generator.generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates;
        15.0 - set.all_states().position(set.range(0).start + 4).x
    };
    let [without, with, held] = [aside(16.0, 0.0), aside(16.0, 200.0), aside(1000.0, 200.0)];
    assert!(with > without + 0.05, "{with} m aside with the critic, {without} m without");
    assert!(held < with - 0.02, "{held} m aside where the way weighs more, {with} m where it does not");
}
