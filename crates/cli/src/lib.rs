//! The command line: run scenarios, start and supervise deployments, talk to robots.
