//! Tests that cross the workspace.
