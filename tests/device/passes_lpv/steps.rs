//! The harness of `passes_lpv.rs`: steps of propagation on the device, with all their bindings.

use std::f64::consts::PI;
use std::sync::Arc;

use bytemuck::Zeroable;
use twobounce::gi::lpv::{self, Lobe, LpvPush};
use twobounce::ground::constants::with;
use twobounce::ground::layout;
use twobounce::vk::*;

use crate::gpu::twins::propagation::{Cell, Cells, Rules, aim};

/// An image of this many grids, one above the other, with these texels.
pub fn volume(context: &Arc<Context>, edge: u32, grids: u32, texels: Option<&[[f32; 4]]>) -> Image {
    let desc = ImageDesc {
        label: "field",
        dim: ImageDim::D3,
        format: Format::R32G32B32A32_SFLOAT,
        width: edge,
        height: edge,
        depth_or_layers: edge * grids,
        usage: ImageUsageFlags::SAMPLED
            | ImageUsageFlags::STORAGE
            | ImageUsageFlags::TRANSFER_DST
            | ImageUsageFlags::TRANSFER_SRC,
        ..Default::default()
    };
    let image = Image::new(context, &desc).expect("an image");
    if let Some(texels) = texels {
        upload_image(context, &image, ImageRegion::level(&image, 0), texels).expect("an upload");
    }
    image
}

/// Two numbers of sixteen bits in a word.
pub fn pack([low, high]: [f64; 2]) -> u32 {
    let unorm = |v: f64| (v * 65535.0).round() as u32;
    unorm(low) | unorm(high) << 16
}

/// Constants of a step of propagation past the sheets of surfaces, of one grid unless others are given.
pub fn propagation(others: &[Constant]) -> Vec<Constant> {
    let own = with(
        lpv::constants(&lpv::Settings::default()),
        &[("CASCADES", 1u32.into()), ("OCCLUSION", lpv::Occlusion::Sheets.into())],
    );
    with(own, others)
}

/// Steps on the device.
pub struct Steps {
    context: Arc<Context>,
    first: Compute,
    next: Compute,
    edge: u32,
    rules: Rules,
}

impl Steps {
    pub fn new(context: &Arc<Context>, edge: u32, rules: Rules) -> Self {
        let pipeline = |first: bool| {
            let (shader, lobe, apart, sharpness) = match rules {
                Rules::Lobes { own, integral } => {
                    let lobe = if integral == PI { Lobe::CosinePi } else { Lobe::Cosine };
                    ("gi/lpv/propagate.comp", lobe, u32::from(!own), 0.0)
                }
                Rules::Beams(sharpness) => ("gi/lpv/propagate_beams.comp", Lobe::Beam, 1, sharpness as f32),
            };
            let constants = propagation(&[
                ("LPV_EDGE", edge.into()),
                ("LOBE", lobe.into()),
                ("SUM", apart.into()),
                ("FIRST_STEP", first.into()),
                ("SHARPNESS", sharpness.into()),
            ]);
            Compute::new(context, &ComputeDesc { label: "propagate", shader, constants: &constants })
                .expect("a pipeline")
        };
        Self { context: context.clone(), first: pipeline(true), next: pipeline(false), edge, rules }
    }

    /// Images with these texels, or empty ones.
    fn field(&self, parts: usize, texels: Option<&dyn Fn(usize) -> Vec<[f32; 4]>>) -> Vec<Image> {
        let part = |part: usize| volume(&self.context, self.edge, 1, texels.map(|texels| texels(part)).as_deref());
        (0..parts).map(part).collect()
    }

    /// Part `part` of the travelling light: red as the cell states, green twice that; the sky stays outside.
    fn texels(&self, start: &Cells, part: usize) -> Vec<[f32; 4]> {
        let texel = |cell: &Cell| match (self.rules, part) {
            (_, 0) => [cell.flux as f32, 2.0 * cell.flux as f32, 0.0, 0.0],
            (Rules::Lobes { .. }, _) => {
                let moment = cell.moment[part - 1] as f32;
                [moment, 2.0 * moment, 0.0, 0.0]
            }
            (Rules::Beams(sharpness), _) => {
                let (direction, whole) = aim(*cell, sharpness);
                direction.extend(1.0 / whole).as_vec4().to_array()
            }
        };
        start.cells.iter().map(texel).collect()
    }

    /// The light after this many steps, and its sum over them: parts of lobes, or the light that beams sent in each
    /// direction.
    pub fn run(&self, start: &Cells, steps: u32) -> (Vec<f64>, Vec<Vec<f64>>) {
        let c = &self.context;
        let beams = matches!(self.rules, Rules::Beams(_));
        let group = if beams { [16, 4, 1] } else { [4; 3] };
        let parts = if beams { 2 } else { 4 };
        let fields = [self.field(parts, Some(&|part| self.texels(start, part))), self.field(parts, None)];
        let sums = self.field(if beams { 6 } else { 4 }, None);
        let packed = |p: &[f64; 6]| [pack([p[0], p[1]]), pack([p[2], p[3]]), pack([p[4], p[5]])];
        let passages: Vec<[u32; 3]> = start.passages.iter().map(packed).collect();
        let passages = upload(c, "passages", &passages).expect("an upload");
        let places = upload(c, "cascades", &[[0.0f32; 4]]).expect("an upload");
        let blockers = upload(c, "blockers", &[[0u32; 4]]).expect("an upload");
        let frame = upload(c, "frame", &[layout::Frame { scale: 1.0, ..Zeroable::zeroed() }]).expect("an upload");
        let sampler = Sampler::new(c, Filter::NEAREST, SamplerAddressMode::CLAMP_TO_EDGE).expect("a sampler");
        let mut recorder = Recorder::new(c, RecorderOptions::default()).expect("a recorder");
        recorder.zone("propagate", ZoneKind::Compute, 0, |r| {
            for step in 0..steps as usize {
                r.full_barrier();
                let (old, new) = (&fields[step % 2], &fields[(step + 1) % 2]);
                let binds = [
                    Bind::buffer("passages", &passages),
                    Bind::buffer("cascades", &places),
                    Bind::buffer("blockers", &blockers),
                    Bind::buffer("frame", &frame),
                    Bind::images("old_light", old.iter().map(Image::view), &sampler),
                    Bind::storage_images("new_light", new.iter().map(|part| part.mip_view(0))),
                    Bind::storage_images("sums", sums.iter().map(|part| part.mip_view(0))),
                ];
                let pipeline = if step == 0 { &self.first } else { &self.next };
                let push = LpvPush { scale: 1.0, ..LpvPush::zeroed() };
                r.dispatch(pipeline, &pipeline.select(&binds), &push, group.map(|threads| self.edge / threads));
            }
        });
        recorder.finish().expect("a dispatch");
        assert_eq!(c.take_validation_messages(), Vec::<String>::new());
        let read = |image: &Image| {
            let texels: Vec<[f32; 4]> = download_image(c, image, 0).expect("a field");
            let number = |[red, green, ..]: [f32; 4]| {
                assert!((2.0 * red - green).abs() <= 1e-5 * green.abs().max(1e-20), "channels differ: {red}, {green}");
                f64::from(red)
            };
            texels.into_iter().map(number).collect::<Vec<_>>()
        };
        (read(&fields[steps as usize % 2][0]), sums.iter().map(read).collect())
    }
}
