//! A coloured cloud with one mean point in each cube of space that something was seen in.

use nalgebra::{Vector2, Vector3};
use sphereflow_core::{DepthMap, Error, Plane, Pose, RangeMap, Result, checks};
use sphereflow_sphere::Camera;
use std::collections::HashMap;

/// A voxel's position in voxels.
type Key = [i32; 3];
/// Largest coordinate that is kept: 20 km from the origin at 2 cm.
const KEY_LIMIT: f64 = 1e6;

/// The points of a cloud, in the order in which their voxels were first seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudPoints {
    /// Mean positions, metres, world frame.
    pub positions: Vec<[f32; 3]>,
    /// Mean 8-bit RGB; `None` where a voxel was only ever seen without colour.
    pub colours: Vec<Option<[u8; 3]>>,
    /// Number of observations in each mean.
    pub counts: Vec<u32>,
}

/// Points thinned to one mean per voxel. Memory is bounded: once `max_points` voxels exist, new
/// ones are counted in [`VoxelCloud::dropped`] and left out.
#[derive(Clone, Debug)]
pub struct VoxelCloud {
    voxel_m: f64,
    max_points: usize,
    /// Only looked up, never iterated: the order of `voxels` is that of arrival.
    index: HashMap<Key, u32>,
    voxels: Vec<Voxel>,
    dropped: u64,
    rays: RayCache,
}

/// Sums of one voxel.
#[derive(Clone, Copy, Debug, Default)]
struct Voxel {
    sum: [f64; 3],
    count: u32,
    colour_sum: [u32; 3],
    colour_count: u32,
}

/// Rays of the pixels used, kept while camera and stride stay the same.
#[derive(Clone, Debug, Default)]
struct RayCache {
    made_for: Option<(Camera, usize)>,
    /// Pixel index and unit ray.
    rays: Vec<(u32, Vector3<f64>)>,
}

impl VoxelCloud {
    /// An empty cloud of cubes of side `voxel_m` metres, of at most `max_points` points.
    ///
    /// # Errors
    /// A core value error where `voxel_m` is not positive or `max_points` is 0 or above 2^31.
    pub fn new(voxel_m: f64, max_points: usize) -> Result<Self> {
        checks::positive("voxel_m", voxel_m)?;
        checks::within("max_points", max_points, 1..=1 << 31)?;
        Ok(Self {
            voxel_m,
            max_points,
            index: HashMap::new(),
            voxels: Vec::new(),
            dropped: 0,
            rays: RayCache::default(),
        })
    }

    /// Adds every `stride`-th pixel of every `stride`-th row of a depth image (along the optical
    /// axis), up to `max_range_m` along the ray. Returns the number of points added.
    ///
    /// # Errors
    /// A core shape error where `depth` or `colour` is not of the camera's size, a value error
    /// where `stride` is 0 or `max_range_m` is not positive; the cloud is unchanged.
    pub fn add(
        &mut self,
        depth: &DepthMap,
        colour: Option<&Plane<[u8; 3]>>,
        camera: &Camera,
        world_from_camera: &Pose,
        stride: usize,
        max_range_m: f64,
    ) -> Result<usize> {
        let along = |value: f64, ray: &Vector3<f64>| value / ray.z;
        let view = View {
            camera,
            world_from_camera,
            stride,
            max_range_m,
        };
        self.add_view(depth.metres(), colour, &view, along)
    }

    /// [`VoxelCloud::add`] for ranges along the rays: what 360-degree cameras have.
    ///
    /// # Errors
    /// As [`VoxelCloud::add`].
    pub fn add_ranges(
        &mut self,
        range: &RangeMap,
        colour: Option<&Plane<[u8; 3]>>,
        camera: &Camera,
        world_from_camera: &Pose,
        stride: usize,
        max_range_m: f64,
    ) -> Result<usize> {
        let view = View {
            camera,
            world_from_camera,
            stride,
            max_range_m,
        };
        self.add_view(range.metres(), colour, &view, |value, _| value)
    }

    /// Adds the points of another cloud at the pose `own_from_other`, each with its number of
    /// observations.
    pub fn merge(&mut self, other: &Self, own_from_other: &Pose) {
        for voxel in &other.voxels {
            let mean = Vector3::from(voxel.sum) / f64::from(voxel.count);
            let point = own_from_other.transform(&mean);
            if let Some(slot) = self.slot(&point) {
                self.voxels[slot].join(&point, voxel);
            }
        }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    /// Observations left out because the cloud was full or they lay beyond its bounds.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The points, in the order in which their voxels were first seen.
    pub fn points(&self) -> CloudPoints {
        CloudPoints {
            positions: self.voxels.iter().map(Voxel::position).collect(),
            colours: self.voxels.iter().map(Voxel::colour).collect(),
            counts: self.voxels.iter().map(|voxel| voxel.count).collect(),
        }
    }

    fn add_view(
        &mut self,
        metres: &Plane<f32>,
        colour: Option<&Plane<[u8; 3]>>,
        view: &View<'_>,
        range_of: impl Fn(f64, &Vector3<f64>) -> f64,
    ) -> Result<usize> {
        view.check("depth", metres.size())?;
        if let Some(colour) = colour {
            view.check("colour", colour.size())?;
        }
        let mut cache = std::mem::take(&mut self.rays);
        cache.prepare(view.camera, view.stride);
        let mut added = 0;
        for (pixel, ray) in &cache.rays {
            let range = range_of(f64::from(metres.data()[*pixel as usize]), ray);
            if range > 0.0 && range <= view.max_range_m {
                let point = view.world_from_camera.transform(&(ray * range));
                let rgb = colour.map(|colour| colour.data()[*pixel as usize]);
                added += usize::from(self.add_point(&point, rgb));
            }
        }
        self.rays = cache;
        Ok(added)
    }

    fn add_point(&mut self, point: &Vector3<f64>, rgb: Option<[u8; 3]>) -> bool {
        match self.slot(point) {
            Some(slot) => self.voxels[slot].add(point, rgb),
            None => false,
        }
    }

    /// The voxel of a point, made where there is none; `None`, and counted, where the cloud is full
    /// or the point beyond its bounds.
    fn slot(&mut self, point: &Vector3<f64>) -> Option<usize> {
        let scaled = point / self.voxel_m;
        let key: Key = [scaled.x, scaled.y, scaled.z].map(|v| v.floor() as i32);
        if let Some(&slot) = self.index.get(&key) {
            return Some(slot as usize);
        }
        let inside = scaled.iter().all(|v| v.abs() < KEY_LIMIT); // false for NaN
        if !inside || self.voxels.len() >= self.max_points {
            self.dropped += 1;
            return None;
        }
        self.index.insert(key, self.voxels.len() as u32);
        self.voxels.push(Voxel::default());
        Some(self.voxels.len() - 1)
    }
}

/// From where and how an image is added.
struct View<'a> {
    camera: &'a Camera,
    world_from_camera: &'a Pose,
    stride: usize,
    max_range_m: f64,
}

impl View<'_> {
    fn check(&self, argument: &str, size: (usize, usize)) -> Result<()> {
        let expected = (self.camera.width(), self.camera.height());
        if size != expected {
            let text = |(w, h): (usize, usize)| format!("{w}x{h} pixels");
            return Err(Error::shape(argument, text(expected), text(size)));
        }
        if self.stride == 0 {
            return Err(Error::value("stride", "1 or more", self.stride));
        }
        if self.max_range_m.is_nan() || self.max_range_m <= 0.0 {
            let found = self.max_range_m;
            return Err(Error::value(
                "max_range_m",
                "a positive number of metres",
                found,
            ));
        }
        Ok(())
    }
}

impl RayCache {
    fn prepare(&mut self, camera: &Camera, stride: usize) {
        if self
            .made_for
            .as_ref()
            .is_some_and(|(c, s)| c == camera && *s == stride)
        {
            return;
        }
        self.rays.clear();
        for y in (0..camera.height()).step_by(stride) {
            for x in (0..camera.width()).step_by(stride) {
                if let Some(ray) = camera.unproject(&Vector2::new(x as f64, y as f64)) {
                    self.rays.push(((y * camera.width() + x) as u32, ray));
                }
            }
        }
        self.made_for = Some((camera.clone(), stride));
    }
}

impl Voxel {
    /// Adds an observation; a voxel that has had 2^24 of them is settled and takes no more.
    fn add(&mut self, point: &Vector3<f64>, rgb: Option<[u8; 3]>) -> bool {
        if self.count >= 1 << 24 {
            return false;
        }
        self.count += 1;
        for k in 0..3 {
            self.sum[k] += point[k];
        }
        if let Some(rgb) = rgb {
            self.colour_count += 1;
            for (sum, value) in self.colour_sum.iter_mut().zip(rgb) {
                *sum += u32::from(value);
            }
        }
        true
    }

    /// Adds the observations of another voxel, whose mean is at `point` here; a settled voxel takes no
    /// more.
    fn join(&mut self, point: &Vector3<f64>, other: &Self) {
        let count = u64::from(self.count) + u64::from(other.count);
        if count > 1 << 24 {
            return;
        }
        for k in 0..3 {
            self.sum[k] += f64::from(other.count) * point[k];
            self.colour_sum[k] = self.colour_sum[k].saturating_add(other.colour_sum[k]);
        }
        self.count += other.count;
        self.colour_count += other.colour_count;
    }

    fn position(&self) -> [f32; 3] {
        self.sum.map(|sum| (sum / f64::from(self.count)) as f32)
    }

    fn colour(&self) -> Option<[u8; 3]> {
        let count = self.colour_count;
        (count > 0).then(|| self.colour_sum.map(|sum| ((sum + count / 2) / count) as u8))
    }
}
