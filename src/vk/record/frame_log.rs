//! Log of the commands of a frame as plain data, which tests compare with a table of passes, stages and resources.

use super::zone::ZoneKind;
use crate::vk::pipeline::reflect::{ShaderStage, StageInfo};
use serde::Serialize;

/// The commands of one recording, zone by zone, in order.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FrameLog {
    pub zones: Vec<ZoneLog>,
}

impl FrameLog {
    /// All zones of that name.
    pub fn zones_named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a ZoneLog> {
        self.zones.iter().filter(move |zone| zone.name == name)
    }

    /// The log of a frame that continues in a second submission.
    #[must_use]
    pub fn then(mut self, later: Self) -> Self {
        self.zones.extend(later.zones);
        self
    }

    pub(in crate::vk) fn push(&mut self, zone: Option<(&'static str, ZoneKind)>, command: CommandLog) {
        let (name, kind) = zone.unwrap_or(("", ZoneKind::Transfer));
        match self.zones.last_mut().filter(|last| last.open && last.name == name) {
            Some(last) => last.commands.push(command),
            None => self.zones.push(ZoneLog { name, kind, commands: vec![command], open: true }),
        }
    }

    pub(in crate::vk) fn close(&mut self) {
        if let Some(last) = self.zones.last_mut() {
            last.open = false;
        }
    }
}

/// A zone with at least one command. Commands outside of zones have the empty name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ZoneLog {
    pub name: &'static str,
    pub kind: ZoneKind,
    pub commands: Vec<CommandLog>,
    #[serde(skip)]
    open: bool,
}

impl ZoneLog {
    pub fn draws(&self) -> impl Iterator<Item = &DrawLog> {
        self.commands.iter().filter_map(|command| if let CommandLog::Draw(draw) = command { Some(draw) } else { None })
    }

    pub fn dispatches(&self) -> impl Iterator<Item = &DispatchLog> {
        self.commands
            .iter()
            .filter_map(|command| if let CommandLog::Dispatch(dispatch) = command { Some(dispatch) } else { None })
    }

    /// The labels of the buffers that it fills.
    pub fn fills(&self) -> impl Iterator<Item = &str> {
        self.commands.iter().filter_map(|command| match command {
            CommandLog::Fill { buffer, .. } => Some(buffer.as_str()),
            _ => None,
        })
    }
}

/// One recorded command; sizes and offsets in bytes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandLog {
    Fill {
        buffer: String,
        offset: u64,
        bytes: u64,
        value: u32,
    },
    Update {
        buffer: String,
        offset: u64,
        bytes: u64,
    },
    /// All levels and layers are set to zero.
    Clear {
        image: String,
    },
    /// `bytes` is absent for copies of texels.
    Copy {
        from: String,
        to: String,
        bytes: Option<u64>,
    },
    /// The build of an acceleration structure.
    Build {
        structure: String,
        /// Labels of the buffers and structures that the build uses.
        uses: Vec<String>,
    },
    Draw(DrawLog),
    Dispatch(DispatchLog),
}

/// One colour or depth attachment of a draw.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct AttachmentLog {
    pub image: String,
    /// The name of the Vulkan format, such as `R16G16B16A16_SFLOAT`.
    pub format: String,
    pub level: u32,
    /// Texels of that level.
    pub width: u32,
    pub height: u32,
    pub layers: u32,
    pub samples: u32,
    /// The image that receives the average of the samples.
    pub resolve: Option<String>,
}

/// Attachments that a rendering scope draws into.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TargetLog {
    pub colors: Vec<AttachmentLog>,
    pub depth: Option<AttachmentLog>,
    /// Width in texels of the rendering scope.
    pub width: u32,
    pub height: u32,
    pub layers: u32,
}

/// One draw, with the pipeline's stages as reflected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DrawLog {
    pub pipeline: String,
    pub stages: Vec<StageInfo>,
    #[serde(flatten)]
    pub target: TargetLog,
    /// Whether the pipeline writes its colour attachments.
    pub color_write: bool,
    pub depth_write: bool,
    pub call: CallLog,
    /// Bindings: name, and labels of the bound resources.
    pub resources: Vec<(String, Vec<String>)>,
}

impl DrawLog {
    /// The shader file of a stage; `None` if the pipeline has no such stage.
    pub fn shader(&self, stage: ShaderStage) -> Option<&'static str> {
        self.stages.iter().find(|info| info.stage == stage).map(|info| info.shader)
    }
}

/// The source of a draw's counts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CallLog {
    Direct { vertices: u32, instances: u32 },
    Indirect { buffer: String, offset: u64 },
    Indexed { indices: u32 },
}

impl CallLog {
    /// Whether the call certainly draws nothing.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Direct { vertices, instances } => vertices * instances == 0,
            Self::Indexed { indices } => *indices == 0,
            Self::Indirect { .. } => false,
        }
    }

    /// Whether its counts are in the buffer with that label.
    pub fn reads(&self, label: &str) -> bool {
        matches!(self, Self::Indirect { buffer, .. } if buffer == label)
    }
}

/// One dispatch, with the shader as reflected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DispatchLog {
    pub pipeline: String,
    pub stages: Vec<StageInfo>,
    /// `None` for an indirect dispatch.
    pub groups: Option<[u32; 3]>,
    /// Position of the groups of an indirect dispatch: buffer and offset in bytes.
    pub indirect: Option<(String, u64)>,
    pub resources: Vec<(String, Vec<String>)>,
}
