//! An audit of a frame by passes and resources: it finds work and memory that the scene does not need.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::Result;
use crate::renderer::{RenderOptions, Renderer};
use crate::scene::Still;
use crate::settings::Settings;
use crate::vk::{AttachmentLog, CallLog, CommandLog, Context, FrameLog};

/// Resources below this size in bytes are placeholders, because shaders that may read them need a binding.
pub const PLACEHOLDER: u64 = 1024;

/// Passes and resources of a frame from scratch.
#[derive(Clone, Debug)]
pub struct Audit {
    pub passes: Vec<PassUse>,
    pub resources: Vec<ResourceUse>,
    /// The number of pipelines that were made for it.
    pub pipelines: u64,
    /// The pipelines that it used, by their shaders.
    pub used: BTreeSet<String>,
}

/// A pass that ran.
#[derive(Clone, Debug)]
pub struct PassUse {
    pub name: &'static str,
    /// The number of draws and dispatches.
    pub calls: usize,
    /// The number of those without vertices or groups.
    pub empty: usize,
}

/// Allocated memory, and the passes that use it.
#[derive(Clone, Debug)]
pub struct ResourceUse {
    pub name: &'static str,
    pub bytes: u64,
    /// Passes that bind it, draw into it or copy it, without those that only fill it.
    pub used_by: BTreeSet<&'static str>,
}

impl ResourceUse {
    /// Whether it is more than a placeholder and no pass uses its content.
    pub fn superfluous(&self) -> bool {
        self.bytes > PLACEHOLDER && self.used_by.is_empty()
    }
}

impl Audit {
    /// Renders a frame and examines the recording.
    ///
    /// # Errors
    /// Errors of the renderer.
    pub fn of_frame(
        context: &Arc<Context>,
        Still { scene, pose, view }: Still,
        settings: &Settings,
        options: RenderOptions,
    ) -> Result<Self> {
        let before = context.compiled_pipelines();
        let mut renderer = Renderer::new(context, scene.clone(), pose, settings.clone(), options)?;
        renderer.render(pose, view)?;
        renderer.keep_log();
        renderer.make_anew();
        renderer.render(pose, view)?;
        let pipelines = context.compiled_pipelines() - before;
        let log = renderer.log().cloned().unwrap_or_default();
        let resource = |&(name, bytes): &(&'static str, u64)| {
            let using = log.zones.iter().filter(|zone| zone.commands.iter().any(|command| uses(command, name)));
            ResourceUse { name, bytes, used_by: using.map(|zone| zone.name).collect() }
        };
        let resources = renderer.plan().rows.iter().map(resource).collect();
        let used = log.zones.iter().flat_map(|zone| &zone.commands).filter_map(shaders).collect();
        Ok(Self { passes: passes(&log), resources, pipelines, used })
    }

    pub fn bytes(&self) -> u64 {
        self.resources.iter().map(|resource| resource.bytes).sum()
    }

    /// A sentence for each superfluous pass and resource.
    pub fn superfluous(&self) -> Vec<String> {
        let bytes = |r: &ResourceUse| format!("{}: {} bytes that no pass uses", r.name, r.bytes);
        let mut said: Vec<String> = self.resources.iter().filter(|r| r.superfluous()).map(bytes).collect();
        let idle = self.passes.iter().filter(|pass| pass.calls > 0 && pass.empty == pass.calls);
        said.extend(idle.map(|pass| format!("{}: a pass of nothing", pass.name)));
        said
    }

    /// Differences between two frames in both directions: passes, pipelines, bytes.
    pub fn beside(&self, other: &Self) -> Vec<String> {
        let lacks = |own: &Self, other: &Self, word: &str| -> Vec<String> {
            let has = |name: &str| other.passes.iter().any(|pass| pass.name == name);
            own.passes.iter().filter(|pass| !has(pass.name)).map(|pass| format!("{word} pass {}", pass.name)).collect()
        };
        let mut said = [lacks(self, other, "the"), lacks(other, self, "not the")].concat();
        let more = self.pipelines as i64 - other.pipelines as i64;
        if more != 0 {
            said.push(format!("{more:+} pipelines"));
        }
        // A method with its own grids has some resources several times.
        let bytes =
            |audit: &Self, name| audit.resources.iter().filter(|r| r.name == name).map(|r| r.bytes as i64).sum::<i64>();
        let names: BTreeSet<&str> = self.resources.iter().chain(&other.resources).map(|r| r.name).collect();
        let changes = names.into_iter().map(|name| (name, bytes(self, name) - bytes(other, name)));
        said.extend(changes.filter(|(_, more)| *more != 0).map(|(name, more)| format!("{name}: {more:+} bytes")));
        said
    }
}

fn passes(log: &FrameLog) -> Vec<PassUse> {
    let mut passes: Vec<PassUse> = Vec::new();
    for zone in log.zones.iter().filter(|zone| !zone.name.is_empty()) {
        let place = passes.iter().position(|pass| pass.name == zone.name).unwrap_or(passes.len());
        if place == passes.len() {
            passes.push(PassUse { name: zone.name, calls: 0, empty: 0 });
        }
        passes[place].calls += zone.draws().count() + zone.dispatches().count();
        passes[place].empty += zone.draws().filter(|draw| draw.call.is_empty()).count()
            + zone.dispatches().filter(|dispatch| dispatch.groups.is_some_and(|groups| groups.contains(&0))).count();
    }
    passes
}

/// Whether a label belongs to a resource of a plan, or to a part of one.
fn is(label: &str, name: &str) -> bool {
    match name {
        "image" => label == "beauty",
        "first bounce's volume" => label.starts_with("first bounce"),
        "second bounce's volume" => label.starts_with("second bounce"),
        // Images with several parts are numbered.
        _ => label.strip_prefix(name).is_some_and(|rest| rest.chars().all(|c| c == ' ' || c.is_ascii_digit())),
    }
}

fn uses(command: &CommandLog, name: &str) -> bool {
    let bound = |resources: &[(String, Vec<String>)]| resources.iter().flat_map(|r| &r.1).any(|label| is(label, name));
    match command {
        CommandLog::Copy { from, to, .. } => is(from, name) || is(to, name),
        CommandLog::Build { structure, uses } => is(structure, name) || uses.iter().any(|label| is(label, name)),
        CommandLog::Draw(draw) => {
            let drawn = draw.target.colors.iter().chain(&draw.target.depth);
            let into = |a: &AttachmentLog| is(&a.image, name) || a.resolve.as_ref().is_some_and(|r| is(r, name));
            // Vertices are bound without a name.
            let vertices = name.starts_with("scene ") && matches!(draw.call, CallLog::Indexed { .. });
            bound(&draw.resources) || drawn.into_iter().any(into) || draw.call.reads(name) || vertices
        }
        CommandLog::Dispatch(dispatch) => {
            bound(&dispatch.resources) || dispatch.indirect.as_ref().is_some_and(|(buffer, _)| is(buffer, name))
        }
        _ => false,
    }
}

fn shaders(command: &CommandLog) -> Option<String> {
    let (pipeline, stages) = match command {
        CommandLog::Draw(draw) => (&draw.pipeline, &draw.stages),
        CommandLog::Dispatch(dispatch) => (&dispatch.pipeline, &dispatch.stages),
        _ => return None,
    };
    let names: Vec<&str> = stages.iter().map(|stage| stage.shader).collect();
    Some(format!("{pipeline}: {}", names.join(" ")))
}
