//! Points and poses as short arrays: `[x, y]` and `[x, y, heading]`, as people write them.

use serde::de::{Deserialize, Deserializer, Error};

/// Not one number more: a heading written behind a goal would be ignored without a word.
fn exactly<T, const N: usize, E: Error>(numbers: Vec<T>) -> Result<[T; N], E> {
    let count = numbers.len();
    let wanted = format!("{N} numbers");
    numbers.try_into().map_err(|_| E::invalid_length(count, &wanted.as_str()))
}

/// As many numbers as the field has.
pub(super) fn fixed<'de, T: Deserialize<'de>, const N: usize, D: Deserializer<'de>>(
    d: D,
) -> Result<[T; N], D::Error> {
    exactly(Vec::deserialize(d)?)
}

/// `[x, y, heading]`.
pub(super) mod pose {
    use curionav_planning::geometry::Pose2;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(in super::super) fn serialize<S: Serializer>(pose: &Pose2, s: S) -> Result<S::Ok, S::Error> {
        [pose.x, pose.y, pose.heading].serialize(s)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Pose2, D::Error> {
        let [x, y, heading] = super::exactly(Vec::deserialize(d)?)?;
        Ok(Pose2::new(x, y, heading))
    }
}

/// `[x, y]`.
pub(super) mod point {
    use curionav_planning::geometry::Point2;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(in super::super) fn serialize<S: Serializer>(point: &Point2, s: S) -> Result<S::Ok, S::Error> {
        [point.x, point.y].serialize(s)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Point2, D::Error> {
        let [x, y] = super::exactly(Vec::deserialize(d)?)?;
        Ok(Point2::new(x, y))
    }
}

/// `[[x, y], ...]`.
pub(super) mod points {
    use curionav_planning::geometry::Point2;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(in super::super) fn serialize<S: Serializer>(points: &[Point2], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(points.iter().map(|p| [p.x, p.y]))
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<Point2>, D::Error> {
        let pairs = Vec::<Vec<f64>>::deserialize(d)?;
        pairs.into_iter().map(|pair| super::exactly(pair).map(|[x, y]| Point2::new(x, y))).collect()
    }
}
