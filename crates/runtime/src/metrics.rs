//! The numbers of one service: counted once, read by its metrics endpoint and by its status alike.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use curionav_schemas::limits::{MAX_METRIC_NAME, MAX_METRICS};
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric, text};
use prometheus_client::metrics::MetricType;
pub use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::{Metric, Registry};

use crate::config::ServiceConfig;

/// What every metric's name begins with.
const PREFIX: &str = "curionav";
/// Bounds of the buckets durations are counted in, seconds: from a bare query to a hung service.
const BUCKETS: [f64; 13] = [0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0];
/// Values a label may take; beyond it everything counts as [`OTHER`]: memory must not grow with what is said.
const VALUES_MAX: usize = 64;
const OTHER: &str = "other";

type Labels = Vec<(&'static str, String)>;

/// Metrics told apart by labels.
#[derive(Debug, Clone)]
struct Labelled<M> {
    names: &'static [&'static str],
    family: Family<Labels, M, fn() -> M>,
    known: Arc<AtomicUsize>,
}

impl<M> Labelled<M> {
    fn new(names: &'static [&'static str], metric: fn() -> M) -> Self {
        Self { names, family: Family::new_with_constructor(metric), known: Arc::default() }
    }

    /// The metric of `values`, one for each label.
    fn of(&self, values: &[&str]) -> impl Deref<Target = M> {
        let mut labels: Labels =
            self.names.iter().copied().zip(values.iter().map(|v| (*v).to_owned())).collect();
        if self.family.get(&labels).is_none() && self.known.fetch_add(1, Ordering::Relaxed) >= VALUES_MAX {
            self.known.fetch_sub(1, Ordering::Relaxed);
            labels.iter_mut().for_each(|(_, value)| OTHER.clone_into(value));
        }
        self.family.get_or_create(&labels)
    }
}

/// A counter told apart by labels, with their total.
#[derive(Debug, Clone)]
pub struct Tally {
    counters: Labelled<Counter>,
    total: Counter,
}

impl Tally {
    /// Nothing counted yet; `names` are those of the labels.
    pub fn new(names: &'static [&'static str]) -> Self {
        Self { counters: Labelled::new(names, Counter::default), total: Counter::default() }
    }

    /// One more of `values`, one for each label.
    pub fn add(&self, values: &[&str]) {
        self.add_many(values, 1);
    }

    /// `count` more of `values`.
    pub fn add_many(&self, values: &[&str], count: u64) {
        self.counters.of(values).inc_by(count);
        self.total.inc_by(count);
    }

    /// All of them together.
    pub fn total(&self) -> u64 {
        self.total.get()
    }
}

/// Durations told apart by a label.
#[derive(Debug, Clone)]
pub struct Durations(Labelled<Histogram>);

/// A histogram of durations, seconds.
pub fn durations() -> Histogram {
    Histogram::new(BUCKETS)
}

impl Durations {
    /// None yet; `names` are those of the labels.
    pub fn new(names: &'static [&'static str]) -> Self {
        Self(Labelled::new(names, durations))
    }

    /// One more of `value`.
    pub fn record(&self, value: &str, took: Duration) {
        self.0.of(&[value]).observe(took.as_secs_f64());
    }
}

/// A number, or several told apart by labels, read when it is asked for.
struct Readings<F> {
    name: &'static str,
    help: &'static str,
    labels: Vec<&'static str>,
    read: F,
}

impl<F> fmt::Debug for Readings<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl<F: Fn() -> Vec<(Vec<String>, f64)> + Send + Sync + 'static> Collector for Readings<F> {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let mut metric =
            encoder.encode_descriptor(self.name, &format!("{}.", self.help), None, MetricType::Gauge)?;
        for (values, number) in (self.read)() {
            if self.labels.is_empty() {
                return ConstGauge::new(number).encode(metric);
            }
            let labels: Labels = self.labels.iter().copied().zip(values).collect();
            ConstGauge::new(number).encode(metric.encode_family(&labels)?)?;
        }
        Ok(())
    }
}

/// Everything one service counts and measures.
#[derive(Debug)]
pub struct Metrics {
    /// What it does.
    pub role: String,
    /// Its name within the role.
    pub instance: String,
    /// The robot it works for, if it works for one.
    pub robot: Option<String>,
    started: Instant,
    registry: Registry,
}

impl Metrics {
    /// Of a service that works for one robot.
    pub fn of_robot(role: &str, config: &ServiceConfig) -> Self {
        Self::new(role, &config.instance, Some(&config.robot))
    }

    /// `instance` goes out as the label `name`: Prometheus has a label `instance` of its own.
    pub fn new(role: &str, instance: &str, robot: Option<&str>) -> Self {
        let labels = [("role", Some(role)), ("name", Some(instance)), ("robot", robot)];
        let labels =
            labels.into_iter().filter_map(|(name, value)| Some((name.into(), value?.to_owned().into())));
        let mut metrics = Self {
            role: role.to_owned(),
            instance: instance.to_owned(),
            robot: robot.map(str::to_owned),
            started: Instant::now(),
            registry: Registry::with_prefix_and_labels(PREFIX, labels),
        };
        let started = metrics.started;
        metrics.gauge("uptime_seconds", "Time since the service started", move || {
            started.elapsed().as_secs_f64()
        });
        metrics.gauges(
            "build_info",
            "Always 1; the label says which version of curionav it is",
            "version",
            || vec![(env!("CARGO_PKG_VERSION").to_owned(), 1.0)],
        );
        metrics
    }

    /// Time since the service started.
    pub fn uptime(&self) -> Duration {
        self.started.elapsed()
    }

    /// Adds something counted. `name` is without prefix, and without the `_total` of counters; `help` without
    /// full stop.
    pub fn count(&mut self, name: &str, help: &str, counted: impl Metric) {
        self.registry.register(name, help, counted);
    }

    /// Adds counters told apart by labels.
    pub fn tally(&mut self, name: &str, help: &str, tally: &Tally) {
        self.count(name, help, tally.counters.family.clone());
    }

    /// Adds durations told apart by a label.
    pub fn durations(&mut self, name: &str, help: &str, durations: &Durations) {
        self.count(name, help, durations.0.family.clone());
    }

    /// Adds a number that is read when it is asked for; nothing is said while there is none.
    pub fn gauge<R: Into<Option<f64>>>(
        &mut self,
        name: &'static str,
        help: &'static str,
        read: impl Fn() -> R + Send + Sync + 'static,
    ) {
        let read = move || read().into().map(|number| (Vec::new(), number)).into_iter().collect();
        self.gauges_by(name, help, &[], read);
    }

    /// Adds numbers that are read when they are asked for, told apart by the label called `label`.
    pub fn gauges(
        &mut self,
        name: &'static str,
        help: &'static str,
        label: &'static str,
        read: impl Fn() -> Vec<(String, f64)> + Send + Sync + 'static,
    ) {
        let read = move || read().into_iter().map(|(value, number)| (vec![value], number)).collect();
        self.gauges_by(name, help, &[label], read);
    }

    /// The same, told apart by several labels.
    pub fn gauges_by(
        &mut self,
        name: &'static str,
        help: &'static str,
        labels: &[&'static str],
        read: impl Fn() -> Vec<(Vec<String>, f64)> + Send + Sync + 'static,
    ) {
        let labels = labels.to_vec();
        self.registry.register_collector(Box::new(Readings { name, help, labels, read }));
    }

    /// Everything in OpenMetrics' text format, as Prometheus reads it.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = text::encode(&mut text, &self.registry);
        text
    }

    /// The same, sample by sample: the number by name and labels as they stand in the text; at most as many as a status
    /// may hold.
    pub fn samples(&self) -> BTreeMap<String, f64> {
        let sample = |line: &str| {
            let (name, value) = line.rsplit_once(' ')?;
            let value: f64 = value.parse().ok().filter(|v: &f64| v.is_finite())?;
            (name.len() <= MAX_METRIC_NAME).then(|| (name.to_owned(), value))
        };
        let text = self.text();
        text.lines().filter(|line| !line.starts_with('#')).filter_map(sample).take(MAX_METRICS).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metrics() -> Metrics {
        Metrics::new("cpc", "a", Some("r1"))
    }

    #[test]
    fn names_and_labels_are_as_prometheus_wants_them() {
        let mut metrics = metrics();
        let refused = Tally::new(&["reason"]);
        let stages = Durations::new(&["stage"]);
        metrics.tally("refused", "Requests refused", &refused);
        metrics.durations("stage_seconds", "Time of a stage", &stages);
        metrics.gauge("load", "Load", || 0.5);
        refused.add(&["cold"]);
        refused.add_many(&["cold"], 2);
        stages.record("generate", Duration::from_millis(3));
        let text = metrics.text();
        for line in [
            "# TYPE curionav_refused counter",
            "curionav_refused_total{role=\"cpc\",name=\"a\",robot=\"r1\",reason=\"cold\"} 3",
            "curionav_load{role=\"cpc\",name=\"a\",robot=\"r1\"} 0.5",
            "curionav_stage_seconds_bucket{role=\"cpc\",name=\"a\",robot=\"r1\",le=\"0.005\",stage=\"generate\"} 1",
            "curionav_stage_seconds_bucket{role=\"cpc\",name=\"a\",robot=\"r1\",le=\"0.002\",stage=\"generate\"} 0",
            "# EOF",
        ] {
            assert!(text.lines().any(|l| l == line), "`{line}` is not in\n{text}");
        }
    }

    #[test]
    fn samples_are_those_of_the_text() {
        let mut metrics = metrics();
        let refused = Tally::new(&["reason"]);
        metrics.tally("refused", "Requests refused", &refused);
        refused.add(&["with a space and a \"quote\""]);
        let samples = metrics.samples();
        let text = metrics.text();
        let lines = text.lines().filter(|l| !l.starts_with('#')).count();
        assert_eq!(samples.len(), lines);
        assert_eq!(samples.iter().find(|(name, _)| name.contains("quote")).map(|s| *s.1), Some(1.0));
    }

    #[test]
    fn labels_that_never_repeat_take_no_more_room() {
        let tally = Tally::new(&["reason"]);
        for n in 0..10 * VALUES_MAX {
            tally.add(&[&n.to_string()]);
        }
        tally.add(&["0"]);
        assert!(tally.counters.family.get(&vec![("reason", VALUES_MAX.to_string())]).is_none());
        assert_eq!(tally.total(), 10 * VALUES_MAX as u64 + 1);
        assert_eq!(tally.counters.family.get_or_create(&vec![("reason", "0".to_owned())]).get(), 2);
    }
}
