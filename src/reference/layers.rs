//! Layers over a base: sheen, and a clearcoat over both (KHR_materials_sheen, KHR_materials_clearcoat).
//!
//! The coat takes its share by Fresnel at the viewer's angle, as its specification says. The sheen takes from the base
//! the share that it reflects of uniform light, at the viewer's or the light's angle, whichever is larger.

use glam::{Mat3, Vec3};
use std::f32::consts::FRAC_1_PI;

use super::bsdf::{SMOOTH, Scatter, Viewing, frame, is_consistent, sample_cosine};
use super::microfacet::{Ggx, schlick};
use crate::scene::finish::FinishParams;
use crate::scene::sheen;

/// Reflectance of a coat of index 1.5 at normal incidence.
const COAT_F0: f32 = 0.04;

/// The layers at one point, for one viewing direction.
#[derive(Clone, Copy, Debug)]
pub struct Layers {
    /// World from local, about the base's shading normal and about the coat's.
    base_frame: Mat3,
    coat_frame: Mat3,
    geometric: Vec3,
    /// Towards the viewer, in those frames.
    wo: Vec3,
    coat_wo: Vec3,
    coat: Ggx,
    /// Share of light that the coat reflects.
    coat_share: f32,
    /// The colour of the sheen's lobe, and the largest channel of the material's sheen colour.
    sheen: Vec3,
    sheen_max: f32,
    sheen_roughness: f32,
    /// The albedo of a white sheen's lobe towards the viewer.
    viewer_albedo: f32,
    /// Sampling probabilities of coat and sheen; the base has the rest.
    choose: [f32; 2],
}

/// The share of light that a clearcoat reflects, by the cosine between its normal and the viewer.
fn coat_share(finish: &FinishParams, cos: f32) -> f32 {
    finish.clearcoat * (COAT_F0 + (1.0 - COAT_F0) * schlick(cos))
}

/// The share of light from below a clearcoat that passes it.
pub fn coat_leaves(finish: &FinishParams, normal: Vec3, to_viewer: Vec3) -> f32 {
    1.0 - coat_share(finish, normal.dot(to_viewer).abs())
}

impl Layers {
    /// The layers; `None` without coat and sheen. `base` is the largest share of light that the base reflects.
    #[cold]
    pub fn new(finish: &FinishParams, viewing: &Viewing, base: f32) -> Option<Self> {
        if finish.clearcoat == 0.0 && finish.sheen_color == Vec3::ZERO {
            return None;
        }
        let (base_frame, coat_frame) = (frame(viewing.normal), frame(viewing.coat_normal));
        let towards = |frame: &Mat3| {
            let wo = frame.transpose() * viewing.wo;
            wo.with_z(wo.z.max(1e-6))
        };
        let (wo, coat_wo) = (towards(&base_frame), towards(&coat_frame));
        let viewer_albedo = sheen::albedo(finish.sheen_roughness, wo.z);
        let coat_share = coat_share(finish, coat_wo.z.min(1.0));
        let sheen_max = finish.sheen_color.max_element();
        // Every existing layer has a minimum probability: its lobe may be bright where no other lobe is sampled.
        let sheen_weight = if sheen_max > 0.0 { (sheen_max * viewer_albedo.min(1.0)).max(0.05) } else { 0.0 };
        let base_weight = if base > 0.0 { base.max(0.05) } else { 0.0 };
        let total = coat_share + (1.0 - coat_share) * (base_weight + sheen_weight);
        if total == 0.0 {
            return None;
        }
        Some(Self {
            base_frame,
            coat_frame,
            geometric: viewing.geometric,
            wo,
            coat_wo,
            coat: Ggx::isotropic(finish.clearcoat_roughness * finish.clearcoat_roughness),
            coat_share,
            // Below a roughness of 0.25 the lobe would reflect more light than it receives near grazing.
            sheen: finish.sheen_color / viewer_albedo.max(1.0),
            sheen_max,
            sheen_roughness: finish.sheen_roughness,
            viewer_albedo,
            choose: [coat_share, (1.0 - coat_share) * sheen_weight].map(|weight| weight / total),
        })
    }

    /// The share of the base's light in one direction that passes the layers.
    fn leave(&self, cos: f32) -> f32 {
        let taken = if self.sheen_max > 0.0 {
            self.sheen_max * self.viewer_albedo.max(sheen::albedo(self.sheen_roughness, cos)).min(1.0)
        } else {
            0.0
        };
        (1.0 - taken) * (1.0 - self.coat_share)
    }

    /// The share of light straight through the base that passes the layers.
    pub fn leave_straight(&self) -> f32 {
        self.leave(self.wo.z)
    }

    /// f · |cos| and the density of base and layers, from those of the base.
    #[cold]
    pub fn eval(&self, wi: Vec3, base: Vec3, base_density: f32) -> (Vec3, f32) {
        let [coat, sheen] = self.choose;
        let cos = self.base_frame.z_axis.dot(wi);
        let mut f = base * self.leave(cos.abs().min(1.0));
        let mut density = (1.0 - coat - sheen).max(0.0) * base_density;
        if self.sheen_max > 0.0 && cos > 0.0 && is_consistent(self.geometric, self.base_frame.z_axis, wi) {
            let local = self.base_frame.transpose() * wi;
            let lobe = sheen::lobe(self.sheen_roughness, self.wo, local) * local.z;
            f += self.sheen * (lobe * (1.0 - self.coat_share));
            density += sheen * FRAC_1_PI * local.z;
        }
        if coat > 0.0 && self.coat.x >= SMOOTH && is_consistent(self.geometric, self.coat_frame.z_axis, wi) {
            let local = self.coat_frame.transpose() * wi;
            if local.z > 0.0 {
                let h = (self.coat_wo + local).normalize();
                let visible = self.coat.visible(h, self.coat_wo);
                f += Vec3::splat(self.coat_share * visible * self.coat.g1(local));
                density += coat * visible;
            }
        }
        (f, density)
    }

    /// Chooses a layer by `lobe`: a direction of the coat or the sheen, or the base with the rescaled number.
    #[cold]
    pub fn sample(&self, lobe: f32, u: [f32; 2]) -> Choice {
        let [coat, sheen] = self.choose;
        if lobe < coat {
            let h = if self.coat.x < SMOOTH { Vec3::Z } else { self.coat.sample_visible(self.coat_wo, u) };
            let wi = h * (2.0 * self.coat_wo.dot(h)) - self.coat_wo;
            let direction = (self.coat_frame * wi).normalize();
            if wi.z <= 0.0 || !is_consistent(self.geometric, self.coat_frame.z_axis, direction) {
                return Choice::Nothing;
            }
            if self.coat.x >= SMOOTH {
                return Choice::Direction(direction);
            }
            let weight = Vec3::splat(self.coat_share / coat);
            return Choice::Mirror(Scatter { direction, weight, density: 0.0, mirror: true, compression: 1.0 });
        }
        if lobe < coat + sheen {
            return Choice::Direction((self.base_frame * sample_cosine(u)).normalize());
        }
        Choice::Base(((lobe - coat - sheen) / (1.0 - coat - sheen)).clamp(0.0, 1.0 - f32::EPSILON))
    }

    /// A mirror of the base, as seen through the layers.
    pub fn over_mirror(&self, base: Scatter) -> Scatter {
        let [coat, sheen] = self.choose;
        let cos = self.base_frame.z_axis.dot(base.direction).abs().min(1.0);
        Scatter { weight: base.weight * (self.leave(cos) / (1.0 - coat - sheen)), ..base }
    }
}

/// Choice that [`Layers::sample`] made.
pub enum Choice {
    Nothing,
    Mirror(Scatter),
    /// World space; by a lobe with a density.
    Direction(Vec3),
    /// The base, and a number for it.
    Base(f32),
}
