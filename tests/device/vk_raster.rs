//! The Vulkan layer: rendering into layers, levels and samples; images and their views.

use crate::gpu;

use bytemuck::{Pod, Zeroable};
use twobounce::vk::{
    self, Bind, Buffer, BufferKind, CallLog, ColorTarget, CompareOp, Compute, ComputeDesc, DepthDesc, DepthTarget,
    DrawCall, Filter, Format, Image, ImageDesc, ImageDim, ImageRegion, ImageUsageFlags, Load, Raster, RasterDesc,
    Recorder, RecorderOptions, Rect, RenderTarget, Sampler, SamplerAddressMode, ShaderStage, VertexInput, ZoneKind,
};

/// A context that keeps a log.
const LOGGED: RecorderOptions = RecorderOptions { per_pass: false, steps: false, log: true };

fn volume(label: &str, edge: u32, format: Format) -> Image {
    let usage = ImageUsageFlags::COLOR_ATTACHMENT
        | ImageUsageFlags::SAMPLED
        | ImageUsageFlags::TRANSFER_SRC
        | ImageUsageFlags::TRANSFER_DST;
    let (width, height, depth_or_layers) = (edge, edge, edge);
    let desc = ImageDesc {
        label,
        dim: ImageDim::D3,
        format,
        width,
        height,
        depth_or_layers,
        mips: 2,
        usage,
        ..Default::default()
    };
    Image::new(&gpu::context(), &desc).unwrap()
}

fn cleared(view: vk::ImageView<'_>) -> ColorTarget<'_> {
    ColorTarget { view, resolve: None, load: Load::Clear([0.5; 4]), store: true }
}

/// One instance of a triangle draws each slice of a level of a 3D image, with and without a geometry shader.
#[test]
fn a_layered_draw_writes_every_slice() {
    let stages = [("test/slices.vert", None), ("test/slices_by_geometry.vert", Some("test/slices.geom"))];
    for (vertex, geometry) in stages {
        for level in [0, 1] {
            let coordinates = volume("coordinates", 8, Format::R32G32B32A32_SFLOAT);
            let constant = volume("constant", 8, Format::R16G16B16A16_SFLOAT);
            let edge = 8_u32 >> level;
            let pass = Raster::new(
                &gpu::context(),
                &RasterDesc {
                    label: "slices",
                    vertex,
                    geometry,
                    fragment: Some("test/slices.frag"),
                    color_formats: &[coordinates.format(), constant.format()],
                    ..Default::default()
                },
            )
            .unwrap();
            let mut recorder = Recorder::new(&gpu::context(), LOGGED).unwrap();
            recorder.zone("slices", ZoneKind::Raster, 0, |r| {
                let colors = [cleared(coordinates.attachment_view(level)), cleared(constant.attachment_view(level))];
                let (width, height, layers) = (edge, edge, edge);
                let target = RenderTarget { colors: &colors, width, height, layers, ..Default::default() };
                let instances = edge - 1; // the last slice keeps the clear value
                r.raster(&target, |scope| scope.draw(&pass, &[], &(), DrawCall::Direct { vertices: 3, instances }));
            });
            let log = recorder.frame_log().clone();
            recorder.finish().unwrap();

            let texels = vk::download_image::<[f32; 4]>(&gpu::context(), &coordinates, level).unwrap();
            assert_eq!(texels.len() as u32, edge.pow(3));
            for (index, texel) in texels.into_iter().enumerate() {
                let index = index as u32;
                let [x, y, z] = [index % edge, index / edge % edge, index / edge / edge];
                let drawn = [x as f32 + 0.5, y as f32 + 0.5, z as f32, 1.0];
                assert_eq!(texel, if z + 1 < edge { drawn } else { [0.5; 4] }, "texel {x} {y} {z}");
            }
            let halves = vk::download_image::<[u16; 4]>(&gpu::context(), &constant, level).unwrap();
            assert_eq!(halves[0], [0x3400; 4], "0.25 in half floats");

            let draw = log.zones[0].draws().next().unwrap();
            assert_eq!(draw.stages.len(), if geometry.is_some() { 3 } else { 2 });
            assert_eq!(draw.shader(ShaderStage::Geometry), geometry);
            assert_eq!(draw.stages.last().unwrap().outputs, 2);
            assert_eq!((draw.target.width, draw.target.height, draw.target.layers), (edge, edge, edge));
            assert_eq!(draw.call, CallLog::Direct { vertices: 3, instances: edge - 1 });
            let color = &draw.target.colors[1];
            assert_eq!((color.image.as_str(), color.format.as_str()), ("constant", "R16G16B16A16_SFLOAT"));
            assert_eq!((color.level, color.width, color.layers), (level, edge, edge));
        }
    }
    gpu::assert_clean(&gpu::context());
}

/// One RGBA8 array is sampled as UNORM and as sRGB, two volumes as an array of samplers, and an image is stored to.
#[test]
fn images_are_sampled_stored_and_viewed_in_another_format() {
    let storage = ImageUsageFlags::STORAGE;
    let transfer = ImageUsageFlags::TRANSFER_SRC | ImageUsageFlags::TRANSFER_DST;
    let textures = Image::new(
        &gpu::context(),
        &ImageDesc {
            label: "textures",
            dim: ImageDim::D2Array,
            format: Format::R8G8B8A8_UNORM,
            width: 4,
            height: 4,
            depth_or_layers: 2,
            usage: ImageUsageFlags::SAMPLED | transfer,
            view_formats: &[Format::R8G8B8A8_SRGB],
            ..Default::default()
        },
    )
    .unwrap();
    vk::upload_image(&gpu::context(), &textures, ImageRegion::layer(&textures, 0, 1), &[[188_u8; 4]; 16]).unwrap();
    let volumes = [volume("a", 4, Format::R32G32B32A32_SFLOAT), volume("b", 4, Format::R32G32B32A32_SFLOAT)];
    vk::upload_image(&gpu::context(), &volumes[0], ImageRegion::level(&volumes[0], 0), &[[2_f32; 4]; 64]).unwrap();
    vk::upload_image(&gpu::context(), &volumes[1], ImageRegion::level(&volumes[1], 1), &[[3_f32; 4]; 8]).unwrap();
    let written = Image::new(
        &gpu::context(),
        &ImageDesc {
            label: "written",
            dim: ImageDim::D3,
            format: Format::R16G16B16A16_SFLOAT,
            usage: storage | transfer,
            ..Default::default()
        },
    )
    .unwrap();
    let sampler = Sampler::new(&gpu::context(), Filter::LINEAR, SamplerAddressMode::CLAMP_TO_BORDER).unwrap();
    let result = vk::upload(&gpu::context(), "result", &[[0_f32; 4]; 4]).unwrap();
    let pass =
        Compute::new(&gpu::context(), &ComputeDesc { label: "sample", shader: "test/sample.comp", constants: &[] })
            .unwrap();
    let mut recorder = Recorder::new(&gpu::context(), RecorderOptions::default()).unwrap();
    let binds = [
        Bind::images("volume", volumes.iter().map(Image::view), &sampler),
        Bind::image("unorm", textures.view(), &sampler),
        Bind::image("srgb", textures.view_as(Format::R8G8B8A8_SRGB), &sampler),
        Bind::storage_image("written", written.mip_view(0)),
        Bind::buffer("result", &result),
    ];
    recorder.dispatch(&pass, &binds, &(), [1, 1, 1]);
    recorder.finish().unwrap();
    let result = vk::download::<[f32; 4]>(&gpu::context(), &result).unwrap();
    assert_eq!(result[0], [2.0; 4]);
    assert_eq!(result[1], [3.0; 4]);
    // 188/255 is sRGB for 0.503; drivers decode through a table that is good to about 8 bits.
    assert!((result[2][0] - 188.0 / 255.0).abs() < 1e-3 && (result[2][3] - 188.0 / 255.0).abs() < 1e-3, "{result:?}");
    assert!((result[3][0] - 0.503).abs() < 4e-3 && (result[3][3] - 188.0 / 255.0).abs() < 1e-3, "{result:?}");
    let texel = vk::download_image::<[u16; 4]>(&gpu::context(), &written, 0).unwrap();
    assert_eq!(texel, [[0x4700; 4]], "7 in half floats");
    gpu::assert_clean(&gpu::context());
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Vertex {
    position: [f32; 3],
    color: [f32; 4],
}

fn attachment(label: &str, format: Format, samples: u32, usage: ImageUsageFlags) -> Image {
    let desc = ImageDesc { label, format, width: 8, height: 8, samples, usage, ..Default::default() };
    Image::new(&gpu::context(), &desc).unwrap()
}

/// An indexed mesh with depth test into four samples of RGBA32F, averaged into one.
#[test]
fn four_samples_are_averaged_and_depth_decides() {
    let color_usage = ImageUsageFlags::COLOR_ATTACHMENT;
    let format = Format::R32G32B32A32_SFLOAT;
    let color = attachment("color", format, 4, color_usage);
    let depth = attachment("depth", Format::D32_SFLOAT, 4, ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT);
    let resolved = attachment("resolved", format, 1, color_usage | ImageUsageFlags::TRANSFER_SRC);
    let pass = Raster::new(
        &gpu::context(),
        &RasterDesc {
            label: "mesh",
            vertex: "test/mesh.vert",
            fragment: Some("test/mesh.frag"),
            vertex_input: Some(VertexInput {
                stride: size_of::<Vertex>() as u32,
                attributes: &[(0, Format::R32G32B32_SFLOAT, 0), (1, Format::R32G32B32A32_SFLOAT, 12)],
            }),
            color_formats: &[format],
            depth: Some(DepthDesc { format: Format::D32_SFLOAT, compare: CompareOp::LESS, write: true }),
            samples: 4,
            ..Default::default()
        },
    )
    .unwrap();
    // The near quad covers the left half and half of pixel column 4; the far one, drawn later, everything.
    let quad = |right: f32, z: f32, color: [f32; 4]| {
        [[-1.0, -1.0], [right, -1.0], [-1.0, 1.0], [right, 1.0]].map(|[x, y]| Vertex { position: [x, y, z], color })
    };
    let vertices = [quad(0.125, 0.2, [8.0, 0.0, 0.0, 1.0]), quad(1.0, 0.7, [0.0, 4.0, 0.0, 1.0])].concat();
    let vertices = vk::upload(&gpu::context(), "vertices", &vertices).unwrap();
    let indices = vk::upload(&gpu::context(), "indices", &[99_u32, 0, 1, 2, 2, 1, 3]).unwrap();
    let mut recorder = Recorder::new(&gpu::context(), LOGGED).unwrap();
    recorder.zone("mesh", ZoneKind::Raster, 0, |r| {
        let resolve = Some(resolved.attachment_view(0));
        let colors =
            [ColorTarget { view: color.attachment_view(0), resolve, load: Load::Clear([0.0; 4]), store: false }];
        let depth = Some(DepthTarget { view: depth.attachment_view(0), load: Load::Clear(1.0), store: false });
        let area = Some(Rect { x: 0, y: 0, width: 8, height: 7 });
        let target = RenderTarget { colors: &colors, depth, width: 8, height: 8, ..Default::default() };
        r.raster(&target, |_| {});
        r.full_barrier();
        let target = RenderTarget { area, ..target };
        r.raster(&target, |draws| {
            for vertex_offset in [0, 4] {
                let (vertices, indices) = (&vertices, &indices);
                let (index_count, first_index) = (6, 1);
                let call = DrawCall::Indexed { vertices, indices, index_count, first_index, vertex_offset };
                draws.draw(&pass, &[], &(), call);
            }
        });
    });
    let log = recorder.frame_log().clone();
    recorder.finish().unwrap();
    let texels = vk::download_image::<[f32; 4]>(&gpu::context(), &resolved, 0).unwrap();
    let pixel = |x: usize, y: usize| texels[y * 8 + x];
    assert_eq!(pixel(1, 3), [8.0, 0.0, 0.0, 1.0], "near");
    assert_eq!(pixel(4, 3), [4.0, 2.0, 0.0, 1.0], "two samples of four are near");
    assert_eq!(pixel(6, 3), [0.0, 4.0, 0.0, 1.0], "far");
    assert_eq!(pixel(1, 7), [0.0; 4], "outside of the area");
    let draw = log.zones[0].draws().next().unwrap();
    assert_eq!(draw.target.colors[0].resolve.as_deref(), Some("resolved"));
    assert_eq!((draw.target.colors[0].samples, draw.target.depth.as_ref().unwrap().samples), (4, 4));
    assert_eq!(log.zones[0].draws().count(), 2);
    gpu::assert_clean(&gpu::context());
}

/// A masked pass draws nothing, an indirect one reads its counts from a buffer, and rows are copied by their offset.
#[test]
fn masked_and_indirect_draws_and_rows() {
    let usage = ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::TRANSFER_SRC;
    let format = Format::R32G32B32A32_SFLOAT;
    let images = [attachment("drawn", format, 1, usage), attachment("masked", format, 1, usage)];
    let counts = vk::upload(&gpu::context(), "counts", &[0_u32, 3, 1, 0, 0]).unwrap();
    let rows = Buffer::new(&gpu::context(), "rows", 8 * 2 * 16, BufferKind::Readback).unwrap();
    for (image, color_write) in images.iter().zip([true, false]) {
        let pass = Raster::new(
            &gpu::context(),
            &RasterDesc {
                label: "masked",
                vertex: "test/slices.vert",
                fragment: Some("test/slices.frag"),
                color_formats: &[format, format],
                masked: !color_write,
                ..Default::default()
            },
        )
        .unwrap();
        let other = attachment("other", format, 1, usage);
        let mut recorder = Recorder::new(&gpu::context(), LOGGED).unwrap();
        let colors = [cleared(image.attachment_view(0)), cleared(other.attachment_view(0))];
        let target = RenderTarget { colors: &colors, width: 8, height: 8, ..Default::default() };
        recorder
            .raster(&target, |scope| scope.draw(&pass, &[], &(), DrawCall::Indirect { buffer: &counts, offset: 4 }));
        recorder.full_barrier();
        recorder.copy_image_to_buffer(image, ImageRegion::rows(image, 0, 5, 2), &rows, 0);
        let log = recorder.frame_log().clone();
        recorder.finish().unwrap();
        let expected = if color_write { [2.5, 6.5, 0.0, 1.0] } else { [0.5; 4] };
        assert_eq!(rows.read::<[f32; 4]>()[8 + 2], expected, "pixel 2 of row 6");
        let draw = log.zones[0].draws().next().unwrap();
        assert_eq!(draw.color_write, color_write);
        assert_eq!(draw.call, CallLog::Indirect { buffer: "counts".into(), offset: 4 });
    }
    gpu::assert_clean(&gpu::context());
}

#[test]
fn too_large_an_image_is_refused_in_one_sentence() {
    let (format, usage) = (Format::R8G8B8A8_UNORM, ImageUsageFlags::SAMPLED);
    let width = gpu::context().limits.max_image_dimension2_d + 1;
    let desc = ImageDesc { label: "texture", format, width, usage, ..Default::default() };
    let Err(error) = Image::new(&gpu::context(), &desc) else { panic!("accepted") };
    let message = error.to_string();
    assert!(matches!(error, twobounce::Error::Memory(_)), "{message}");
    assert!(message.contains("texture") && message.contains(&width.to_string()), "{message}");
    gpu::assert_clean(&gpu::context());
}
