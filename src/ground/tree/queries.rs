//! Rays by the device's ray queries: an acceleration structure over the recorded triangles replaces the tree. It is
//! rebuilt with every record. Reads: triangles, slots, tree links (here the sources). Writes: query corners, the
//! structure. `tests/device/rays_oracle.rs` checks it.

use std::sync::Arc;

use super::super::memory_plan::MemoryRow;
use super::super::scene_on_gpu::SceneDraw;
use super::super::{layout, over_threads};
use crate::scene::Scene;
use crate::settings::{Settings, Tracer};
use crate::vk::{
    Bind, Buffer, BufferKind, Compute, ComputeDesc, Constant, Context, Recorder, Structure, StructureDesc,
    StructureSize, TriangleCorners,
};
use crate::{Error, Result};

/// Threads of a workgroup.
const GROUP: u32 = 64;
/// The shader relies on this size.
const _: () = assert!(size_of::<layout::Triangle>() == 4 * size_of::<[f32; 3]>());

/// The plan of a scene's acceleration structure, before it is created.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueryPlan {
    desc: StructureDesc,
    size: StructureSize,
}

impl QueryPlan {
    /// The plan for a scene on a device; `None` if rays are traced through the tree.
    ///
    /// # Errors
    /// The settings request queries, and the device has none.
    pub fn of_scene(context: &Context, scene: &Scene, settings: &Settings) -> Result<Option<Self>> {
        let (tracer, there) = (settings.of.rays.tracer, context.has_ray_queries());
        if tracer == Tracer::Query && !there {
            return Err(Error::Device(format!(
                "rays.tracer = query needs VK_KHR_ray_query and VK_KHR_acceleration_structure, which {} does not offer or which were not \
                 enabled: set rays.tracer to auto or tree, or choose another device",
                context.name
            )));
        }
        let plan = || {
            let desc = of_scene(scene);
            Self { desc, size: desc.size(context) }
        };
        Ok((there && tracer != Tracer::Tree).then(plan))
    }

    pub fn plan(&self) -> Vec<MemoryRow> {
        let triangles = u64::from(self.desc.opaque + self.desc.translucent);
        vec![
            ("tree links", 4 * (1 + triangles)),
            ("tree boxes", 0),
            ("query corners", 12 * triangles),
            ("acceleration structure", self.size.triangles),
            ("acceleration top", self.size.top),
            ("acceleration instance", StructureDesc::INSTANCE),
            ("acceleration scratch", self.size.scratch),
        ]
    }
}

fn of_scene(scene: &Scene) -> StructureDesc {
    let moves = scene.moving_nodes();
    let mut desc = StructureDesc::default();
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let translucent = scene.materials[mesh.material].lets_rays_pass();
        *(if translucent { &mut desc.translucent } else { &mut desc.opaque }) += mesh.indices.len() as u32 / 3;
        desc.moving |= moves[instance.node] || mesh.deform.is_some();
    }
    desc
}

/// The structure and its inputs.
pub struct Queries {
    structure: Structure,
    corners: Buffer,
    namer: Compute,
}

/// The number of opaque triangles of `draws`, then the sources of opaque triangles, and those of the others.
pub fn links(draws: &[SceneDraw]) -> Vec<u32> {
    let sources = |translucent: bool| {
        let of = move |draw: &&SceneDraw| draw.translucent == translucent;
        draws.iter().filter(of).flat_map(|draw| (draw.first_source..).take(draw.index_count as usize / 3))
    };
    let mut links = vec![sources(false).count() as u32];
    links.extend(sources(false).chain(sources(true)));
    links
}

impl Queries {
    /// `links` is a result of [`links`].
    pub fn new(context: &Arc<Context>, constants: &[Constant], scene: &Scene, links: &[u32]) -> Result<Self> {
        let triangles = links.len() as u32 - 1;
        let desc = StructureDesc { opaque: links[0], translucent: triangles - links[0], ..of_scene(scene) };
        let namer = ComputeDesc { label: "query corners", shader: "ground/query_corners.comp", constants };
        Ok(Self {
            structure: Structure::new(context, desc)?,
            corners: Buffer::new(context, "query corners", 12 * u64::from(triangles), BufferKind::Device)?,
            namer: Compute::new(context, &namer)?,
        })
    }

    /// Builds the structure over the recorded `triangles`. `binds` hold the data that locates them.
    pub fn record(&self, r: &mut Recorder, triangles: &Buffer, binds: &[Bind]) {
        let StructureDesc { opaque, translucent, .. } = *self.structure.desc();
        r.full_barrier(); // the triangles were recorded, and the previous frame traversed the structure
        if opaque + translucent > 0 {
            let mut binds = binds.to_vec();
            binds.push(Bind::buffer("query_corners", &self.corners));
            r.dispatch(&self.namer, &binds, &(opaque + translucent), over_threads(opaque + translucent, GROUP));
            r.full_barrier(); // the corners are written
        }
        r.build(&self.structure, &TriangleCorners { indices: &self.corners, positions: triangles });
    }

    pub fn bind(&self) -> Bind<'_> {
        Bind::structure("scene_structure", &self.structure)
    }

    pub fn bytes(&self) -> u64 {
        self.structure.bytes()
    }
}
