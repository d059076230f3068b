//! A deployment's certificates and its router.

use std::path::Path;
use std::time::Duration;

use curionav_runtime::secure;
use curionav_runtime::session::{self, RouterSettings};
use curionav_security::folder::Folder;
use curionav_security::name::Name;
use curionav_security::rules::Rules;
use curionav_security::table::TABLE;
use tempfile::TempDir;
use zenoh::{Config, Session, Wait};

use crate::certificates::issued;

/// What names are made of.
pub(super) const PARTS: [(&str, &str); 4] =
    [("robot", "r1"), ("robots", "r1"), ("world", "w"), ("instance", "i")];

/// The robots of the ward: one that the other names are for, and one that they are not for.
pub(super) const WARD: [&str; 2] = ["r1", "r3"];

pub(super) struct Site {
    directory: TempDir,
    /// One of every row of the table, and two that list several robots.
    pub(super) names: Vec<Name>,
    runtime: tokio::runtime::Runtime,
}

/// A router, and the part of it that tests speak with. No rule holds for that.
pub(super) struct Router {
    pub(super) session: Session,
    pub(super) endpoint: String,
}

impl Drop for Router {
    fn drop(&mut self) {
        session::close(&self.session);
    }
}

impl Site {
    pub(super) fn new() -> Self {
        let part = |what: &&str| PARTS.iter().find(|part| part.0 == *what).unwrap().1;
        let of_rows = TABLE.iter().map(|row| {
            let role = match row.role {
                "{term}" => "cpc",
                "own-{planner}" => "own-mine",
                role => role,
            };
            Name::new(role, &row.names.iter().map(part).collect::<Vec<_>>()).unwrap()
        });
        let groups = ["operator.ward", "viewer.ward"].map(|text| {
            let robots = WARD.map(str::to_owned);
            text.parse::<Name>().unwrap().for_robots(&robots).unwrap()
        });
        let names: Vec<Name> = of_rows.chain(groups).collect();
        let directory = issued(names.clone(), &[]);
        Self { directory, names, runtime: tokio::runtime::Runtime::new().unwrap() }
    }

    pub(super) fn folder(&self) -> &Path {
        self.directory.path()
    }

    /// The access rules as they were issued.
    pub(super) fn rules(&self) -> Rules {
        Folder::new(self.folder()).rules().unwrap()
    }

    /// A router with these rules.
    pub(super) fn router(&self, rules: &Rules) -> Router {
        let file = serde_json::json!({ "namespace": null, "access_control": rules });
        std::fs::write(self.folder().join("rules.json"), file.to_string()).unwrap();
        let router: Name = "router".parse().unwrap();
        let secure = Some((self.folder(), &router));
        let listen = ["tls/127.0.0.1:0".to_owned()];
        let settings = RouterSettings { listen: &listen, secure, ..RouterSettings::default() };
        self.runtime.block_on(async {
            let session = session::router(settings).await.unwrap();
            let endpoint = session::locators(&session).await.remove(0);
            Router { session, endpoint }
        })
    }

    /// What a program of this name connects with.
    pub(super) fn client(&self, name: &Name) -> Config {
        let mut config = session::built_in().unwrap();
        secure::client(&mut config, self.folder(), std::slice::from_ref(name)).unwrap();
        config
    }
}

/// A session of a client with this configuration, if the router takes it.
pub(super) fn connect(mut config: Config, endpoint: &str) -> Option<Session> {
    let endpoints = format!("[{endpoint:?}]");
    for (key, value) in [
        ("mode", "\"client\""),
        ("connect/endpoints", endpoints.as_str()),
        ("connect/timeout_ms", "5000"),
        ("connect/exit_on_failure", "true"),
    ] {
        config.insert_json5(key, value).unwrap();
    }
    let session = zenoh::open(config).wait().ok()?;
    let is_connected = session.info().routers_zid().wait().next().is_some();
    is_connected.then_some(session)
}

/// Far longer than anything takes that is waited for.
pub(super) const LIMIT: Duration = Duration::from_secs(60);
