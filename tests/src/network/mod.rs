//! A deployment on a real network of several hosts, and its faults: router, robot and a pool on three
//! machines, each with an address of its own, driven in real time and planned at 10 Hz.
//!
//! Needs Linux, root and network namespaces; elsewhere each test says in a line that it was skipped. Run with
//! `--nocapture` to see what each fault cost.

mod arbiter;
mod delayed_link;
mod figures;
mod invariants;
mod links;
mod namespaces;
mod partition;
mod recorder;
mod replicas;
mod routers;
mod site;
