//! The common name of a certificate: a role and what it is for, such as `arbiter.r1`, `cpc.a` or `viewer`.

use std::fmt::{Display, Formatter};
use std::str::FromStr;

use curionav_schemas::keys::{check_id, generates};

use crate::table::{ANY_PLANNER, ANY_TERM, OF_SERVICES, ROBOTS, Right, Row, TABLE, Verb};

/// The name of a certificate, with a row of the table.
///
/// The instance of a service may be left out where it is the same as the part before: `arbiter.r1` is `arbiter.r1.r1`.
#[derive(Debug, Clone)]
pub struct Name {
    role: String,
    /// As many as the row has names.
    names: Vec<String>,
    /// The robots that it is for, where the row has [`ROBOTS`]; `*` alone for all.
    robots: Vec<String>,
    row: &'static Row,
}

/// Why a text is no name of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not the name of a certificate: {reason}; `docs/security.md` lists the names, such as {examples}"
)]
pub struct NameError {
    text: String,
    reason: String,
    examples: &'static str,
}

fn fault(role: &str, names: &[&str], reason: String) -> NameError {
    let text = std::iter::once(role).chain(names.iter().copied()).collect::<Vec<_>>().join(".");
    NameError { text, reason, examples: EXAMPLES }
}

/// [`ROBOTS`] in a key of the table.
const LISTED: &str = "{robots}";

const EXAMPLES: &str = "driver.ROBOT, cpc.INSTANCE, operator, viewer.ROBOT";

/// In the place of all robots.
pub const ALL_ROBOTS: &str = "*";
/// Most robots that one certificate lists: more than a house has, and rules that a router reads in a moment.
const ROBOTS_MAX: usize = 256;

impl Name {
    /// The name of a program of `role` for these `names`, in the order of the table: robot, world, instance.
    pub fn new(role: &str, names: &[&str]) -> Result<Self, NameError> {
        for part in std::iter::once(&role).chain(names) {
            check_id(part).map_err(|error| fault(role, names, error.to_string()))?;
        }
        let mut rows = TABLE.iter().filter(|row| row.role == role).peekable();
        let rows: Vec<&'static Row> = match rows.peek() {
            Some(_) => rows.collect(),
            None => {
                let any = if generates(role) { ANY_PLANNER } else { ANY_TERM };
                TABLE.iter().filter(|row| row.role == any).collect()
            }
        };
        for row in &rows {
            let mut names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            // The instance that is left out.
            if row.names.len() == names.len() + 1 && row.names.last() == Some(&"instance") {
                names.extend(names.last().cloned());
            }
            if names.len() == row.names.len() {
                let robots = if row.names == [ROBOTS] { names.clone() } else { Vec::new() };
                return Ok(Self { role: role.to_owned(), names, robots, row });
            }
        }
        let wanted: Vec<String> = rows.iter().map(|row| pattern(role, row)).collect();
        Err(fault(role, names, format!("give {}", wanted.join(" or "))))
    }

    /// The name of the service `role` of this robot, world and instance, as far as its row has them.
    pub fn of_service(role: &str, robot: &str, world: &str, instance: &str) -> Result<Self, NameError> {
        let row = TABLE.iter().find(|row| row.role == role);
        let wanted = row.map_or(&["instance"][..], |row| row.names);
        let names: Vec<&str> = wanted
            .iter()
            .map(|&name| match name {
                "robot" => robot,
                "world" => world,
                _ => instance,
            })
            .collect();
        Self::new(role, &names)
    }

    /// The same name, for these robots: each named once, or `*` alone for all of them.
    ///
    /// # Errors
    /// If certificates of this kind are not for some robots alone, or a robot cannot be called that.
    pub fn for_robots(mut self, robots: &[String]) -> Result<Self, NameError> {
        let text = self.to_string();
        let refuse = |reason| Err(NameError { text, reason, examples: "viewer.ward3, operator.anna" });
        if self.row.names != [ROBOTS] {
            return refuse(
                "no robots can be listed for it; only operator.NAME and viewer.NAME have lists".into(),
            );
        }
        if robots.is_empty() || robots.len() > ROBOTS_MAX {
            return refuse(format!("it lists {} robots; give 1 to {ROBOTS_MAX}", robots.len()));
        }
        if robots != [ALL_ROBOTS]
            && let Some(error) = robots.iter().find_map(|robot| check_id(robot).err())
        {
            return refuse(format!("its robots: {error}; or give `{ALL_ROBOTS}` alone for all"));
        }
        self.robots = robots.to_vec();
        self.robots.sort();
        self.robots.dedup();
        Ok(self)
    }

    /// The robots that it lists; none for a certificate that lists none.
    pub fn robots(&self) -> &[String] {
        &self.robots
    }

    /// Whether it is for some robots alone, and not for this one.
    pub fn leaves_out(&self, robot: &str) -> bool {
        !self.robots.is_empty() && !self.robots.iter().any(|one| one == robot || one == ALL_ROBOTS)
    }

    /// The first part of it.
    pub fn role(&self) -> &str {
        &self.role
    }

    /// The robot that it is for, if it is for one.
    pub fn robot(&self) -> Option<&str> {
        let named = self.row.names.iter().zip(&self.names).find(|(what, _)| **what == "robot");
        named.map(|(_, name)| name.as_str())
    }

    /// Its row of the table.
    pub fn row(&self) -> &'static Row {
        self.row
    }

    /// Its rights, those of every service included.
    pub fn rights(&self) -> impl Iterator<Item = &'static Right> + use<> {
        let common = if self.row.is_service { OF_SERVICES } else { &[] };
        self.row.rights.iter().chain(common)
    }

    /// The keys that a key of the table means with this name's parts in it: one for each robot that it lists, where
    /// the key says so.
    pub fn fill(&self, key: &str) -> Vec<String> {
        let named = self.row.names.iter().zip(&self.names).filter(|(what, _)| **what != ROBOTS);
        let filled =
            named.fold(key.to_owned(), |key, (what, name)| key.replace(&format!("{{{what}}}"), name));
        let filled = filled.replace("{role}", &self.role).replace("{self}", &self.to_string());
        match filled.contains(LISTED) {
            true => self.robots.iter().map(|robot| filled.replace(LISTED, robot)).collect(),
            false => vec![filled],
        }
    }

    /// Whether it may do anything of the kind.
    pub fn has(&self, verb: Verb) -> bool {
        self.rights().any(|right| right.verb == verb)
    }

    /// Whether it is a router's: it then also listens.
    pub fn is_router(&self) -> bool {
        self.row.role == "router"
    }
}

/// How names of a row are written.
pub(crate) fn pattern(role: &str, row: &Row) -> String {
    let mut text = role.to_owned();
    for name in row.names {
        text += &if *name == "instance" && row.names.len() > 1 {
            "[.INSTANCE]".to_owned()
        } else {
            format!(".{}", name.to_uppercase())
        };
    }
    text
}

impl Display for Name {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let shown = match self.names.as_slice() {
            [rest @ .., before, last] if before == last && self.row.names.last() == Some(&"instance") => {
                [rest, std::slice::from_ref(before)].concat()
            }
            all => all.to_vec(),
        };
        f.write_str(&self.role)?;
        shown.iter().try_for_each(|name| write!(f, ".{name}"))
    }
}

impl FromStr for Name {
    type Err = NameError;

    fn from_str(text: &str) -> Result<Self, NameError> {
        let mut parts = text.split('.');
        let role = parts.next().unwrap_or_default();
        Self::new(role, &parts.collect::<Vec<_>>())
    }
}

impl PartialEq for Name {
    fn eq(&self, other: &Self) -> bool {
        (&self.role, &self.names) == (&other.role, &other.names)
    }
}

impl Eq for Name {}

impl PartialOrd for Name {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Name {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        (&self.role, &self.names).cmp(&(&other.role, &other.names))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_written_in_one_way() {
        for (text, shown) in [
            ("driver.r1", "driver.r1"),
            ("driver.r1.r1", "driver.r1"),
            ("arbiter.r1.b", "arbiter.r1.b"),
            ("cpc.a", "cpc.a"),
            ("comfort.my-pc", "comfort.my-pc"),
            ("simulator.w.r1", "simulator.w.r1"),
            ("simulator.w.r1.r1", "simulator.w.r1"),
            ("simulator.w.r1.w", "simulator.w.r1.w"),
            ("router", "router"),
            ("router.r1", "router.r1"),
            ("viewer", "viewer"),
        ] {
            let name: Name = text.parse().unwrap();
            assert_eq!(name.to_string(), shown);
            assert_eq!(shown.parse::<Name>().unwrap(), name);
        }
    }

    #[test]
    fn a_wrong_name_is_refused_with_the_form_that_is_right() {
        for (text, fault) in [
            ("viewer.a.b", "give viewer or viewer.ROBOTS"),
            ("driver", "give driver.ROBOT[.INSTANCE]"),
            ("driver.a.b.c", "give driver.ROBOT[.INSTANCE]"),
            ("opertor", "give opertor.INSTANCE"),
            ("router.a.b", "give router.ROBOT or router"),
            ("cpc.A", "name `A` must be 1 to 64"),
            ("", "name `` must be 1 to 64"),
            ("viewer.", "name `` must be 1 to 64"),
            ("../viewer", "must be 1 to 64"),
        ] {
            let error = text.parse::<Name>().unwrap_err().to_string();
            assert!(error.contains(fault) && error.contains("docs/security.md"), "{error}");
        }
    }

    #[test]
    fn an_operator_is_for_the_robot_of_its_name_or_for_those_that_it_lists() {
        let filled = |name: Name| name.fill("robot/{robots}/pause/{self}");
        let own: Name = "operator.r1".parse().unwrap();
        assert_eq!(filled(own.clone()), ["robot/r1/pause/operator.r1"]);
        let robots =
            |listed: &[&str]| -> Vec<String> { listed.iter().map(|&robot| robot.to_owned()).collect() };
        let ward =
            "operator.ward3".parse::<Name>().unwrap().for_robots(&robots(&["r2", "r1", "r2"])).unwrap();
        assert_eq!(filled(ward.clone()), ["robot/r1/pause/operator.ward3", "robot/r2/pause/operator.ward3"]);
        assert!(ward.leaves_out("r3") && !ward.leaves_out("r2") && own.leaves_out("ward3"));
        let anna = own.clone().for_robots(&robots(&["*"])).unwrap();
        assert!(filled(anna.clone()) == ["robot/*/pause/operator.r1"] && !anna.leaves_out("r9"));
        for (name, listed, fault) in [
            ("operator", &["r1"][..], "no robots can be listed for it"),
            ("driver.r1", &["r1"], "no robots can be listed for it"),
            ("viewer.ward3", &[], "lists 0 robots; give 1 to 256"),
            ("viewer.ward3", &["r1", "*"], "name `*` must be"),
            ("viewer.ward3", &["r1/r2"], "name `r1/r2` must be"),
        ] {
            let error = name.parse::<Name>().unwrap().for_robots(&robots(listed)).unwrap_err().to_string();
            assert!(error.contains(fault), "{error}");
        }
    }

    #[test]
    fn a_service_is_named_by_its_own_configuration() {
        let named = |role| Name::of_service(role, "r1", "hall", "x").unwrap().to_string();
        assert_eq!(named("arbiter"), "arbiter.r1.x");
        assert_eq!(named("cnc"), "cnc.x");
        assert_eq!(named("generator"), "generator.x");
        assert_eq!(named("simulator"), "simulator.hall.r1.x");
        assert_eq!(Name::of_service("driver", "r1", "w", "r1").unwrap().to_string(), "driver.r1");
    }
}
