//! Scales of each model: a new one is a new row.

/// A model by the begin of its product number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// Begin of the product number that the device tells, as `G366`.
    pub product: &'static str,
    /// Angular velocity of one 16-bit count, degrees per second.
    pub gyro_deg_s: f64,
    /// Specific force of one 16-bit count, thousandths of g.
    pub accel_mg: f64,
    /// Temperature of one 16-bit count, degrees Celsius.
    pub temperature_c: f64,
    /// Count at 25 degrees Celsius.
    pub counts_at_25_c: f64,
}

const fn warm(product: &'static str, gyro_deg_s: f64, accel_mg: f64) -> Model {
    Model {
        product,
        gyro_deg_s,
        accel_mg,
        temperature_c: -0.003_791_8,
        counts_at_25_c: 2634.0,
    }
}

const fn late(product: &'static str, gyro_deg_s: f64, accel_mg: f64) -> Model {
    Model {
        product,
        gyro_deg_s,
        accel_mg,
        temperature_c: 0.003_906_25,
        counts_at_25_c: 0.0,
    }
}

/// The models whose scales are published. G330, G350 and G370 are not among them: their scales could
/// not be confirmed.
pub const MODELS: [Model; 8] = [
    warm("G320", 0.008, 0.2),
    warm("G354", 0.016, 0.2),
    warm("G364PDCA", 0.003_75, 0.125),
    warm("G364", 0.007_5, 0.125),
    warm("G365PDF1", 1.0 / 66.0, 0.4),
    warm("G365", 1.0 / 66.0, 0.16),
    late("G366", 1.0 / 66.0, 0.25),
    late("G570", 1.0 / 66.0, 0.5),
];

/// The model of a product number, as `G366PDG0`.
pub fn find_model(product: &str) -> Option<&'static Model> {
    MODELS
        .iter()
        .find(|model| product.starts_with(model.product))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_found_by_their_product_number() {
        assert_eq!(find_model("G366PDG0").unwrap().accel_mg, 0.25);
        assert_eq!(find_model("G364PDCA").unwrap().gyro_deg_s, 0.003_75);
        assert_eq!(find_model("G364PDC0").unwrap().gyro_deg_s, 0.007_5);
        assert!(find_model("A352AD10").is_none() && find_model("").is_none());
    }
}
