//! The gateway against a simulated robot that speaks as nodes of `rmw_zenoh` do, on a router of its own.

mod actions;
mod blind;
mod controller;
mod further_sensors;
mod hostile;
mod missions;
mod peer;
mod robot;
mod safety;
mod site;
mod stalled;
mod too_large;
mod tours;
