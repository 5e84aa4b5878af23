//! Where the errors are: pictures of moments, and shares by the distance to a depth edge.

use crate::Fallible;
use image::{Rgb, RgbImage};
use sphereflow_core::Plane;
use sphereflow_sphere::Camera;
use std::fmt::Write as _;
use std::path::Path;

/// Neighbours whose range differs by more than this share lie on two sides of an edge.
const EDGE: f32 = 0.05;

/// Upper ends of the classes of distance to an edge, pixels; and whether the edge is of the image.
const REACHES: [usize; 6] = [1, 2, 4, 8, 16, 32];

/// The error that is white in the pictures.
const WHITE: f32 = 0.2;

/// Pictures at most, and the seconds between two.
const PICTURES: usize = 4;
const APART_S: f64 = 0.5;

/// Errors from some time on, by place.
pub struct Maps {
    from_s: f64,
    width: usize,
    height: usize,
    frames: f64,
    /// Error, pixels and squared error over deviation by class: distances, beyond all of them, the image's border.
    sums: [[f64; 3]; REACHES.len() + 2],
    pictures: Vec<(f64, RgbImage)>,
}

impl Maps {
    pub fn new(camera: &Camera, from_s: f64) -> Self {
        Self {
            from_s,
            width: camera.width(),
            height: camera.height(),
            frames: 0.0,
            sums: [[0.0; 3]; REACHES.len() + 2],
            pictures: Vec::new(),
        }
    }

    /// A judged frame.
    pub fn add(
        &mut self,
        t_s: f64,
        image: &Plane<f32>,
        truth: &Plane<f32>,
        range: &Plane<f32>,
        std: &Plane<f32>,
    ) -> Fallible<()> {
        if t_s < self.from_s - 1e-6 {
            return Ok(());
        }
        self.frames += 1.0;
        let distance = self.distance_to_edge(truth);
        for y in 0..self.height {
            for x in 0..self.width {
                let error = (range[(x, y)] - truth[(x, y)]).abs() / truth[(x, y)];
                let far = distance[y * self.width + x];
                let class = REACHES.iter().position(|reach| far <= *reach);
                let rim = x.min(y).min(self.width - 1 - x).min(self.height - 1 - y) < 16;
                let class = class.unwrap_or(REACHES.len() + usize::from(rim));
                if error.is_finite() {
                    self.sums[class][0] += f64::from(error);
                    self.sums[class][1] += 1.0;
                    let normal = (range[(x, y)] - truth[(x, y)]) / std[(x, y)];
                    self.sums[class][2] += f64::from(normal * normal);
                }
            }
        }
        let next_s = self.from_s + self.pictures.len() as f64 * APART_S;
        if self.pictures.len() < PICTURES && t_s >= next_s - 1e-6 {
            self.pictures
                .push((t_s, self.picture(image, truth, range, std)));
        }
        Ok(())
    }

    /// Distance in pixels (the larger of both axes) to the next depth edge.
    fn distance_to_edge(&self, truth: &Plane<f32>) -> Vec<usize> {
        let (width, height) = (self.width, self.height);
        let mut far = vec![usize::MAX / 2; width * height];
        let mut next = Vec::new();
        for y in 1..height {
            for x in 1..width {
                let own = truth[(x, y)];
                for (nx, ny) in [(x - 1, y), (x, y - 1)] {
                    if (truth[(nx, ny)] - own).abs() > EDGE * own.min(truth[(nx, ny)]) {
                        for place in [y * width + x, ny * width + nx] {
                            if far[place] != 0 {
                                far[place] = 0;
                                next.push(place);
                            }
                        }
                    }
                }
            }
        }
        for distance in 1..=REACHES[REACHES.len() - 1] {
            for place in std::mem::take(&mut next) {
                let (x, y) = (place % width, place / width);
                for ny in y.saturating_sub(1)..(y + 2).min(height) {
                    for nx in x.saturating_sub(1)..(x + 2).min(width) {
                        if far[ny * width + nx] > distance {
                            far[ny * width + nx] = distance;
                            next.push(ny * width + nx);
                        }
                    }
                }
            }
        }
        far
    }

    /// Image and true range above; error (black 0, white 20 %) and deviation on the same scale below.
    fn picture(
        &self,
        image: &Plane<f32>,
        truth: &Plane<f32>,
        range: &Plane<f32>,
        std: &Plane<f32>,
    ) -> RgbImage {
        let (width, height) = (self.width, self.height);
        let mut picture = RgbImage::new(2 * width as u32, 2 * height as u32);
        for y in 0..height {
            for x in 0..width {
                let at = (x, y);
                let signed = (range[at] - truth[at]) / truth[at];
                let panes = [
                    grey(image[at] / 256.0),
                    grey(truth[at] / 4.0),
                    signed_colour(signed / WHITE),
                    grey(std[at] / range[at] / WHITE),
                ];
                for (i, colour) in panes.into_iter().enumerate() {
                    let (px, py) = (x + i % 2 * width, y + i / 2 * height);
                    picture.put_pixel(px as u32, py as u32, colour);
                }
            }
        }
        picture
    }

    /// Writes the pictures; returns what the classes are off by.
    pub fn write(&self, folder: &Path, name: &str) -> Fallible<String> {
        std::fs::create_dir_all(folder)?;
        for (t_s, picture) in &self.pictures {
            let plain = name.replace([' ', ',', '%', '/'], "_");
            picture.save(folder.join(format!("{plain}_{t_s:.2}s.png")))?;
        }
        let all = self.frames * (self.width * self.height) as f64;
        let mut text =
            String::from("    distance to an edge, px | pixels % | mean error % | its part of E %");
        let mut names: Vec<String> = REACHES.iter().map(|r| format!("to {r}")).collect();
        names.extend(["beyond".into(), "beyond, border of 16".into()]);
        for (name, [error, pixels, squares]) in names.iter().zip(self.sums) {
            let (share, mean) = (100.0 * pixels / all, 100.0 * error / pixels.max(1.0));
            write!(
                text,
                "\n    {name} | {share:.2} | {mean:.2} | {:.3} | {:.2}",
                100.0 * error / all,
                (squares / pixels.max(1.0)).sqrt()
            )?;
        }
        Ok(text)
    }
}

fn grey(value: f32) -> Rgb<u8> {
    let level = (255.0 * value.clamp(0.0, 1.0)) as u8;
    Rgb([level; 3])
}

/// Too far red, too near blue, unknown green.
fn signed_colour(value: f32) -> Rgb<u8> {
    if value.is_nan() {
        return Rgb([0, 255, 0]);
    }
    let level = (255.0 * value.abs().min(1.0).sqrt()) as u8;
    if value > 0.0 {
        Rgb([level, level / 3, 0])
    } else {
        Rgb([0, level / 3, level])
    }
}
