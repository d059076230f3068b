//! The first lines of the report: what a reader must take home who reads nothing else.

use super::super::measure::Measure;
use super::super::row::Tally;
use super::{Page, SIGNIFICANT};
use crate::plural::count;
use crate::statistics::{mean, median};

/// A kind of scenes is named if it has more than this share of the failures.
const MOST: f64 = 0.5;

/// Sentences about the first planner against the others, and about how far they reach.
pub(super) fn sentences(page: &Page<'_>) -> Vec<String> {
    let others: Vec<usize> = page.planners().skip(1).collect();
    let all = [Some(success(page, &others)), failures(page, &others), time(page, &others), people(page, &others)];
    all.into_iter().flatten().chain(claims(page)).chain(order(page)).chain([places(page)]).collect()
}

fn name(page: &Page<'_>, planner: usize) -> String {
    format!("`{}`", page.name(&planner))
}

/// The planner with the least or the greatest of these values, if any planner has one.
fn extreme(planners: &[usize], greatest: bool, value: impl Fn(usize) -> Option<f64>) -> Option<(usize, f64)> {
    let sign = if greatest { -1.0 } else { 1.0 };
    let values = planners.iter().filter_map(|p| Some((*p, value(*p)?)));
    values.min_by(|(_, a), (_, b)| (sign * a).total_cmp(&(sign * b)))
}

fn success(page: &Page<'_>, others: &[usize]) -> String {
    let Tally { success, runs, .. } = page.tally(&0);
    let interval = page.success_interval(&page.tally(&0));
    let mut says = format!(
        "{} reached the goal without a collision in {success} of {} (95 %: {interval}).",
        name(page, 0),
        count(runs, "run")
    );
    if let Some((best, most)) = extreme(others, true, |p| Some(page.tally(&p).success as f64)) {
        let better = others.iter().filter(|p| page.tally(p).success > success).count();
        let equal = others.iter().filter(|p| page.tally(p).success == success).count();
        says += &format!(
            " Of the other {}, {better} did so more often and {equal} as often; the most is {most} of {}.",
            count(others.len(), "planner"),
            name(page, best)
        );
    }
    says
}

/// Where most of the first planner's failures are, and what is left without the scenes of that kind.
fn failures(page: &Page<'_>, others: &[usize]) -> Option<String> {
    let kinds = page.kinds();
    let failed = |tally: &Tally| tally.runs - tally.success;
    let all = page.tally(&0);
    let (kind, worst) = kinds.iter().max_by_key(|(_, tallies)| failed(&tallies[0]))?;
    if failed(&worst[0]) as f64 <= MOST * failed(&all) as f64 {
        return None;
    }
    let without = |p: usize| page.tally(&p).success - worst[p].success;
    let rest = all.runs - worst[0].runs;
    let mut says = format!(
        "{} of its {} failures are in scenes of the kind {kind}. Without these it has {} of {rest}",
        failed(&worst[0]),
        failed(&all),
        without(0)
    );
    if let Some((best, most)) = extreme(others, true, |p| Some(without(p) as f64)) {
        says += &format!(", the best other planner, {}, {most}", name(page, best));
    }
    Some(says + ".")
}

fn time(page: &Page<'_>, others: &[usize]) -> Option<String> {
    let typical = |p: usize| median(&page.values(Measure::Time, &p));
    let own = typical(0)?;
    let mut says = format!("Its runs that arrived took {own:.1} s (median)");
    if let Some((fastest, least)) = extreme(others, false, typical) {
        let sooner = others.iter().filter(|p| typical(**p).is_some_and(|time| time < own)).count();
        says += &format!(
            "; {sooner} of the others took less, the least is {least:.1} s of {}",
            name(page, fastest)
        );
    }
    Some(says + ".")
}

fn people(page: &Page<'_>, others: &[usize]) -> Option<String> {
    let near = |p: usize| mean(&page.values(Measure::TdSeconds, &p));
    let own = near(0)?;
    let mut says = format!("It was nearer than 1.5 m to people for {own:.1} s per run (mean)");
    if let Some((best, least)) = extreme(others, false, near) {
        let less = others.iter().filter(|p| near(**p).is_some_and(|time| time < own)).count();
        says += &format!("; {less} of the others for less, the least is {least:.1} s of {}", name(page, best));
    }
    Some(says + ".")
}

fn claims(page: &Page<'_>) -> Option<String> {
    let all = page.bench.claims.len();
    let few = page.claims_beyond_reach();
    let beyond =
        if few == 0 { String::new() } else { format!("; {few} could not be shown by any runs in so few places") };
    (all > 0).then(|| {
        format!("Of {} written down before, {} hold{beyond}.", count(all, "claim"), page.claims_that_hold())
    })
}

/// How many pairs of planners are in the paper's order, measure by measure.
fn order(page: &Page<'_>) -> Option<String> {
    let totals = page.totals();
    let (agree, pairs) = totals.iter().fold((0, 0), |(a, p), order| (a + order.agree, p + order.pairs));
    let each = Measure::PAPER.iter().zip(totals).map(|(measure, order)| {
        let label = measure.label().split(" (").next().unwrap_or_default();
        format!("{label} {} of {}", order.agree, order.pairs)
    });
    (pairs > 0).then(|| {
        format!(
            "Of {pairs} pairs of planners and measures that the paper's tables tell apart, {agree} are in the same order here; \
             by chance it would be about half. {}.",
            each.collect::<Vec<_>>().join(", ")
        )
    })
}

fn places(page: &Page<'_>) -> String {
    let places = count(page.bench.comparison.count_places(), "place");
    if page.least_p() > SIGNIFICANT {
        format!(
            "All scenes are in {places}. That is too few to show anything for other places, however many runs there are: all of this \
             holds for these places."
        )
    } else {
        format!("The scenes are in {places}, which the tests take for units.")
    }
}
