//! A program without TLS has no certificates.

use std::path::Path;

use curionav_runtime::exit::Exit;
use tokio::sync::Notify;

use super::deployment::Deployment;
use crate::left_out::left_out;

/// There are none.
pub(super) enum Certificates {}

impl Certificates {
    /// Says how to get a program with TLS.
    pub(super) fn of(_: &Deployment, _: &Path) -> Result<Self, Exit> {
        Err(left_out("tls"))
    }

    /// Nothing is to be renewed.
    pub(super) async fn keep_valid(&self, _: &Notify) {
        match *self {}
    }
}
