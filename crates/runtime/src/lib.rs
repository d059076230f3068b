//! What turns pure code into services: configuration, keys, sessions, replicas, telemetry.
