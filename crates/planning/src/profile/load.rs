//! Profiles from files, from what is built in, and with fields overridden.

use super::Profile;
use crate::parameters::{FieldError, read, read_table};

const BUILTIN: [(&str, &str); 13] = [
    ("curiosity", include_str!("../../profiles/curiosity.toml")),
    ("cpc-only", include_str!("../../profiles/cpc-only.toml")),
    ("cnc-only", include_str!("../../profiles/cnc-only.toml")),
    ("distance-only", include_str!("../../profiles/distance-only.toml")),
    ("risk-rrt", include_str!("../../profiles/risk-rrt.toml")),
    ("bi-risk-rrt", include_str!("../../profiles/bi-risk-rrt.toml")),
    ("human-space", include_str!("../../profiles/human-space.toml")),
    ("risk-aware", include_str!("../../profiles/risk-aware.toml")),
    ("transient-goal", include_str!("../../profiles/transient-goal.toml")),
    ("mppi", include_str!("../../profiles/mppi.toml")),
    ("dwa", include_str!("../../profiles/dwa.toml")),
    ("hrvo-robot", include_str!("../../profiles/hrvo-robot.toml")),
    ("curionav", include_str!("../../profiles/curionav.toml")),
];

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

    /// Reads a profile; fields that are left out have their default. Errors name line and field.
    pub fn from_toml(text: &str) -> Result<Self, FieldError> {
        read(text)
    }

    /// The fields that differ from the default, as a profile file has them.
    pub fn differences(&self) -> Result<toml::Table, toml::ser::Error> {
        Ok(differences(toml::Table::try_from(self)?, &toml::Table::try_from(Self::default())?))
    }

    /// This profile with some fields replaced: `overrides` has the shape of a profile file. Tables are
    /// merged, anything else is replaced. Errors name the field.
    pub fn with_overrides(&self, overrides: &toml::Table) -> Result<Self, FieldError> {
        let unwritten = |e: toml::ser::Error| FieldError::new("", e.to_string(), "correct the profile");
        let mut table = toml::Table::try_from(self).map_err(unwritten)?;
        merge(&mut table, overrides);
        read_table(&table)
    }
}

/// The part of `table` that is not the same in `default`; the terms whole, because a file that names one names all.
fn differences(table: toml::Table, default: &toml::Table) -> toml::Table {
    let differs = |(key, value): (String, toml::Value)| {
        let value = match (value, default.get(&key)) {
            (value, Some(same)) if value == *same => return None,
            (toml::Value::Table(inner), Some(toml::Value::Table(default))) if key != "terms" => {
                differences(inner, default).into()
            }
            (value, _) => value,
        };
        Some((key, value))
    };
    table.into_iter().filter_map(differs).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::distance::DistanceMeasure;
    use crate::evaluation::hccdm::{ComponentMotion, Weighting};
    use crate::generation::Besides;
    use crate::profile::Normalisation;

    fn table(text: &str) -> toml::Table {
        text.parse().unwrap()
    }

    #[test]
    fn the_documented_file_is_the_default() {
        assert_eq!(Profile::from_toml(BUILTIN[0].1).unwrap(), Profile::default());
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
        let written = fields(&table(BUILTIN[0].1));
        assert_eq!(written, fields(&toml::Table::try_from(Profile::default()).unwrap()));
    }

    #[test]
    fn each_arm_is_the_papers_planner_but_for_what_it_is_named_after() {
        let arm = |text: &str| {
            let mut arm = Profile::from_toml(text).unwrap();
            (arm.name, arm.description) = (Profile::default().name, Profile::default().description);
            arm
        };
        let with = |change: fn(&mut Profile)| {
            let mut profile = Profile::default();
            change(&mut profile);
            profile
        };
        assert_eq!(
            arm(include_str!("../../../../scenarios/arms/tree-only.toml")),
            with(|p| {
                let none = Besides { previous: false, shortest_way: false, arcs: false, fan: false };
                p.generation.candidates.besides = none;
            })
        );
        assert_eq!(
            arm(include_str!("../../../../scenarios/arms/euclid.toml")),
            with(|p| p.distance = DistanceMeasure::Euclid)
        );
        assert_eq!(
            arm(include_str!("../../../../scenarios/arms/d1-literal.toml")),
            with(|p| {
                p.normalisation = Normalisation::MinMax;
                p.hccdm.weighting = Weighting::Share;
            })
        );
        assert_eq!(
            arm(include_str!("../../../../scenarios/arms/d2-literal.toml")),
            with(|p| p.hccdm.motion = ComponentMotion::Frozen)
        );
        assert_eq!(
            arm(include_str!("../../../../scenarios/arms/d3-literal.toml")),
            with(|p| p.uncertainty.release_ratio = 1.0)
        );
    }

    #[test]
    fn the_static_arm_is_mppi_that_does_not_forecast_people() {
        let arm = Profile::from_toml(include_str!("../../../../scenarios/arms/mppi-static.toml")).unwrap();
        let mut mppi = Profile::builtin("mppi").unwrap();
        (mppi.generation.mppi.forecast, mppi.generation.mppi.around) = (false, 100.0);
        (mppi.name, mppi.description) = (arm.name.clone(), arm.description.clone());
        assert_eq!(arm, mppi);
    }

    #[test]
    fn the_occluded_arm_is_curionav_with_one_term_in_the_place_of_another() {
        let arm = include_str!("../../../../scenarios/arms/curionav-occluded.toml");
        let arm = Profile::from_toml(arm).unwrap();
        let mut of_this = Profile::builtin("curionav").unwrap();
        let cpc = of_this.terms.remove("cpc").unwrap();
        of_this.terms.insert("cpc-occluded".to_owned(), cpc);
        (of_this.name, of_this.description) = (arm.name.clone(), arm.description.clone());
        assert_eq!(arm, of_this);
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
        for (name, terms) in [
            ("cpc-only", &["cpc", "distance"][..]),
            ("cnc-only", &["cnc", "distance"]),
            ("distance-only", &["distance"]),
        ] {
            let ablation = Profile::builtin(name).unwrap();
            let mut paper = Profile::default();
            paper.terms.retain(|term, _| terms.contains(&term.as_str()));
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
            let differences = toml::to_string(&profile.differences().unwrap()).unwrap();
            assert_eq!(Profile::from_toml(&differences).unwrap(), profile);
            assert!(name != "curiosity" || differences.is_empty(), "{differences}");
        }
    }

    #[test]
    fn errors_name_line_and_field() {
        let error = |text: &str| Profile::from_toml(text).unwrap_err().to_string();
        let wrong_type = error("name = \"a\"\n[terms.cpc]\nscale = \"much\"\n");
        assert!(wrong_type.starts_with("line 3: terms.cpc.scale: invalid type"), "{wrong_type}");
        let unknown = error("name = \"a\"\n\n[hold]\nmax_agee = 1\n");
        assert!(unknown.starts_with("line 4: hold.max_agee: unknown field"), "{unknown}");
        let zero = error("steps = 5\n[terms.distance]\nweight = 1.0\nscale = 0.0\n");
        assert!(zero.starts_with("line 4: terms.distance.scale: is 0; give 1e-6 to 1e9: "), "{zero}");
        assert!(error("name = \n").starts_with("line 1: "));
        assert!(error("dt = nan\n").starts_with("line 1: dt: "));
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
    fn a_new_term_is_one_more_line() {
        let more = Profile::default().with_overrides(&table("terms.view = {scale = 0.5}")).unwrap();
        assert_eq!(more.active_terms(false).map(|(m, _)| m).collect::<Vec<_>>(), ["cnc", "distance", "view"]);
    }

    #[test]
    fn an_override_of_an_unknown_field_is_refused_by_name() {
        let error = |text| Profile::default().with_overrides(&table(text)).unwrap_err().to_string();
        let unknown = error("working_zone.radius = 3");
        assert!(unknown.contains("radius") && unknown.contains("working_zone"), "{unknown}");
        assert!(error("terms.cpc.weight = -1").starts_with("terms.cpc.weight: is -1; give 0 to "));
        assert!(
            error("terms.cnc.weight = 0\nterms.distance.weight = 0")
                .starts_with("terms: needs a term that always")
        );
    }
}
