//! YUV 4:2:2 to RGB: two pixels share their colour, in one of two orders of bytes.

use sphereflow_core::{Plane, Result};

/// Order of the four bytes of two pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// U Y V Y.
    Uyvy,
    /// Y U Y V.
    Yuyv,
}

/// Weights of the conversion (ITU-R BT.601, studio range), fixed point with `unit` for 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct YuvWeights {
    y: i32,
    v_red: i32,
    v_green: i32,
    u_green: i32,
    u_blue: i32,
    unit: i32,
}

impl YuvWeights {
    /// Thousandths: the usual ones for a Kinect.
    pub const KINECT: Self = Self {
        y: 1164,
        v_red: 1596,
        v_green: 813,
        u_green: 391,
        u_blue: 2018,
        unit: 1000,
    };
    /// 256ths: the usual ones for a PS1080.
    pub const PS1080: Self = Self {
        y: 298,
        v_red: 409,
        v_green: 208,
        u_green: 100,
        u_blue: 516,
        unit: 256,
    };

    fn rgb(&self, y: u8, u: u8, v: u8) -> [u8; 3] {
        let (y, u, v) = (i32::from(y) - 16, i32::from(u) - 128, i32::from(v) - 128);
        let base = self.y * y + self.unit / 2;
        [
            base + self.v_red * v,
            base - self.v_green * v - self.u_green * u,
            base + self.u_blue * u,
        ]
        .map(|channel| channel.div_euclid(self.unit).clamp(0, 255) as u8)
    }
}

/// RGB of an image of YUV 4:2:2.
///
/// # Errors
/// Where the width is odd or `raw` is not `2 * width * height` bytes.
pub fn rgb_from_yuv422(
    width: usize,
    height: usize,
    raw: &[u8],
    order: Order,
    weights: &YuvWeights,
) -> Result<Plane<[u8; 3]>> {
    if !width.is_multiple_of(2) || raw.len() != 2 * width * height {
        return Err(sphereflow_core::Error::shape(
            "raw",
            format!("{width}x{height} pixels of 2 bytes, an even width"),
            format!("{} bytes", raw.len()),
        ));
    }
    let mut data = Vec::with_capacity(width * height);
    for pair in raw.chunks_exact(4) {
        let (y0, y1, u, v) = match order {
            Order::Uyvy => (pair[1], pair[3], pair[0], pair[2]),
            Order::Yuyv => (pair[0], pair[2], pair[1], pair[3]),
        };
        data.push(weights.rgb(y0, u, v));
        data.push(weights.rgb(y1, u, v));
    }
    Plane::from_vec(width, height, data)
}

/// YUV 4:2:2 of an RGB image (BT.601, studio range), its colour that of each pair's mean. An odd last
/// column is left out.
pub fn yuv422_from_rgb(colour: &Plane<[u8; 3]>, order: Order) -> Vec<u8> {
    let mut raw = Vec::with_capacity(2 * colour.data().len());
    for y in 0..colour.height() {
        for pair in colour.row(y).chunks_exact(2) {
            let luma = |[r, g, b]: [u8; 3]| {
                16.0 + 0.257 * f64::from(r) + 0.504 * f64::from(g) + 0.098 * f64::from(b)
            };
            let [r, g, b] =
                [0, 1, 2].map(|c| (f64::from(pair[0][c]) + f64::from(pair[1][c])) / 2.0);
            let u = 128.0 - 0.148 * r - 0.291 * g + 0.439 * b;
            let v = 128.0 + 0.439 * r - 0.368 * g - 0.071 * b;
            let [y0, y1, u, v] = [luma(pair[0]), luma(pair[1]), u, v].map(|c| c.round() as u8);
            raw.extend(match order {
                Order::Uyvy => [u, y0, v, y1],
                Order::Yuyv => [y0, u, y1, v],
            });
        }
    }
    raw
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of three 8-bit values, amplified by the largest weight (2.02).
    const ROUNDING: u8 = 3;

    #[test]
    fn yuv_of_black_white_and_grey_is_exact() {
        for (y, expected) in [(16, 0), (235, 255), (126, 128)] {
            let rgb = rgb_from_yuv422(2, 1, &[128, y, 128, y], Order::Uyvy, &YuvWeights::PS1080);
            assert_eq!(rgb.unwrap()[(0, 0)], [expected; 3]);
        }
    }

    #[test]
    fn rgb_to_yuv_and_back_keeps_colours() {
        let colour = Plane::from_fn(8, 8, |x, y| [(x / 2 * 60) as u8, (y * 36) as u8, 90]);
        for order in [Order::Uyvy, Order::Yuyv] {
            for weights in [YuvWeights::KINECT, YuvWeights::PS1080] {
                let raw = yuv422_from_rgb(&colour, order);
                let back = rgb_from_yuv422(8, 8, &raw, order, &weights).unwrap();
                for (a, b) in colour.data().iter().zip(back.data()) {
                    assert!(
                        (0..3).all(|c| a[c].abs_diff(b[c]) <= ROUNDING),
                        "{a:?} {b:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn yuv_of_a_wrong_size_is_an_error() {
        assert!(rgb_from_yuv422(3, 2, &[0; 12], Order::Uyvy, &YuvWeights::KINECT).is_err());
        assert!(rgb_from_yuv422(2, 2, &[0; 7], Order::Uyvy, &YuvWeights::KINECT).is_err());
    }
}
