//! Residuals and derivatives of one point, into its normal matrices. Thesis: section 8.4.2.

use super::{Chunk, Direct, Link, Scene};
use crate::bundle::ids::NONE;
use crate::bundle::normal::{Curvature, Normal};
use crate::bundle::state::ViewPose;
use crate::linear::BlockPattern;
use nalgebra::{Matrix3, Vector3};

impl Chunk {
    #[inline(always)]
    pub(super) fn linearise_point(
        &mut self,
        point: usize,
        scene: &Scene,
        maps: (&BlockPattern, &Direct),
        normal: &mut Normal,
    ) {
        let position = self.current[point];
        let free = self.free[point];
        let (mut v, mut g) = (Matrix3::zeros(), Vector3::zeros());
        for touch in self.touch_range(point) {
            let range = self.touches[touch].w();
            self.w[range].fill(0.0);
        }
        let links = self.starts[point].link as usize..self.starts[point + 1].link as usize;
        let mut k = self.starts[point].observation as usize;
        for link in links {
            let link = self.links[link];
            let pose = &scene.poses[link.view as usize];
            let x = pose.transform(&position);
            let camera = scene.camera(&link);
            let free_intrinsics = camera.intrinsics.free();
            normal.clear(free_intrinsics);
            while k < link.observations as usize {
                let above = Curvature::Above;
                self.observations[k].add(camera, &x, scene.losses, above, normal);
                k += 1;
            }
            // Thesis: section 9.3.2: the derivative by the point is the pose's rotation
            let n = normal.m * pose.rotation;
            if free {
                v += pose.rotation.tr_mul(&n);
                g += pose.rotation.tr_mul(&normal.g);
                self.add_touches(&link, &x, &n, pose, normal, free_intrinsics);
            }
            self.add_direct(&link, &x, normal, maps, free_intrinsics);
        }
        if free {
            self.gradient_max = self.gradient_max.max(g.amax());
            self.v[point] = [v.m11, v.m12, v.m13, v.m22, v.m23, v.m33];
            self.g[point] = g;
        }
    }

    /// Normal matrix of pose (and intrinsics) by point: `[x]_ M R; M R`.
    #[inline(always)]
    fn add_touches(
        &mut self,
        link: &Link,
        x: &Vector3<f64>,
        n: &Matrix3<f64>,
        pose: &ViewPose,
        normal: &Normal,
        parameters: usize,
    ) {
        if link.view_touch != NONE {
            let range = self.touches[link.view_touch as usize].w();
            for (column, w) in self.w[range].chunks_exact_mut(6).enumerate() {
                let below = Vector3::new(n[(0, column)], n[(1, column)], n[(2, column)]);
                let above = x.cross(&below);
                w.copy_from_slice(&[above.x, above.y, above.z, below.x, below.y, below.z]);
            }
        }
        if link.camera_touch != NONE {
            let range = self.touches[link.camera_touch as usize].w();
            let w = &mut self.w[range];
            for i in 0..parameters {
                let row = pose.rotation.tr_mul(&normal.intrinsics_by_point[i]);
                for column in 0..3 {
                    w[column * parameters + i] += row[column];
                }
            }
        }
    }

    /// Normal matrix and gradient of pose and intrinsics. The derivative of the point in the camera
    /// frame by the left update of the pose is `[-[x]_, I]` (Thesis: section 8.4.2).
    #[inline(always)]
    fn add_direct(
        &mut self,
        link: &Link,
        x: &Vector3<f64>,
        normal: &Normal,
        (pattern, direct): (&BlockPattern, &Direct),
        parameters: usize,
    ) {
        if link.view_block != NONE {
            let block = link.view_block as usize;
            let u = &mut self.direct[direct.diagonal[block]..direct.diagonal[block] + 36];
            let cross = |v: [f64; 3]| {
                [
                    x.y * v[2] - x.z * v[1],
                    x.z * v[0] - x.x * v[2],
                    x.x * v[1] - x.y * v[0],
                ]
            };
            let m = &normal.m;
            // columns of [x]_ M, then -[x]_ M [x]_ from its rows
            let hm: [[f64; 3]; 3] =
                std::array::from_fn(|c| cross([m[(0, c)], m[(1, c)], m[(2, c)]]));
            let row = |r: usize| cross([hm[0][r], hm[1][r], hm[2][r]]);
            let hmh = [row(0), row(1), row(2)];
            for c in 0..3 {
                for r in 0..3 {
                    u[6 * c + r] += hmh[r][c];
                    u[6 * c + 3 + r] += hm[r][c];
                    u[6 * (c + 3) + r] += hm[c][r];
                    u[6 * (c + 3) + 3 + r] += m[(r, c)];
                }
            }
            let start = pattern.start(block);
            let gradient = &mut self.gradient[start..start + 6];
            let above = x.cross(&normal.g);
            for k in 0..3 {
                gradient[k] += above[k];
                gradient[3 + k] += normal.g[k];
            }
        }
        if link.camera_block != NONE && parameters > 0 {
            self.add_direct_intrinsics(link, x, normal, (pattern, direct), parameters);
        }
    }

    fn add_direct_intrinsics(
        &mut self,
        link: &Link,
        x: &Vector3<f64>,
        normal: &Normal,
        (pattern, direct): (&BlockPattern, &Direct),
        parameters: usize,
    ) {
        let block = link.camera_block as usize;
        let (start, offset) = (pattern.start(block), direct.diagonal[block]);
        let cross = direct.cross[link.view as usize];
        for i in 0..parameters {
            self.gradient[start + i] += normal.intrinsics_gradient[i];
            for j in 0..parameters {
                self.direct[offset + j * parameters + i] += normal.intrinsics[i][j];
            }
            if cross != NONE {
                let q = &normal.intrinsics_by_point[i];
                let above = x.cross(q);
                for column in 0..3 {
                    let at = cross as usize + column * parameters + i;
                    self.direct[at] += above[column];
                    self.direct[at + 3 * parameters] += q[column];
                }
            }
        }
    }
}
