//! Keeping the pool warm: every replica that appears is asked to prepare for the mission before it is
//! given work.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use curionav_runtime::membership::Membership;
use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_schemas::{GenerateReply, Scores, keys};
use tokio::task::JoinSet;
use zenoh::Session;

use crate::context::PlanContext;
use crate::peers::{GENERATOR, ZenohPeers};

/// A replica may have to fetch a large map and derive its fields on a slow machine.
const WARM_UP_TIMEOUT: Duration = Duration::from_secs(30);
/// Between attempts on a replica that refused or did not answer.
const RETRY: Duration = Duration::from_millis(500);

/// Follows membership and warms whoever is new, until it is aborted (the mission has changed).
pub(crate) async fn keep_warm(
    session: Session,
    membership: Arc<Membership>,
    peers: Arc<ZenohPeers>,
    context: Arc<PlanContext>,
) {
    let roles: Vec<String> =
        std::iter::once(GENERATOR.to_owned()).chain(context.pool_metrics().map(ToOwned::to_owned)).collect();
    let mut changes = membership.changes();
    let mut known = BTreeSet::new();
    let mut warming = JoinSet::new();
    loop {
        let alive: BTreeSet<(String, String)> = roles
            .iter()
            .flat_map(|role| membership.of(role).into_iter().map(move |instance| (role.clone(), instance)))
            .collect();
        for (role, instance) in known.difference(&alive) {
            tracing::info!(role, instance, "replica gone");
            peers.set_warm(role, instance, false);
        }
        for (role, instance) in alive.difference(&known).cloned() {
            let (session, context) = (session.clone(), Arc::clone(&context));
            warming.spawn(async move {
                let warm = warm_up(&session, &context, &role, &instance).await;
                if warm.is_err() {
                    tokio::time::sleep(RETRY).await;
                }
                (role, instance, warm)
            });
        }
        known = alive;
        tokio::select! {
            changed = changes.changed() => if changed.is_err() { return },
            Some(joined) = warming.join_next(), if !warming.is_empty() => {
                let Ok((role, instance, outcome)) = joined else { continue };
                let key = (role, instance);
                if !known.contains(&key) {
                    continue;
                }
                match outcome {
                    Ok(()) => {
                        tracing::info!(role = %key.0, instance = %key.1, "replica warm");
                        peers.set_warm(&key.0, &key.1, true);
                    }
                    Err(error) => {
                        tracing::warn!(role = %key.0, instance = %key.1, %error, "replica did not warm up, trying again");
                        known.remove(&key);
                    }
                }
            }
        }
    }
}

async fn warm_up(
    session: &Session,
    context: &PlanContext,
    role: &str,
    instance: &str,
) -> Result<(), AskError> {
    let send = |e: String| AskError::Send(e);
    let budget_ms = WARM_UP_TIMEOUT.as_millis() as u32;
    if role == GENERATOR {
        let mut request = context.warm_up_generator().map_err(AskError::Rejected)?;
        request.budget_ms = budget_ms;
        let key = keys::generate(instance).map_err(|e| send(e.to_string()))?;
        ask::<_, GenerateReply>(session, &key, &request, WARM_UP_TIMEOUT, Urgency::Normal).await?;
    } else {
        let mut request = context.warm_up(role);
        request.budget_ms = budget_ms;
        let key = keys::evaluate(role, instance).map_err(|e| send(e.to_string()))?;
        ask::<_, Scores>(session, &key, &request, WARM_UP_TIMEOUT, Urgency::Normal).await?;
    }
    Ok(())
}
