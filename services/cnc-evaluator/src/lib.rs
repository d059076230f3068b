//! Curiosity for negative content: what each candidate costs people, by the human comfort and crowd density
//! map (eqs. 16 to 18).

curionav_pool::evaluation_service!("cnc");
