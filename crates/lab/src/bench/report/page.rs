//! What `templates/report.html` asks for.

use std::collections::BTreeMap;
use std::ops::Add;
use std::path::Path;

use askama::Template;
use curionav_picture::{Course, ShareCurve, Site, comparison_svg, planner_colour, shares_svg};
use curionav_schemas::RunResult;

use super::super::claims::shown_p;
use super::super::comparison::{Order, Paired};
use super::super::density::Densities;
use super::super::findings::Findings;
use super::super::measure::Measure;
use super::super::plan::Scene;
use super::super::published::{SLIPS, published};
use super::super::row::{Blame, Tally};
use super::words::{KINDS, MEASURES, PLANNERS};
use crate::paper::PUBLISHED;
use crate::plural::count;
use crate::statistics::{least_p, mean, median, share_interval};

/// A difference counts below this p.
pub(super) const SIGNIFICANT: f64 = 0.01;
/// Measures whose means a few lost or stuck runs rule.
const MEDIANS: [Measure; 4] = [Measure::Rmse, Measure::Tce, Measure::TdSeconds, Measure::Time];
/// A way is a long one beyond so many times the shortest.
const LONG_WAY: f64 = 2.0;

/// Kinds of scenes that fit the page beside each other.
const KINDS_ABREAST: usize = 10;

/// So many planners stand beside each other in a table with several measures of each.
const PLANNERS_ABREAST: usize = 6;
/// What the template asks for. It hands over every argument by reference.
#[derive(Template)]
#[template(path = "report.html")]
pub(super) struct Page<'a> {
    pub(super) bench: &'a Findings<'a>,
    title: String,
    /// What a reader must take home who reads nothing else.
    pub(super) in_short: Vec<String>,
    /// Each planner but the first against the first, over all scenarios, with Holm's p over all of them.
    pub(super) tests: BTreeMap<(Measure, usize), Paired>,
}

fn tests(bench: &Findings<'_>) -> BTreeMap<(Measure, usize), Paired> {
    let others = 1..bench.comparison.planners.len();
    let of = |measure: Measure| {
        others
            .clone()
            .filter_map(move |p| Some(((measure, p), bench.comparison.paired(measure, p, 0, None)?)))
    };
    let (cells, mut paired): (Vec<_>, Vec<_>) = Measure::ALL.into_iter().flat_map(of).unzip();
    Paired::correct(paired.iter_mut());
    cells.into_iter().zip(paired).collect()
}

impl<'a> Page<'a> {
    pub(super) fn new(bench: &'a Findings<'a>) -> Self {
        let title = format!(
            "{} in {} in {}: {} runs",
            count(bench.comparison.planners.len(), "planner"),
            count(bench.comparison.scenarios.len(), "scenario"),
            count(bench.comparison.count_places(), "place"),
            bench.comparison.count_runs()
        );
        Self { bench, title, in_short: Vec::new(), tests: tests(bench) }
    }

    fn seeds(&self) -> String {
        let (first, last) =
            (self.bench.first_seed, self.bench.first_seed + u64::from(self.bench.repeats) - 1);
        if first == last { format!("seed {first}") } else { format!("seeds {first} to {last}") }
    }

    pub(super) fn planners(&self) -> std::ops::Range<usize> {
        0..self.bench.comparison.planners.len()
    }

    fn scenarios(&self) -> impl Iterator<Item = (usize, &String)> {
        self.bench.comparison.scenarios.iter().enumerate()
    }

    pub(super) fn name(&self, planner: &usize) -> &str {
        &self.bench.comparison.planners[*planner]
    }

    fn colour(&self, planner: &usize) -> &'static str {
        planner_colour(self.name(planner), *planner)
    }

    /// Several planners at a time, for wide tables.
    fn abreast(&self) -> Vec<Vec<usize>> {
        self.planners().collect::<Vec<_>>().chunks(PLANNERS_ABREAST).map(<[_]>::to_vec).collect()
    }

    /// Where settings come from, and whose they are.
    fn settings(&self) -> BTreeMap<String, Vec<&str>> {
        let mut planners: BTreeMap<String, Vec<&str>> = BTreeMap::new();
        for planner in self.bench.planners {
            let folder = Path::new(&planner.source).parent().filter(|_| planner.source != planner.name);
            let from =
                folder.map_or("built in".into(), |folder| format!("from files in {}", folder.display()));
            planners.entry(from).or_default().push(&planner.name);
        }
        planners
    }

    /// After how many seconds runs are over: one number, or the least and the greatest.
    fn time_limits(&self) -> String {
        let limits = || self.bench.scenes.iter().map(|scene| scene.scenario.clock.time_limit_s);
        let (least, most) = (limits().fold(f64::INFINITY, f64::min), limits().fold(0.0, f64::max));
        if least < most { format!("{least} to {most}") } else { most.to_string() }
    }

    /// How often a planner's first choice was driven, and, if every run tells, how often not because the final check
    /// refused it, because only slow candidates passed the check, because the last to collide was followed, because none
    /// passed, and because there was no candidate; per cent of its cycles.
    fn choices(&self, planner: &usize) -> [String; 2] {
        let tally = self.tally(planner);
        let share = |part: u64| format!("{:.0}", 100.0 * part as f64 / tally.cycles.max(1) as f64);
        let split = tally.not_first().map_or_else(String::new, |parts| parts.map(share).join(", "));
        [share(tally.first_choices), split]
    }

    /// The planners that something must be said of.
    fn caveats(&self) -> impl Iterator<Item = (usize, &'static str)> {
        let words = |p| Some((p, PLANNERS.iter().find(|(name, _)| *name == self.name(&p))?.1));
        self.planners().filter_map(words)
    }

    fn measures(&self) -> [(&'static str, &'static str); MEASURES.len()] {
        MEASURES
    }

    /// Rows of Table II: what a scene has, the number of its place, and what the paper prints of it.
    fn scenes(&self) -> impl Iterator<Item = [String; 9]> {
        self.bench.scenes.iter().zip(&self.bench.comparison.places).map(|(scene, place)| {
            let theirs = PUBLISHED.iter().find(|published| published.name == scene.name());
            let beside = |ours: usize, theirs: Option<usize>| match theirs {
                Some(theirs) => format!("{ours} ({theirs})"),
                None => ours.to_string(),
            };
            let Scene { scenario, map, .. } = scene;
            let known = map.cells.iter().filter(|cell| **cell >= 0).count();
            let landmarks = map.cells.iter().filter(|cell| **cell > 0).count();
            let side = map.resolution;
            let half_disc = 0.5 * std::f64::consts::PI * scenario.laser.range_max * scenario.laser.range_max;
            let rate = 100.0 * half_disc / (known as f64 * side * side);
            let paper_rate = theirs.map_or_else(String::new, |t| format!(" ({:.2})", 100.0 * t.laser_rate));
            [
                scene.name().to_owned(),
                (place + 1).to_string(),
                beside(scene.people(), theirs.map(|t| t.people)),
                scene.motion(),
                format!("{:.3}", scene.density()),
                beside(known, theirs.map(|t| t.known_cells)),
                beside(landmarks, theirs.map(|t| t.landmark_cells)),
                format!("{:.1} m", scenario.laser.range_max),
                format!("{rate:.2}{paper_rate}"),
            ]
        })
    }

    /// Success over density as a picture.
    fn density_curves(&self, densities: &Densities) -> String {
        let curve = |p: usize| {
            let shares = densities.runs_of(&p).iter().map(Tally::share);
            ShareCurve {
                colour: self.colour(&p),
                points: densities.levels.iter().copied().zip(shares).collect(),
            }
        };
        shares_svg(&self.planners().map(curve).collect::<Vec<_>>())
    }

    /// How each planner fared in the scenarios whose names begin alike, up to the first `-`; nothing where that would be
    /// one kind, or more than fit the page.
    pub(super) fn kinds(&self) -> BTreeMap<&str, Vec<Tally>> {
        let comparison = &self.bench.comparison;
        let mut kinds: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (scenario, name) in self.scenarios() {
            kinds.entry(name.split('-').next().unwrap_or(name)).or_default().push(scenario);
        }
        if !(2..=KINDS_ABREAST).contains(&kinds.len()) {
            return BTreeMap::new();
        }
        let tally = |scenarios: &[usize], planner: usize| {
            Tally::of(scenarios.iter().flat_map(|scenario| comparison.runs(*scenario, planner)))
        };
        let tallies = |scenarios: Vec<usize>| self.planners().map(|p| tally(&scenarios, p)).collect();
        kinds.into_iter().map(|(kind, scenarios)| (kind, tallies(scenarios))).collect()
    }

    /// What a kind of scenes is, where its name does not say it.
    fn meaning(&self, kind: &str) -> Option<&'static str> {
        KINDS.iter().find(|(name, _)| *name == kind).map(|(_, meaning)| *meaning)
    }

    /// The least p that a test of the places can have.
    pub(super) fn least_p(&self) -> f64 {
        least_p(self.bench.comparison.count_places())
    }

    pub(super) fn claims_that_hold(&self) -> usize {
        self.bench.claims.iter().filter(|judged| judged.holds).count()
    }

    fn claims_beyond_reach(&self) -> usize {
        self.bench.claims.iter().filter(|judged| !judged.holds && judged.too_few).count()
    }

    fn blame(&self, planner: &usize) -> Blame {
        Blame::of(self.bench.comparison.all_runs(*planner))
    }

    pub(super) fn tally(&self, planner: &usize) -> Tally {
        Tally::of(self.bench.comparison.all_runs(*planner))
    }

    /// The 95 % interval of the share of runs that reached the goal without collision, per cent.
    pub(super) fn success_interval(&self, tally: &Tally) -> String {
        let Tally { success, runs, .. } = *tally;
        let shown = |(low, high): (f64, f64)| format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high);
        share_interval(success, runs).map_or_else(String::new, shown)
    }

    /// How many runs drove more than twice the shortest way to the goal, of how many that reached it; and the mean time that
    /// the robot stood frozen, seconds.
    fn troubles(&self, planner: &usize) -> (usize, usize, String) {
        let detours = self.values(Measure::Detour, planner);
        let long = detours.iter().filter(|detour| **detour > LONG_WAY).count();
        (long, detours.len(), shown(Measure::Frozen, mean(&self.values(Measure::Frozen, planner))))
    }

    /// The values of all runs of a planner that have one.
    pub(super) fn values(&self, measure: Measure, planner: &usize) -> Vec<f64> {
        self.bench.comparison.all_runs(*planner).filter_map(|row| measure.of(row)).collect()
    }

    /// The median over all runs of a planner, which a few lost ones do not rule. What never came in a run came later than in
    /// any other.
    fn median(&self, measure: &Measure, planner: &usize) -> String {
        let never = (*measure == Measure::Tce).then_some(f64::INFINITY);
        let rows = self.bench.comparison.all_runs(*planner);
        let values: Vec<f64> = rows.filter_map(|row| measure.of(row).or(never)).collect();
        match median(&values) {
            Some(f64::INFINITY) => "never".into(),
            typical => shown(*measure, typical),
        }
    }

    fn real_time_factor(&self, planner: &usize) -> String {
        self.bench.real_time_factor(*planner).map_or_else(String::new, |factor| format!("{factor:.1}"))
    }

    fn workers(&self) -> String {
        count(self.bench.workers, "run")
    }

    fn minutes(&self) -> String {
        format!("{:.1}", self.bench.clock.as_secs_f64() / 60.0)
    }

    fn is_best(&self, measure: &Measure, scenario: &usize, planner: &usize) -> bool {
        self.bench.comparison.is_best(*measure, *scenario, *planner)
    }

    fn own(&self, measure: &Measure, scenario: &usize, planner: &usize) -> Option<(String, String)> {
        let own = self.bench.comparison.spread(*measure, *scenario, *planner)?;
        let sd = if own.runs > 1 { format!("\u{b1}{}", measure.show(own.sd)) } else { String::new() };
        Some((measure.show(own.mean), sd + &self.runs_behind(own.runs, scenario, planner)))
    }

    fn mean(&self, measure: &Measure, scenario: &usize, planner: &usize) -> Option<(String, String)> {
        let own = self.bench.comparison.spread(*measure, *scenario, *planner)?;
        let bounds = interval(*measure, own.low, own.high);
        Some((measure.show(own.mean), bounds + &self.runs_behind(own.runs, scenario, planner)))
    }

    /// How many runs a mean is of, if some have no value.
    fn runs_behind(&self, runs: usize, scenario: &usize, planner: &usize) -> String {
        let all = self.bench.comparison.runs(*scenario, *planner).count();
        if runs < all { format!(" of {runs}") } else { String::new() }
    }

    /// How much of a 95 % interval of so few seeds can be: it lies between the least and the greatest of them.
    fn coverage(&self) -> Option<String> {
        let covered = 1.0 - least_p(self.bench.repeats as usize);
        (covered < 0.95).then(|| format!("{:.1} %", 100.0 * covered))
    }

    /// What the paper prints, and the mark of a slip.
    fn theirs(&self, measure: &Measure, scenario: &usize, planner: &usize) -> Option<(String, Option<char>)> {
        let theirs = published(*measure, self.name(planner), &self.bench.comparison.scenarios[*scenario])?;
        let is_whole = matches!(measure, Measure::Nm | Measure::Nt);
        let mean = if is_whole { theirs.mean.to_string() } else { measure.show(theirs.mean) };
        let sd = theirs.sd.map_or_else(String::new, |sd| format!("\u{b1}{}", measure.show(sd)));
        Some((mean + &sd, theirs.slip))
    }

    /// A planner against the first one: class of the cell, difference, its interval, and the two lines of the test.
    fn paired(
        &self,
        measure: &Measure,
        planner: &usize,
    ) -> Option<(&'static str, String, String, [String; 2])> {
        let Paired { difference, low, high, p, p_of_runs, units, nonzero, differ, agree, .. } =
            *self.tests.get(&(*measure, *planner))?;
        let verdict = match (p < SIGNIFICANT, p_of_runs < SIGNIFICANT, measure.prefers(0.0, difference)) {
            (true, _, true) => "pass",
            (true, _, false) => "miss",
            (false, true, true) => "here pass",
            (false, true, false) => "here miss",
            (false, false, _) => "",
        };
        let test = [
            format!("{}, n = {nonzero} of {units}; {agree} of {differ}", shown_p(p)),
            format!("{} of the runs", shown_p(p_of_runs)),
        ];
        Some((verdict, measure.show(difference), interval(*measure, low, high), test))
    }

    /// The paper's tables: title, measures, and what to know when reading.
    fn tables(&self) -> impl Iterator<Item = (&str, &[Measure], &str)> {
        const TABLES: [(&str, &str); 3] = [
            (
                "Table III: localisation",
                "TCM is a share of the run: one that ends only with its time has a small share before convergence.",
            ),
            (
                "Table IV: human awareness",
                "TD is a share of the run: at the same seconds near people a slower planner has the smaller one. The paper's text calls its CNC worse than its CPC; for TD that holds in 9 of its 13 scenarios.",
            ),
            ("Table V: efficiency", "Length and Time here: of the runs that reached the goal."),
        ];
        TABLES
            .iter()
            .zip(Measure::PAPER.chunks(3))
            .map(|((title, remark), measures)| (*title, measures, *remark))
    }

    fn slips(&self, measures: &[Measure], planners: &[usize]) -> Vec<(char, &'static str)> {
        let cells = self.scenarios().flat_map(|(s, _)| planners.iter().map(move |p| (s, *p)));
        let shown: Vec<char> =
            cells.flat_map(|(s, p)| measures.iter().filter_map(move |m| self.theirs(m, &s, &p)?.1)).collect();
        SLIPS.into_iter().filter(|(mark, _)| shown.contains(mark)).collect()
    }

    fn order(&self, measure: &Measure, scenario: &usize) -> Order {
        self.bench.comparison.order(*measure, *scenario)
    }

    /// How many pairs are in the paper's order over all scenarios, measure by measure.
    pub(super) fn totals(&self) -> [Order; Measure::PAPER.len()] {
        Measure::PAPER.map(|m| {
            let orders = self.scenarios().map(|(s, _)| self.order(&m, &s));
            orders.fold(Order::default(), Order::add)
        })
    }

    /// Whether the paper has numbers of any of these scenes.
    fn has_order(&self) -> bool {
        self.totals().iter().any(|order| order.pairs > 0)
    }

    fn figure(&self, s: &usize) -> String {
        let scene = &self.bench.scenes[*s];
        let robot = &scene.scenario.robot;
        let comparison = &self.bench.comparison;
        let site = Site {
            id: &format!("floor-{s}"),
            map: &scene.map,
            bare: &scene.bare,
            start: (robot.start.x, robot.start.y),
            goal: (robot.goal.x, robot.goal.y),
            goal_tolerance: robot.goal_tolerance,
            robot_radius: robot.model.radius(),
            person_radius: scene.scenario.people.radius,
            threshold: scene.threshold,
        };
        let shown: Vec<Option<RunResult>> = comparison
            .planners
            .iter()
            .map(|planner| self.bench.trace(&scene.scenario.name, planner))
            .collect();
        let course = |p: usize| Course {
            name: self.name(&p),
            colour: self.colour(&p),
            ways: comparison.runs(*s, p).map(|row| row.way.iter().map(|[x, y]| (*x, *y)).collect()).collect(),
            shown: shown[p].as_ref(),
        };
        comparison_svg(&site, &self.planners().map(course).collect::<Vec<_>>())
    }
}

/// The value, or a dash where there is none.
fn shown(measure: Measure, value: Option<f64>) -> String {
    value.map_or_else(|| "\u{2013}".into(), |value| measure.show(value))
}

fn interval(measure: Measure, low: f64, high: f64) -> String {
    format!("[{}, {}]", measure.show(low), measure.show(high))
}
