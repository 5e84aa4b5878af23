//! Checks of a series of vector readings.

use crate::Result;
use nalgebra::Vector3;
use sphereflow_core::{Error, Stamp};

/// Lengths agree, stamps increase, numbers are finite.
pub(crate) fn check(
    name: &str,
    stamps: &[Stamp],
    values: &[Vector3<f64>],
    needed: usize,
) -> Result<()> {
    if values.len() != stamps.len() || values.len() < needed {
        let expected = format!("({}, 3), at least {needed} rows", stamps.len());
        return Err(Error::shape(
            name,
            expected,
            format!("({}, 3)", values.len()),
        ));
    }
    for (i, pair) in stamps.windows(2).enumerate() {
        if pair[1] <= pair[0] {
            return Err(Error::TimeOrder {
                argument: "stamp_ns".into(),
                earlier: pair[0],
                later: pair[1],
                index: i + 1,
            });
        }
    }
    if let Some(i) = values.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        let found = format!("{:?}", values[i].as_slice());
        return Err(Error::value(
            format!("{name}[{i}]"),
            "finite numbers",
            found,
        ));
    }
    Ok(())
}
