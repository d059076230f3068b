//! The files under `deploy/` are read by the code they are for.

use std::path::{Path, PathBuf};

use curionav_runtime::config::ServiceConfig;

fn deploy(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy").join(name)
}

#[test]
fn the_documented_service_configuration_says_the_defaults() {
    let read = ServiceConfig::from_file(&deploy("service.toml")).unwrap();
    // The file shows how a router is named; without one the command line tries this machine.
    let expected = ServiceConfig { connect: read.connect.clone(), ..ServiceConfig::default() };
    assert_eq!(read, expected);
    assert_eq!(read.connect, ["tcp/127.0.0.1:7447"]);
}

#[test]
fn zenoh_takes_the_router_and_the_client_configuration() {
    for name in ["router.json5", "client.json5"] {
        if let Err(error) = zenoh::Config::from_file(deploy(name)) {
            panic!("deploy/{name}: {error}");
        }
    }
}
