//! Layered draws against dispatches of equal work, per pass.

use std::path::Path;
use std::sync::Arc;

use twobounce::ground::Ground;
use twobounce::ground::constants::{Features, constants, with};
use twobounce::ground::volume::{FACE_VOLUME, FACES, FORMAT, LightVolume};
use twobounce::lab::specimen::Specimen;
use twobounce::lab::table::{fill_file, markdown};
use twobounce::measure::timing::Spread;
use twobounce::settings::{Settings, Shadows};
use twobounce::vk::{
    Bind, Compute, ComputeDesc, Constant, Context, ContextOptions, Raster, RasterDesc, Recorder, RecorderOptions,
    ZoneKind, ZoneTiming, download_image,
};
use twobounce::{Error, Result};

/// Times that every pass is run in every form, one form after the other; the first time does not count.
const ROUNDS: usize = 9;
/// Threads of a workgroup: a tile of a slice, and a cube.
const SHAPES: [[u32; 3]; 2] = [[8, 8, 1], [4, 4, 4]];
/// The constants for these sizes (`glsl/gi/cones/measured/`).
const SHAPE: [&str; 3] = ["local_size_x", "local_size_y", "local_size_z"];

pub fn run() -> Result<()> {
    let context = Context::new(&ContextOptions::default())?;
    let head = "scene|pass|CPU ms: draw|8×8×1|4×4×4|CPU: draw / 8×8×1|draw / 4×4×4|time: draw / 8×8×1|draw / 4×4×4|\
                busy: draw, 8×8×1, 4×4×4";
    let mut rows = Vec::new();
    for (name, voxels) in [("cornell-point", 64), ("cornell-point", 128), ("gallery", 64)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("assets/{name}.glb"));
        for pass in measure(&context, Specimen::load(path)?, &Settings { voxels, ..Settings::printed() }, ROUNDS)? {
            rows.push(pass.row(&format!("{name}, {voxels}³")));
        }
    }
    let section =
        format!("## {} ({})\n\n{}", context.name, context.driver, markdown(head.split('|'), "--:::::::-", rows));
    print!("{section}");
    fill_file(&Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/notes/layers.md"), |_, old| {
        Ok(with_section(old, &section))
    })?;
    Ok(())
}

/// The sections of all drivers; that of this one is written again.
fn with_section(before: &str, section: &str) -> String {
    let heading = section.lines().next();
    let mut sections: Vec<&str> = before.split("\n\n## ").map(|section| section.trim_start_matches("## ")).collect();
    sections.retain(|other| {
        !other.is_empty() && heading != Some(&format!("## {}", other.lines().next().unwrap_or_default()))
    });
    sections.push(section.trim_start_matches("## "));
    sections.sort();
    sections.iter().map(|section| format!("## {}\n\n", section.trim())).collect()
}

/// A pass in all of its forms, round by round: the draw, then a dispatch per shape.
pub struct MeasuredPass {
    pass: &'static str,
    /// Draws or dispatches in one timing.
    times: u32,
    rounds: Vec<Vec<ZoneTiming>>,
}

impl MeasuredPass {
    fn row(&self, scene: &str) -> Vec<String> {
        let median = |number: &dyn Fn(&[ZoneTiming]) -> f64| {
            Spread::of_values(self.rounds.iter().map(|round| number(round))).median
        };
        let cpu = |zone: &ZoneTiming| zone.cpu_ms.unwrap_or(f64::NAN);
        let ms = |form: usize| format!("{:.1}", median(&|r| cpu(&r[form]) / f64::from(self.times)));
        let cpu_ratio = |form: usize| format!("{:.2}", median(&|r| cpu(&r[0]) / cpu(&r[form])));
        let ratio = |form: usize| format!("{:.2}", median(&|r| r[0].gpu_ms / r[form].gpu_ms));
        let busy = |form: usize| format!("{:.2}", median(&|r| cpu(&r[form]) / r[form].wall_ms.unwrap_or(f64::NAN)));
        let mut cells = vec![scene.to_owned(), self.pass.to_owned()];
        cells.extend([ms(0), ms(1), ms(2), cpu_ratio(1), cpu_ratio(2), ratio(1), ratio(2)]);
        cells.push([busy(0), busy(1), busy(2)].join(", "));
        cells
    }
}

/// One pass: its shaders and constants, and the levels of a volume that it fills.
struct Pass<'a> {
    name: &'static str,
    fragment: &'a str,
    compute: &'a str,
    constants: &'a [Constant],
    /// Fills levels from 1 on, each from the one below, instead of level 0.
    mips: bool,
}

/// Runs every pass in all forms, and checks that they fill volumes with equal bits.
///
/// # Errors
/// The bits differ, or the device is lost.
pub fn measure(
    context: &Arc<Context>,
    specimen: Specimen,
    settings: &Settings,
    rounds: usize,
) -> Result<Vec<MeasuredPass>> {
    let mut renderer = specimen.renderer(context, settings, specimen.options((16, 16)))?;
    renderer.render(&specimen.pose, &specimen.view)?;
    let frame = renderer.frame();
    let shading = with(constants(settings, Features::of_settings(&specimen.scene, settings)), frame.method.constants());
    let unshadowed = with(shading.clone(), &[("SHADOWS", Shadows::None.into())]);
    let pass = |name, fragment, compute, constants| Pass { name, fragment, compute, constants, mips: name == "mips" };
    let passes = [
        pass("shade 1", "gi/cones/shade.frag", "gi/cones/measured/shade.comp", &unshadowed[..]),
        pass("shade 2", "gi/cones/shade.frag LOOK_UP", "gi/cones/measured/shade.comp LOOK_UP", &shading),
        pass("mips", "gi/cones/mips.frag", "gi/cones/measured/mips.comp", &shading),
    ];
    // One volume per form: the mips read the result of shade 2.
    let volume = |_| LightVolume::new(context, FACE_VOLUME, 0, settings.voxels);
    let volumes = (0..3).map(volume).collect::<Result<Vec<_>>>()?;
    let look_up = frame.method.binds(&frame.ground);
    let run = |pass: &Pass| {
        let forms = pass.forms(context, settings)?;
        let mut measured = MeasuredPass { pass: pass.name, times: pass.times(), rounds: Vec::new() };
        for round in 0..=rounds {
            let times = forms.iter().zip(&volumes).map(|(form, volume)| {
                let mut recorder =
                    Recorder::new(context, RecorderOptions { per_pass: true, ..RecorderOptions::default() })?;
                pass.record(&mut recorder, form, &frame.ground, volume, &look_up);
                Ok(recorder.finish()?.zones.remove(0))
            });
            let times = times.collect::<Result<Vec<_>>>()?;
            if round > 0 {
                measured.rounds.push(times);
            }
        }
        let bits = |volume: &LightVolume| {
            let levels = if pass.mips { 1..volume.levels } else { 0..1 };
            let texels = levels.flat_map(|level| volume.images.iter().map(move |face| (face, level)));
            texels.map(|(face, level)| download_image::<[u16; 4]>(context, face, level)).collect::<Result<Vec<_>>>()
        };
        let drawn = bits(&volumes[0])?;
        if bits(&volumes[1])? != drawn || bits(&volumes[2])? != drawn {
            return Err(Error::Device(format!("{}: draw and dispatch differ", pass.name)));
        }
        Ok(measured)
    };
    passes.iter().map(run).collect()
}

enum Form {
    Draw(Raster),
    Dispatch(Compute, [u32; 3]),
}

impl Pass<'_> {
    /// Runs per timing: mips are too short for one clock reading.
    fn times(&self) -> u32 {
        if self.mips { 10 } else { 1 }
    }

    fn forms(&self, context: &Arc<Context>, settings: &Settings) -> Result<Vec<Form>> {
        assert!(settings.voxels >= 8, "workgroups are up to 8 wide");
        let desc = RasterDesc {
            label: self.name,
            vertex: "gi/cones/layered.vert",
            fragment: Some(self.fragment),
            constants: self.constants,
            color_formats: &[FORMAT; FACES],
            ..Default::default()
        };
        let mut forms = vec![Form::Draw(Raster::new(context, &desc)?)];
        for shape in SHAPES {
            let sizes = [0, 1, 2].map(|axis| (SHAPE[axis], shape[axis].into()));
            let constants = with(self.constants.to_vec(), &sizes);
            let desc = ComputeDesc { label: self.name, shader: self.compute, constants: &constants };
            forms.push(Form::Dispatch(Compute::new(context, &desc)?, shape));
        }
        Ok(forms)
    }

    #[allow(clippy::too_many_arguments, reason = "one call records a form of a pass")]
    fn record(&self, r: &mut Recorder, form: &Form, ground: &Ground, volume: &LightVolume, look_up: &[Bind]) {
        let kind = if matches!(form, Form::Draw(..)) { ZoneKind::Raster } else { ZoneKind::Compute };
        r.zone(self.name, kind, 0, |r| {
            let levels = if self.mips { 1..volume.levels } else { 0..1 };
            for level in (0..self.times()).flat_map(|_| levels.clone()) {
                r.full_barrier(); // the level below, or the volume before, was written
                let edge = volume.edge >> level;
                let mut binds = ground.item_binds(&ground.base().lit_items, &ground.base().item_lights);
                if self.mips {
                    binds = volume.sources(level);
                } else {
                    binds.extend_from_slice(look_up);
                }
                match form {
                    Form::Draw(pipeline) => volume.draw(r, pipeline, &pipeline.select(&binds), level),
                    Form::Dispatch(pipeline, shape) => {
                        binds.extend(volume.targets(level));
                        r.dispatch(
                            pipeline,
                            &pipeline.select(&binds),
                            &(),
                            shape.map(|threads| edge.div_ceil(threads)),
                        );
                    }
                }
            }
        });
    }
}
