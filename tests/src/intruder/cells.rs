//! The keys, what is tried with them, and what must come of it.

use std::collections::BTreeSet;

use curionav_schemas::keys::ROOT;
use curionav_security::name::Name;
use curionav_security::table::{OF_SERVICES, TABLE, Verb};
use zenoh::key_expr::keyexpr;

/// What a program may try with a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Deed {
    Put,
    Delete,
    Subscribe,
    /// See on a publisher that there are subscribers.
    Notice,
    Get,
    Queryable,
    /// See on a querier that there are queryables.
    Find,
    Token,
    LivelinessGet,
    LivelinessSubscribe,
}

impl Deed {
    pub(super) const ALL: [Self; 10] = [
        Self::Put,
        Self::Delete,
        Self::Subscribe,
        Self::Notice,
        Self::Get,
        Self::Queryable,
        Self::Find,
        Self::Token,
        Self::LivelinessGet,
        Self::LivelinessSubscribe,
    ];
}

/// Whether the table allows it. What a program is told about others ([`Verb::Notice`] and [`Verb::Find`]) is the same
/// for all robots, as the declarations of others may have wildcards.
pub(super) fn expected(name: &Name, deed: Deed, key: &str) -> bool {
    let wide = |verb: Verb| {
        let others = ["/robot/r2/", "/robot/r3/", "/robot/x/"];
        let of_r1 = others.iter().fold(key.to_owned(), |key, other| key.replace(other, "/robot/r1/"));
        is_concrete(key) && name.may(verb, &of_r1, None)
    };
    match deed {
        Deed::Put => name.may(Verb::Put, key, None),
        Deed::Delete => false,
        Deed::Subscribe => name.may(Verb::Subscribe, key, None),
        Deed::Notice => wide(Verb::Notice),
        Deed::Get => name.may(Verb::Ask, key, None),
        Deed::Queryable => name.may(Verb::Serve, key, None),
        Deed::Find => wide(Verb::Find),
        Deed::Token => name.may(Verb::Hold, key, None),
        Deed::LivelinessGet | Deed::LivelinessSubscribe => name.may(Verb::Watch, key, None),
    }
}

pub(super) fn is_concrete(key: &str) -> bool {
    !key.contains('*')
}

/// The keys that are tried.
#[derive(Debug, Clone)]
pub(super) struct Cells {
    pub(super) keys: Vec<String>,
    /// Those without wildcards, on which something is said, asked or alive.
    pub(super) concrete: Vec<String>,
}

impl Cells {
    /// Every key of the table for these names, with and without its wildcards, the same of another robot, and what an
    /// intruder would try.
    pub(super) fn new(names: &[Name]) -> Self {
        let mut keys = BTreeSet::new();
        for name in names {
            let of_all = TABLE.iter().flat_map(|row| row.rights).chain(OF_SERVICES);
            let of_all = of_all.flat_map(|right| right.keys).filter(|key| !key.contains("{self}"));
            // A key that names its asker is tried by everyone, for everyone who may ask on it.
            let own = name.rights().flat_map(|right| right.keys).filter(|key| key.contains("{self}"));
            for key in of_all.chain(own) {
                for filled in name.fill(key).into_iter().filter(|filled| !filled.contains('{')) {
                    keys.insert(filled.replace('*', "x"));
                    keys.insert(filled.replace("/r1", "/r2").replace('*', "x"));
                    keys.insert(filled);
                }
            }
        }
        let mut keys: Vec<String> = keys.into_iter().map(|key| format!("{ROOT}/{key}")).collect();
        keys.extend([format!("{ROOT}/robot/*/cmd"), format!("{ROOT}/**")]);
        keys.extend(["**", "@/**", "elsewhere"].map(str::to_owned));
        let concrete = keys.iter().filter(|key| is_concrete(key)).cloned().collect();
        Self { keys, concrete }
    }

    /// Those of the keys for which `is_wanted` holds.
    pub(super) fn only(&self, is_wanted: impl Fn(&str) -> bool) -> Self {
        let keys = self.keys.iter().filter(|key| is_wanted(key)).cloned().collect();
        Self { keys, concrete: self.concrete.clone() }
    }

    /// The concrete keys that `key` covers.
    pub(super) fn covered<'a>(&'a self, key: &'a str) -> impl Iterator<Item = &'a str> {
        let pattern = keyexpr::new(key).unwrap();
        let all = self.concrete.iter().map(String::as_str);
        all.filter(move |concrete| pattern.intersects(keyexpr::new(*concrete).unwrap()))
    }
}
