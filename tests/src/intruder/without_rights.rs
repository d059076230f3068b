//! Programs without a certificate of the deployment, and with one that has no rules.

use std::time::{Duration, Instant};

use curionav_security::folder::{Folder, days};
use curionav_security::name::Name;
use zenoh::Config;

use super::actor::Actor;
use super::cells::{Cells, Deed};
use super::site::{LIMIT, Site, connect};

/// A client's configuration with these files.
fn with(authority: &str, certificate: Option<&str>) -> Config {
    let mut config = curionav_runtime::session::built_in().unwrap();
    let own = certificate.map_or(String::new(), |stem| {
        format!(
            ", enable_mtls: true, connect_certificate: {:?}, connect_private_key: {:?}",
            format!("{stem}.pem"),
            format!("{stem}.key")
        )
    });
    config
        .insert_json5("transport/link/tls", &format!("{{ root_ca_certificate: {authority:?} {own} }}"))
        .unwrap();
    config
}

#[test]
fn no_other_certificate_gets_in_and_none_hangs() {
    let site = Site::new();
    let router = site.router(&site.rules());
    let (operator, viewer): (Name, Name) = ("operator".parse().unwrap(), "viewer".parse().unwrap());
    let file = |folder: &std::path::Path, stem: &str| folder.join(stem).display().to_string();
    // The same name, of another authority.
    let elsewhere = tempfile::tempdir().unwrap();
    let foreign = Folder::new(elsewhere.path());
    foreign.init(None).unwrap();
    foreign.issue(&operator, &[], days(1)).unwrap();
    // One that was valid until now.
    Folder::new(site.folder()).renew(&viewer, Duration::ZERO).unwrap();
    let ca = file(site.folder(), "ca.pem");
    for (who, config) in [
        ("no certificate", with(&ca, None)),
        ("a foreign authority", with(&ca, Some(&file(elsewhere.path(), "operator")))),
        ("an expired certificate", with(&ca, Some(&file(site.folder(), "viewer")))),
    ] {
        let began = Instant::now();
        assert!(connect(config, &router.endpoint).is_none(), "{who}");
        assert!(began.elapsed() < LIMIT, "{who}");
    }
    let plain = router.endpoint.replace("tls/", "tcp/");
    assert!(connect(curionav_runtime::session::built_in().unwrap(), &plain).is_none(), "without TLS");
    // All of that has left the router as it was.
    assert!(connect(with(&ca, Some(&file(site.folder(), "operator"))), &router.endpoint).is_some());
}

#[test]
fn a_certificate_without_rules_may_do_nothing() {
    let site = Site::new();
    let cells = Cells::new(&site.names);
    let router = site.router(&site.rules());
    // Issued after the router has read its rules.
    let late: Name = "comfort.x".parse().unwrap();
    Folder::new(site.folder()).issue(&late, &[], days(1)).unwrap();
    let actor = Actor::join(&router, &site.client(&late));
    for deed in Deed::ALL {
        let done = actor.try_all(deed, &cells);
        assert!(
            done.is_empty(),
            "{deed:?} {:?}",
            done.iter().map(|&key| &cells.keys[key]).collect::<Vec<_>>()
        );
    }
}
