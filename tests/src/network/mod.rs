//! A deployment on a real network of several hosts, and its faults: router, robot and a pool on three
//! machines, each with an address of its own, driven in real time and planned at 10 Hz, or more slowly where the
//! machine needs it (`pace`).
//!
//! The tests need Linux, root and network namespaces; elsewhere each is listed as skipped. Run them with `--nocapture`
//! to see what each fault cost. With `CURIONAV_NETWORK_SECURE=1` all links are over TLS, and access rules are in force.

mod arbiter;
mod delayed_link;
mod figures;
mod invariants;
mod links;
mod namespaces;
mod overload;
mod pace;
mod partition;
mod recorder;
mod replicas;
mod routers;
mod site;
