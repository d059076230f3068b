//! Curiosity for positive content: what each candidate does to the certainty of the position (eqs. 7 to 15).

curionav_pool::evaluation_service!("cpc");
