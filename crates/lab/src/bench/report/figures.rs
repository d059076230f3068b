//! Each scenario's ways, uncertainty and speed.

use curionav_schemas::RunResult;

use super::super::findings::Findings;
use super::html::escaped;
use curionav_picture::{Course, Site, comparison_svg, planner_colour};

pub(super) fn figures(bench: &Findings<'_>) -> String {
    let mut text =
        "<h2 class=\"page\">Ways, uncertainty and speed</h2>\n<p>As Figs. 4 and 5 of the paper.</p>\n"
            .to_owned();
    for (s, scene) in bench.scenes.iter().enumerate() {
        let class = if s == 0 { "" } else { "page" };
        text += &format!(
            "<figure class=\"{class}\">\n<figcaption><b>{}</b>, {} people. {}</figcaption>\n{}\n</figure>\n",
            escaped(&scene.name),
            scene.people,
            escaped(&scene.description),
            figure(bench, s)
        );
    }
    text
}

fn figure(bench: &Findings<'_>, s: usize) -> String {
    let scene = &bench.scenes[s];
    let id = format!("floor-{s}");
    let site = Site {
        id: &id,
        map: &scene.map,
        start: scene.start,
        goal: scene.goal,
        goal_tolerance: scene.goal_tolerance,
        robot_radius: scene.robot_radius,
        person_radius: scene.person_radius,
        threshold: scene.threshold,
    };
    let shown: Vec<Option<RunResult>> =
        bench.comparison.planners.iter().map(|planner| bench.trace(&scene.name, planner)).collect();
    let courses: Vec<Course<'_>> = (bench.comparison.planners.iter().enumerate().zip(&shown))
        .map(|((p, name), shown)| Course {
            name,
            colour: planner_colour(name, p),
            ways: bench
                .comparison
                .runs(s, p)
                .map(|row| row.way.iter().map(|[x, y]| (*x, *y)).collect())
                .collect(),
            shown: shown.as_ref(),
        })
        .collect();
    comparison_svg(&site, &courses)
}
