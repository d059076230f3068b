//! Readiness of the pool before a mission: of every replica that is alive, and of one of each role.

use std::collections::BTreeSet;
use std::time::Duration;

use curionav_schemas::{Refusal, Reject};

use curionav_pool::context::PlanContext;
use curionav_pool::peers::Peers;
use curionav_pool::pool::Pool;

/// How long a mission waits for a ready replica of every role before the arbiter goes ahead on its own.
const POOL_PATIENCE: Duration = Duration::from_secs(5);
/// How long it waits for a term that is not built in. Only its replicas compute it, so the mission is then refused.
const FOREIGN_PATIENCE: Duration = Duration::from_secs(20);
/// Between two looks, unless a probe comes back.
const PAUSE: Duration = Duration::from_millis(5);

/// Completes once every replica that is wanted and alive is ready, and there is one of each role. The second and
/// further ones of a role are awaited for a short time, and so is the first if the arbiter can replace the role; a term
/// that is not built in is awaited for longer: without it nothing can be followed, and the mission is refused. With
/// `in_process = false`, the first of each built-in role is awaited indefinitely.
pub async fn await_pool<P: Peers>(pool: &Pool<P>, context: &PlanContext) -> Result<(), Reject> {
    let roles: Vec<&str> = context.pool_roles().collect();
    let started = pool.peers.now();
    let mut done_without = BTreeSet::new();
    loop {
        let probed = pool.probed();
        let waited = pool.peers.now().saturating_sub(started);
        let mut missing = false;
        for role in &roles {
            let ready = pool.replicas().ready(role).len();
            let alive = pool.peers.alive(role).len();
            let all = ready >= alive.min(context.replicas_wanted(role));
            if (ready > 0 && all) || done_without.contains(role) {
                continue;
            }
            // A token without a replica behind it, or a replica that is broken, must not hold a mission up for ever.
            let has_one = ready > 0 && !context.is_foreign(role);
            if (context.is_replaceable(role) || has_one) && waited >= POOL_PATIENCE {
                tracing::warn!(role, "not every replica is ready");
                done_without.insert(role);
            } else if context.is_foreign(role) && waited >= patience(pool, role) {
                if ready == 0 {
                    return Err(refusal(pool, context, role));
                }
                tracing::warn!(role, "not every replica is ready");
                done_without.insert(role);
            } else {
                missing = true;
            }
        }
        if !missing {
            return Ok(());
        }
        tokio::select! {
            () = probed => {}
            () = pool.peers.sleep(PAUSE) => {}
        }
    }
}

/// How long to wait for a term that is not built in: less if one of its replicas says that it never will be ready.
fn patience<P: Peers>(pool: &Pool<P>, role: &str) -> Duration {
    let refused = pool.refusal(role).is_some_and(|(_, reject)| !reject.why.is_transient());
    if refused { POOL_PATIENCE } else { FOREIGN_PATIENCE }
}

/// Why a mission cannot do without a term. One that has been under way is not given up because its replicas are out of
/// reach: they may come back, or be in reach of another arbiter.
fn refusal<P: Peers>(pool: &Pool<P>, context: &PlanContext, role: &str) -> Reject {
    let refused = pool.refusal(role);
    let may_come = refused.as_ref().is_none_or(|(_, reject)| reject.why.is_transient());
    let detail = refused.map_or_else(
        || "none is alive, or none answers".to_owned(),
        |(instance, reject)| format!("{instance}: {reject}"),
    );
    let may_come = may_come && context.mission.has_run;
    Refusal::no_replica(role, may_come, detail).at(format!("terms.{role}"))
}
