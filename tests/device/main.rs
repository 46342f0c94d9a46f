//! Tests that run on a device: passes against their twins and closed forms, the Vulkan layer, frames, hosts. All tests
//! share one device under the validation layers.

#[path = "../common/functions.rs"]
mod functions;
#[path = "../common/gloss.rs"]
mod gloss;
#[path = "../common/gpu.rs"]
mod gpu;
#[path = "../../examples/pages/kinds.rs"]
mod kinds;
#[path = "../common/more.rs"]
mod more;
#[path = "../common/nonsense.rs"]
mod nonsense;
#[path = "../common/photons.rs"]
mod photons;
#[path = "../fuzz/random.rs"]
mod random;
#[path = "../common/scenes.rs"]
mod scenes;
#[path = "../common/studio.rs"]
mod studio;
#[path = "../common/traced.rs"]
mod traced;
mod vk_common;

mod cone_sum;
mod deform;
mod frame_asks;
mod frame_parts;
mod functions_cones;
mod functions_geometry;
mod functions_photons;
mod host;
mod layers;
mod layouts;
mod light_on_demand;
mod lpv;
mod nonsense_drawn;
mod passes_boxes;
mod passes_cells;
mod passes_direct;
mod passes_frame;
mod passes_gather;
mod passes_gloss;
mod passes_light;
mod passes_lpv;
mod passes_order;
mod passes_photons;
mod passes_probes;
mod passes_reuse;
mod passes_shade;
mod passes_tree;
mod passes_voxelise;
mod paths;
mod photons_light;
mod probes;
mod profile_counts;
mod rays_bounces;
mod rays_items;
mod rays_oracle;
mod robust;
mod shadow_edges;
mod sky;
mod sky_map;
mod tracers;
mod vk_compute;
mod vk_flight;
mod vk_heap;
mod vk_host;
mod vk_raster;
mod vk_validation;
