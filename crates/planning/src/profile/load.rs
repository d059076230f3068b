//! Profiles from files, from what is built in, and with fields overridden.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{MAX_STEPS, MAX_TERMS, MAX_TREES, Profile};

const BUILTIN: [(&str, &str); 6] = [
    ("curiosity", include_str!("../../profiles/curiosity.toml")),
    ("cpc-only", include_str!("../../profiles/cpc-only.toml")),
    ("cnc-only", include_str!("../../profiles/cnc-only.toml")),
    ("distance-only", include_str!("../../profiles/distance-only.toml")),
    ("risk-rrt", include_str!("../../profiles/risk-rrt.toml")),
    ("bi-risk-rrt", include_str!("../../profiles/bi-risk-rrt.toml")),
];

/// What is wrong with a profile, in one line: where, which field, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileError {
    /// Line of the file, from 1; absent for overrides.
    pub line: Option<usize>,
    /// Dotted path of the field; absent if the text is not TOML at all.
    pub field: Option<String>,
    /// What is wrong with it.
    pub message: String,
}

impl std::fmt::Display for ProfileError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        if let Some(field) = &self.field {
            write!(f, "`{field}`: ")?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for ProfileError {}

impl Profile {
    /// Names of the profiles that are built in, the paper's first.
    pub fn names() -> impl Iterator<Item = &'static str> {
        BUILTIN.iter().map(|(name, _)| *name)
    }

    /// The built-in profile of that name.
    pub fn builtin(name: &str) -> Option<Self> {
        let (_, text) = BUILTIN.iter().find(|(builtin, _)| *builtin == name)?;
        Self::from_toml(text).ok()
    }

    /// The commented text of a built-in profile, to start one's own from.
    pub fn builtin_text(name: &str) -> Option<&'static str> {
        BUILTIN.iter().find(|(builtin, _)| *builtin == name).map(|(_, text)| *text)
    }

    /// Reads a profile; fields that are left out have their default.
    pub fn from_toml(text: &str) -> Result<Self, ProfileError> {
        let profile: Self = toml::from_str(text).map_err(|e| ProfileError {
            line: e.span().map(|span| line_of(text, span.start)),
            field: e.span().and_then(|span| field_at(text, span.start)),
            message: one_line(e.message()),
        })?;
        profile.check().map_err(|mut e| {
            e.line = e.field.as_deref().and_then(|field| offset_of(text, field)).map(|at| line_of(text, at));
            e
        })?;
        Ok(profile)
    }

    /// This profile with some fields replaced: `overrides` has the shape of a profile file. Tables are
    /// merged, anything else is replaced.
    pub fn with_overrides(&self, overrides: &toml::Table) -> Result<Self, ProfileError> {
        let wrong = |message: String| ProfileError { line: None, field: None, message: one_line(&message) };
        let mut table = toml::Table::try_from(self).map_err(|e| wrong(e.to_string()))?;
        merge(&mut table, overrides);
        let profile: Self = table.try_into().map_err(|e: toml::de::Error| wrong(e.to_string()))?;
        profile.check()?;
        Ok(profile)
    }

    /// Whether every number makes sense; the error names the first field that does not.
    pub fn check(&self) -> Result<(), ProfileError> {
        let ok = |good: bool, field: &str, message: &str| {
            let wrong =
                || ProfileError { line: None, field: Some(field.to_owned()), message: message.into() };
            if good { Ok(()) } else { Err(wrong()) }
        };
        let positive = |n: f64, field: &str| ok(n > 0.0 && n.is_finite(), field, "must be greater than zero");
        let not_negative = |n: f64, field: &str| ok(n >= 0.0 && n.is_finite(), field, "must not be negative");

        ok(!self.name.is_empty(), "name", "must not be empty")?;
        ok(!self.generator.is_empty(), "generator", "must not be empty")?;
        ok((1..=MAX_TREES).contains(&self.trees), "trees", &format!("must be 1 to {MAX_TREES}"))?;
        ok((1..=MAX_STEPS).contains(&self.steps), "steps", &format!("must be 1 to {MAX_STEPS}"))?;
        positive(self.dt, "dt")?;
        not_negative(self.min_speed, "min_speed")?;
        not_negative(self.min_turn, "min_turn")?;
        ok(self.terms.len() <= MAX_TERMS, "terms", &format!("must be at most {MAX_TERMS}"))?;
        for (metric, term) in &self.terms {
            ok(!metric.is_empty(), "terms", "a metric must have a name")?;
            positive(term.scale, &format!("terms.{metric}.scale"))?;
            not_negative(term.weight, &format!("terms.{metric}.weight"))?;
        }
        ok(self.active_terms(false).next().is_some(), "terms", "needs a term that always counts")?;
        positive(self.uncertainty.threshold, "uncertainty.threshold")?;
        let ratio = self.uncertainty.release_ratio;
        ok(ratio > 0.0 && ratio <= 1.0, "uncertainty.release_ratio", "must be above 0 and at most 1")?;
        not_negative(self.working_zone.v_people_max, "working_zone.v_people_max")?;
        not_negative(self.working_zone.personal_distance, "working_zone.personal_distance")?;
        not_negative(self.working_zone.hysteresis, "working_zone.hysteresis")?;
        positive(self.goal.arrive_distance, "goal.arrive_distance")?;
        positive(self.hold.max_age, "hold.max_age")?;
        not_negative(self.hold.max_deviation, "hold.max_deviation")?;
        not_negative(self.hold.reach_tolerance, "hold.reach_tolerance")?;
        not_negative(self.persistence.margin, "persistence.margin")?;
        not_negative(self.persistence.same_within, "persistence.same_within")?;
        not_negative(self.forecast.sigma_position, "forecast.sigma_position")?;
        not_negative(self.forecast.sigma_velocity, "forecast.sigma_velocity")?;
        not_negative(self.collision.sigma_factor, "collision.sigma_factor")?;
        not_negative(self.collision.max_inflation, "collision.max_inflation")?;
        not_negative(self.collision.wall_margin, "collision.wall_margin")?;
        not_negative(self.collision.person_margin, "collision.person_margin")?;
        not_negative(self.risk.block, "risk.block")?;
        not_negative(self.risk.social_weight, "risk.social_weight")?;
        not_negative(self.risk.rotation_weight, "risk.rotation_weight")?;
        self.hccdm.check().or_else(|e| ok(false, "hccdm", &e.to_string()))?;
        not_negative(self.cpc.update_min_d, "cpc.update_min_d")?;
        not_negative(self.cpc.update_min_a, "cpc.update_min_a")?;
        positive(self.cpc.update_max_interval, "cpc.update_max_interval")?;
        positive(self.information.sigma, "information.sigma")?;
        ok(self.information.beams > 0, "information.beams", "must be at least one")?;
        let correlation = self.information.correlation;
        ok(correlation >= 1.0 && correlation.is_finite(), "information.correlation", "must be at least one")?;
        self.generation.risk_rrt.check().or_else(|(field, message)| ok(false, field, message))?;
        self.generation.bi_risk_rrt.check().or_else(|(field, message)| ok(false, field, message))
    }
}

fn merge(base: &mut toml::Table, overrides: &toml::Table) {
    for (key, value) in overrides {
        match (base.get_mut(key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(given)) => merge(inner, given),
            _ => {
                base.insert(key.clone(), value.clone());
            }
        }
    }
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn line_of(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|b| *b == b'\n').count() + 1
}

/// Dotted path of the innermost field that `offset` lies in.
fn field_at(text: &str, offset: usize) -> Option<String> {
    fn walk(table: &DeTable<'_>, offset: usize) -> Option<String> {
        table.iter().find_map(|(key, value)| {
            let inner = value.get_ref().as_table().and_then(|table| walk(table, offset));
            let here = || key.span().contains(&offset) || value.span().contains(&offset);
            match inner {
                Some(inner) => Some(format!("{}.{inner}", key.get_ref())),
                None => here().then(|| key.get_ref().to_string()),
            }
        })
    }
    walk(DeTable::parse(text).ok()?.get_ref(), offset)
}

/// Where the field of that dotted path is written; its nearest table if it is not.
fn offset_of(text: &str, field: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.get_ref();
    let mut offset = None;
    for name in field.split('.') {
        let Some((key, value)) = table.iter().find(|(key, _)| key.get_ref() == name) else { break };
        offset = Some(key.span().start);
        match Spanned::get_ref(value) {
            DeValue::Table(inner) => table = inner,
            _ => break,
        }
    }
    offset
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> toml::Table {
        text.parse().unwrap()
    }

    #[test]
    fn the_documented_file_is_the_default() {
        assert_eq!(
            Profile::from_toml(Profile::builtin_text("curiosity").unwrap()).unwrap(),
            Profile::default()
        );
    }

    #[test]
    fn the_documented_file_leaves_nothing_out() {
        fn fields(table: &toml::Table) -> Vec<String> {
            let inner = |(key, value): (&String, &toml::Value)| match value.as_table() {
                Some(t) => fields(t).into_iter().map(|f| format!("{key}.{f}")).collect(),
                None => vec![key.clone()],
            };
            table.iter().flat_map(inner).collect()
        }
        let written = fields(&table(Profile::builtin_text("curiosity").unwrap()));
        assert_eq!(written, fields(&toml::Table::try_from(Profile::default()).unwrap()));
    }

    #[test]
    fn every_builtin_profile_is_valid_and_named_after_itself() {
        for name in Profile::names() {
            assert_eq!(Profile::builtin(name).unwrap().name, name);
        }
        assert_eq!(Profile::builtin("no-such-profile"), None);
    }

    #[test]
    fn an_ablation_differs_from_the_paper_in_its_terms_alone() {
        for (name, metrics) in [
            ("cpc-only", &["cpc", "distance"][..]),
            ("cnc-only", &["cnc", "distance"]),
            ("distance-only", &["distance"]),
        ] {
            let ablation = Profile::builtin(name).unwrap();
            let mut paper = Profile::default();
            paper.terms.retain(|metric, _| metrics.contains(&metric.as_str()));
            paper.name.clone_from(&ablation.name);
            paper.description.clone_from(&ablation.description);
            assert_eq!(ablation, paper);
        }
    }

    #[test]
    fn a_profile_survives_being_written_and_read() {
        for name in Profile::names() {
            let profile = Profile::builtin(name).unwrap();
            assert_eq!(Profile::from_toml(&toml::to_string(&profile).unwrap()).unwrap(), profile);
        }
    }

    #[test]
    fn errors_name_line_and_field() {
        let error = |text: &str| Profile::from_toml(text).unwrap_err().to_string();
        let wrong_type = error("name = \"a\"\n[terms.cpc]\nscale = \"much\"\n");
        assert!(wrong_type.starts_with("line 3: `terms.cpc.scale`: invalid type"), "{wrong_type}");
        let unknown = error("name = \"a\"\n\n[hold]\nmax_agee = 1\n");
        assert!(unknown.starts_with("line 4: `hold.max_agee`: unknown field"), "{unknown}");
        assert_eq!(
            error("steps = 5\n[terms.distance]\nweight = 1.0\nscale = 0.0\n"),
            "line 4: `terms.distance.scale`: must be greater than zero"
        );
        assert!(error("name = \n").starts_with("line 1: "));
        assert!(error("dt = nan\n").starts_with("line 1: `dt`: "));
    }

    #[test]
    fn overrides_replace_only_what_they_name() {
        let base = Profile::default();
        let changed = base.with_overrides(&table("steps = 20\nterms.cpc.weight = 2")).unwrap();
        let mut expected = base.clone();
        expected.steps = 20;
        expected.terms.get_mut("cpc").unwrap().weight = 2.0;
        assert_eq!(changed, expected);
        assert_eq!(base.with_overrides(&toml::Table::new()).unwrap(), base);
    }

    #[test]
    fn a_new_metric_is_one_more_line() {
        let more = Profile::default().with_overrides(&table("terms.view = {scale = 0.5}")).unwrap();
        assert_eq!(more.active_terms(false).map(|(m, _)| m).collect::<Vec<_>>(), ["cnc", "distance", "view"]);
    }

    #[test]
    fn an_override_of_an_unknown_field_is_refused_by_name() {
        let error = |text| Profile::default().with_overrides(&table(text)).unwrap_err().to_string();
        let unknown = error("working_zone.radius = 3");
        assert!(unknown.contains("radius") && unknown.contains("working_zone"), "{unknown}");
        assert_eq!(error("terms.cpc.weight = -1"), "`terms.cpc.weight`: must not be negative");
        assert_eq!(
            error("terms.cnc.weight = 0\nterms.distance.weight = 0"),
            "`terms`: needs a term that always counts"
        );
    }
}
